"""DDS Security switched on: who still reads, who still forges, and what happens when keys end or are changed."""
import datetime
import json
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "system"))
import bed as beds  # noqa: E402
import calm  # noqa: E402
from bed import check, check_timing, is_valid, milliseconds, rate_hz, say  # noqa: E402
from lan_relay import LOOPBACK_OUTGOING, for_everybody, udp_payload  # noqa: E402

LISTENING_S = 10
ENDINGS = 12
GUEST_S, DAEMON_S = 14, 20  # from when keys are made to when they end
FORGED = 60
CONFIGURATION_ERROR = 78
UNAVAILABLE = 69
FIRST_PORT, LAST_PORT = 7410, 7430  # unicast ports of the first participants of domain 0


class Room:
    """Keys made as a person makes them."""

    def __init__(self, bed, name="room", until_s=None):
        self.bed = bed
        self.folder = bed.folder / name
        self.keys("make-room", self.folder, *self.until(until_s))

    @staticmethod
    def until(until_s):
        """Arguments for keys that end in so many seconds."""
        if until_s is None:
            return ()
        end = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(seconds=until_s)
        return ("--until", end.strftime("%Y-%m-%dT%H:%M:%SZ"))

    def keys(self, *arguments):
        done = self.bed.tubectl("keys", *map(str, arguments))
        check(done.returncode == 0, f"tubectl keys {arguments} exits with {done.returncode}: {done.stderr}")

    def end_of(self, identity):
        """When its keys expire, seconds since 1970."""
        shown = json.loads(self.bed.tubectl("keys", "show", self.of(identity), "--json").stdout)
        end = datetime.datetime.strptime(shown[0]["valid_until"], "%Y-%m-%dT%H:%M:%SZ")
        return end.replace(tzinfo=datetime.timezone.utc).timestamp()

    def of(self, identity):
        return str(self.folder / identity)

    def installed(self, identity):
        """A copy where the identity is used, as systemd/README.md says: renewing does not reach it by itself."""
        place = self.bed.folder / f"installed-{identity}"
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(self.of(identity), place)
        return str(place)


def secured(bed, keys, **options):
    """The text of a configuration with keys."""
    return bed.simulation(**options).replace("[dds]\n", f'[dds]\nsecurity = "{keys}"\n', 1)


def open_instrument(bed):
    """A configuration without keys, for another instrument: what an eavesdropper can hear."""
    return bed.simulation(instruments=(beds.Instrument("open-1"),)).replace(f'"{bed.folder}"', '""')


def forge(bed, *arguments):
    return subprocess.Popen([bed.program("forger"), "", "shapes", *map(str, arguments)], stdout=subprocess.PIPE, text=True,
                            preexec_fn=calm.die_with_parent)


def said_by(forger):
    words, _ = forger.communicate(timeout=60)
    return words.strip()


def a_subscriber_with_keys_gets_30_hz_and_others_get_nothing(bed):
    """Who has no keys hears an open daemon beside it, so that it is not deaf."""
    room, rogue = Room(bed), Room(bed, "rogue")
    with_keys = bed.subscribe("--security", room.of("subscriber"))
    without, with_rogues = bed.subscribe(), bed.subscribe("--security", rogue.of("subscriber"))
    began_ns = bed.start_daemon(secured(bed, room.of("daemon"))).started_ns
    first = with_keys.wait_for(is_valid, "VALID shape with keys", 20)
    bed.start_daemon(open_instrument(bed))
    without.wait_for(is_valid, "VALID shape of the open daemon", 20)
    since_ns = time.monotonic_ns()
    time.sleep(LISTENING_S)
    samples = with_keys.samples(since_ns)
    strangers = (len(without.samples(instrument="cath-1")), len(with_rogues.samples()))
    say(f"with keys {rate_hz(samples):.2f} Hz, longest gap {beds.longest_gap_ms(samples):.0f} ms, the first VALID shape "
        f"{milliseconds(first.read_ns - began_ns):.0f} ms after the daemon's start; without keys {strangers[0]} shapes, with a rogue's "
        f"{strangers[1]}")
    check_timing(rate_hz(samples) >= 29, f"{rate_hz(samples):.2f} Hz with keys, expected 30")
    check(strangers == (0, 0), f"strangers read: {strangers}")
    check(all(sample["instrument_id"] == "cath-1" for sample in with_keys.samples()), "who has keys heard an open daemon")


def forged_by_each(bed, room, rogue):
    """What each forger says at its end; all of them write at once."""
    thief = (room.of("subscriber"), bed.program("unchecked_access.so"))
    forgers = {"without keys": (), "with a rogue's": (rogue.of("daemon"),), "with a subscriber's": thief}
    running = {who: forge(bed, "cath-1", FORGED, *keys) for who, keys in forgers.items()}
    return {who: said_by(forger) for who, forger in running.items()}


def shapes_forged_without_keys_with_a_rogues_and_with_a_subscribers_are_shown_by_nobody(bed):
    room, rogue = Room(bed), Room(bed, "rogue")
    subscriber = bed.subscribe("--security", room.of("subscriber"))
    deceived = bed.subscribe()
    time.sleep(1)
    said = forged_by_each(bed, room, rogue)
    say(f"before the daemon: {said}; shown with keys {len(subscriber.samples())}, without {len(deceived.samples())}")
    check(all(words.startswith("done") for words in said.values()), f"a forger failed: {said}")
    check(len(deceived.samples()) > FORGED / 2, "nobody without keys was deceived: the forger does not work")
    check(not subscriber.samples(), "a forged shape was shown")
    honest = said_by(forge(bed, "cath-1", FORGED, room.of("subscriber")))
    check("Not Allowed By Security" in honest, f"a subscriber's keys let an honest program write: {honest}")
    bed.start_daemon(secured(bed, room.of("daemon")))
    subscriber.wait_for(is_valid, "VALID shape", 20)
    since_ns = time.monotonic_ns()
    said = forged_by_each(bed, room, rogue)
    samples = subscriber.samples(since_ns)
    starts = {sample["daemon_start"] for sample in samples}
    doubted = [sample for sample in samples if not is_valid(sample) or "RIVAL_WRITER" in sample["reason_names"]]
    say(f"beside the daemon: {said}; {len(samples)} shapes shown, {len(doubted)} of them not VALID or with RIVAL_WRITER")
    check(len(starts) == 1 and 7 not in starts, f"shapes of {starts} were shown")
    check(not any("rival" in line.json["event"] for line in subscriber.events()), "a forger was told as a rival")
    check(not any("RIVAL_WRITER" in sample["reason_names"] for sample in samples), "the daemon heard a forger")
    check_timing(not doubted, f"the daemon doubted {len(doubted)} of its shapes: {doubted[:1]}")
    # With the daemon's own keys it is a second daemon: the same forger is heard, so that the silence above says something.
    said = said_by(forge(bed, "cath-1", FORGED, room.of("daemon")))
    check(any("rival" in line.json["event"] for line in subscriber.events(since_ns)), f"with the daemon's keys nobody noticed it: {said}")


class Recorder:
    """Every RTPS packet on lo, with the time at which it was seen."""

    def __init__(self):
        self.packets = []
        self._tap = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x0800))
        self._tap.bind(("lo", 0))
        self._tap.settimeout(0.2)
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._record, daemon=True)
        self._thread.start()

    def _record(self):
        while not self._over.is_set():
            try:
                frame, origin = self._tap.recvfrom(65536)
            except socket.timeout:
                continue
            payload = udp_payload(frame)
            if origin[2] != LOOPBACK_OUTGOING and payload.startswith(b"RTPS"):
                self.packets.append((time.monotonic(), bytes(payload)))

    def end(self):
        self._over.set()
        self._thread.join()
        self._tap.close()
        return self.packets


def replay(packets):
    """All of them again at their pace, to every port, for whom they were meant or not."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        began, first = time.monotonic(), packets[0][0]
        for seen, payload in packets:
            time.sleep(max(0, seen - first - (time.monotonic() - began)))
            for octets in {payload, for_everybody(payload)}:
                for port in range(FIRST_PORT, LAST_PORT + 1):
                    try:
                        sender.sendto(octets, ("127.0.0.1", port))
                    except OSError:  # nobody is at that port
                        pass


def recorded_and_replayed(bed, configuration, keys):
    """(packets, numbers of the shapes that a subscriber showed while the daemon lived, of one afterwards)."""
    recorder = Recorder()
    daemon = bed.start_daemon(configuration)
    beside = bed.subscribe(*keys)
    beside.wait_for(is_valid, "VALID shape", 20)
    time.sleep(2)
    packets = recorder.end()
    replay(packets)
    numbers = [sample["sequence_number"] for sample in beside.samples()]
    daemon.signal(signal.SIGKILL)
    daemon.process.wait()
    beside.stop()
    afterwards = bed.subscribe(*keys)
    time.sleep(1)
    replay(packets)
    time.sleep(0.5)
    shown = [sample["sequence_number"] for sample in afterwards.samples()]
    afterwards.stop()
    return len(packets), numbers, shown


def replayed_packets_are_shown_by_nobody(bed):
    """A whole session is recorded, discovery and all, and played again beside the daemon and when it has been killed."""
    room = Room(bed)
    _, _, deceived = recorded_and_replayed(bed, bed.simulation(), ())
    say(f"without DDS Security a subscriber shows {len(deceived)} replayed shapes of a daemon that was killed")
    check(deceived, "replaying does not work without DDS Security either: this is no test")
    keys = ("--security", room.of("subscriber"))
    count, beside, afterwards = recorded_and_replayed(bed, secured(bed, room.of("daemon")), keys)
    say(f"with it: {count} packets replayed; beside the daemon {len(beside)} shapes, each once and in order; afterwards {len(afterwards)}")
    check(beside == sorted(set(beside)), "a shape was shown twice or out of order")
    check(not afterwards, f"{len(afterwards)} replayed shapes were shown")


def keys_that_cannot_be_used_are_refused_with_words(bed):
    room, other = Room(bed), Room(bed, "other")
    soon = Room(bed, "soon", until_s=2)
    time.sleep(3)

    def refused(keys, *words, partition=""):
        text = secured(bed, keys).replace("[dds]\n", f'[dds]\npartition = "{partition}"\n', 1)
        file = bed.write("refused.toml", text)
        for arguments in (["--check", str(file)], ["--config", str(file)]):
            done = subprocess.run([bed.program("tubed"), *arguments], capture_output=True, text=True, check=False, timeout=30,
                                  preexec_fn=calm.die_with_parent)
            check(done.returncode == CONFIGURATION_ERROR, f"tubed {arguments} exits with {done.returncode}: {done.stderr}")
            for word in (f"{file}:", "dds.security", *words):
                check(word in done.stderr, f"no '{word}' in: {done.stderr}")
        say(done.stderr.strip())

    refused(soon.of("daemon"), "expired", "tubectl keys renew")
    refused(bed.folder / "nowhere", "No such file", "make-room")
    refused(room.of("subscriber"), "its role, subscriber, may not publish")
    refused(room.of("daemon"), "partition 'OR-4'", "the default partition", partition="OR-4")
    mixed = pathlib.Path(room.installed("daemon"))
    shutil.copy(other.of("daemon") + "/identity.key", mixed / "identity.key")
    refused(mixed, "identity.key", "does not belong to")
    (mixed / "identity.key").chmod(0o644)
    refused(mixed, "mode 0644", "chmod")
    for arguments, word in ((("--security", soon.of("subscriber")), "expired"),
                            (("--security", room.of("subscriber"), "--partition", "OR-4"), "partition 'OR-4'")):
        done = bed.tubectl("echo", "--seconds", "1", *arguments)
        check(done.returncode == UNAVAILABLE and word in done.stderr, f"tubectl echo exits with {done.returncode}: {done.stderr}")
        say(done.stderr.strip())


def programs_with_keys_end_well(bed):
    """Cyclone's threads encrypt until the process is gone: whatever takes OpenSSL down before is a crash at the exit."""
    room = Room(bed)
    daemon = bed.start_daemon(secured(bed, room.of("daemon")))
    bed.subscribe("--security", room.of("subscriber")).wait_for(is_valid, "VALID shape", 20)
    codes = []
    for _ in range(ENDINGS):
        done = bed.tubectl("status", "--security", room.of("subscriber"))
        codes.append(done.returncode)
    say(f"tubectl status with keys, {ENDINGS} times, exit codes: {codes}")
    # 1: an instrument was not VALID at that moment, which is another matter.
    check(all(code in (0, 1) for code in codes), f"tubectl status with keys exits with {codes}")
    check(daemon.stop() == 0, "the daemon did not end well")


def is_end(line):
    return line.get("event") in ("writer gone", "liveliness lost")


def keys_that_expire_under_way_end_dds_and_are_told(bed):
    """Cyclone removes the participant in that second, without an error from any write. First a subscriber's end, then the daemon's."""
    socket_path = bed.folder / "estimates.sock"
    room = Room(bed)
    room.keys("add", room.folder, "subscriber", "guest", *Room.until(GUEST_S))
    room.keys("renew", room.folder, "daemon", *Room.until(DAEMON_S))
    expires_s, guest_expires_s = room.end_of("daemon"), room.end_of("guest")
    monotonic_ahead_s = time.monotonic() - time.time()
    text = secured(bed, room.of("daemon")).replace("[em]\n", f'[shm]\nestimates_socket = "{socket_path}"\n\n[em]\n', 1)
    daemon = bed.start_daemon(text)
    subscriber, guest = (bed.subscribe("--security", room.of(name)) for name in ("subscriber", "guest"))
    for one in (subscriber, guest):
        one.wait_for(is_valid, "VALID shape", GUEST_S - 2)
    status = bed.tubectl("status", "--security", room.of("subscriber"))
    check("keys=degraded" in status.stdout and "0 days" in status.stdout, f"status before the end: {status.stdout}{status.stderr}")
    told = guest.wait_for(is_end, "end of the guest's shapes", GUEST_S + 5)
    guest_ms = milliseconds(told.read_ns - (guest_expires_s + monotonic_ahead_s) * 1e9)
    check(not any(is_end(line.json) for line in subscriber.lines()), "the end of one subscriber's keys was another one's too")
    subscriber.wait_for(is_end, "end of the daemon's shapes", DAEMON_S + 5)
    last_s = subscriber.samples()[-1]["publish_time_ns"] * 1e-9 - expires_s
    time.sleep(2)
    check(daemon.process.poll() is None, "the daemon ended")
    words = daemon.words()
    check("DDS has ended and nobody hears this daemon there" in words, f"the log does not say so: {words}")
    check("keys: valid until" in words or "valid until" in words, f"the log did not warn: {words}")
    local = bed.tubectl("echo", "--shm", str(socket_path), "--count", "30", "--seconds", "10")
    check(local.returncode == 0, f"shared memory ended too: {local.stdout}{local.stderr}")
    say(f"a guest whose keys expired was told '{told.json['event']}' {guest_ms:.0f} ms after; the last shape over DDS was published "
        f"{last_s * 1e3:.0f} ms from the expiry of the daemon's; shared memory goes on")
    check_timing(-1000 < guest_ms < 2000, f"the guest was told {guest_ms:.0f} ms after")
    check_timing(-2 < last_s < 1.5, f"shapes ended {last_s:.1f} s from the expiry")


def after_a_rotation_shapes_come_again_by_themselves(bed):
    """Renew, copy, restart the daemon: a subscriber with its old keys goes on; then the subscriber's own."""
    room = Room(bed)
    place = room.installed("daemon")
    daemon = bed.start_daemon(secured(bed, place))
    subscriber = bed.subscribe("--security", room.of("subscriber"))
    subscriber.wait_for(is_valid, "VALID shape", 20)
    room.keys("renew", room.folder, "daemon")
    room.installed("daemon")
    time.sleep(1)
    check_timing(rate_hz(subscriber.samples(time.monotonic_ns() - 1_000_000_000)) >= 25, "renewing disturbed the running daemon")
    began_ns = time.monotonic_ns()
    check(daemon.stop() == 0, "the daemon did not end well")
    bed.start_daemon(secured(bed, place))
    old_start = subscriber.samples()[-1]["daemon_start"]
    first = subscriber.wait_for(lambda line: is_valid(line) and line["daemon_start"] != old_start, "VALID shape under new keys", 20)
    restart_ms = milliseconds(first.read_ns - began_ns)
    time.sleep(3)
    again = subscriber.samples(first.read_ns)
    room.keys("renew", room.folder, "subscriber")
    began_ns = time.monotonic_ns()
    subscriber.stop()
    other = bed.subscribe("--security", room.of("subscriber"))
    second = other.wait_for(is_valid, "VALID shape with renewed keys of a subscriber", 20)
    say(f"daemon restarted under new keys: VALID again after {restart_ms:.0f} ms, then {rate_hz(again):.1f} Hz; "
        f"a subscriber restarted under new keys: {milliseconds(second.read_ns - began_ns):.0f} ms")
    check_timing(rate_hz(again) >= 29, f"{rate_hz(again):.1f} Hz after the rotation")
    check_timing(restart_ms < 5000, f"shapes came again after {restart_ms:.0f} ms")


if __name__ == "__main__":
    beds.main(a_subscriber_with_keys_gets_30_hz_and_others_get_nothing,
              shapes_forged_without_keys_with_a_rogues_and_with_a_subscribers_are_shown_by_nobody, replayed_packets_are_shown_by_nobody,
              keys_that_cannot_be_used_are_refused_with_words, programs_with_keys_end_well, keys_that_expire_under_way_end_dds_and_are_told,
              after_a_rotation_shapes_come_again_by_themselves)
