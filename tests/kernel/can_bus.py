"""An emulated Aurora, tubectl can-gateway, a CAN bus of the kernel, tubed: what arrives, and what happens when the bus fails.

Runs in the guest of guest.py: a kernel with vcan.
"""
import contextlib
import csv
import json
import random
import socket
import struct
import subprocess
import threading
import time

import bed as beds
from bed import check, is_valid, say

OK, DISABLED = 1, 3  # status of a coil in EmSamples
COILS = 5
SYNC, FOLLOW_UP, FD_COIL, CLASSIC_COIL = 0x300, 0x302, 0x320, 0x340
CAN_ERR_FLAG, BUS_OFF, RESTARTED = 0x20000000, 0x40, 0x100
# Half a step of the encoding: 1 um, and 1 / 32767 in each part of a unit vector or quaternion; the truth is written with six
# digits, before the tracker's single precision.
POSITION_MM, AXIS = 0.0005 + 0.0001, 2 / 32767 + 1e-6


def ip_link(*words):
    subprocess.run(["ip", "link", *words], check=True)


def why_of(status):
    """What the source of coils lacks, in words."""
    return next((stage["why"] for stage in status.get("stages", ()) if stage["name"] == "em"), "")


class CanRoom:
    """Everything between a tracker and a subscriber."""

    def __init__(self, bed, layout, heard="vcan0", receive_buffer_kb=256, settings="", gateway_options=()):
        self.bed = bed
        port, self.truth = bed.folder / "aurora", bed.folder / "truth.csv"
        text = ('[daemon]\nlog_level = "info"\n[dds]\nnetwork_interface = "lo"\n'
                f'[em]\ndriver = "aurora-can"\ndevice = "{heard}"\nT_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n'
                f'[aurora-can]\nreceive_buffer_kb = {receive_buffer_kb}\n{settings}'
                '[[instrument]]\nid = "cath-1"\nmode = "em"\nlength_mm = 380.0\n')
        for sensor, offset_mm in enumerate((10.0, 90.0, 170.0, 270.0, 370.0), 1):
            text += f"[[instrument.coil]]\nsensor = {sensor}\noffset_from_tip_mm = {offset_mm}\n"
        self.measurements = bed.subscribe("--topic", "em")
        self.shapes = bed.subscribe()
        self.status = bed.subscribe("--topic", "status")
        self.start("tracker", "aurora-emulator", "--link", port, "--truth", self.truth)
        self.gateway = self.start("gateway", "can-gateway", "--serial", port, "--can", "vcan0", "--layout", layout, *gateway_options)
        self.daemon = bed.start_daemon(text)
        self.measurements.wait_for(lambda s: "tracker_frame" in s, "measurement", 30)

    def start(self, name, *command):
        process = beds.Daemon([self.bed.program("tubectl"), *map(str, command)], self.bed.folder / f"tubed-{name}.log")
        self.bed.daemons.append(process)
        return process

    def told(self, *words, since_ns=0, timeout_s=5):
        """Waits until the status of the EM source says all of `words`; what it says."""
        try:
            return why_of(self.status.wait_for(lambda s: all(word in why_of(s) for word in words), "such status", timeout_s,
                                               since_ns).json)
        except beds.Failure:
            said = list(dict.fromkeys(why_of(sample) for sample in self.status.samples(since_ns)))
            raise beds.Failure(f"no status says {words}; they say {said}") from None

    def flagged(self, since_ns):
        self.shapes.wait_for(lambda s: "EM_STALE" in s.get("reason_names", ""), "EM_STALE", 5, since_ns)

    def valid_again(self, since_ns):
        """A VALID shape of a measurement after `since_ns`, from the daemon that ran before."""
        self.shapes.wait_for(lambda s: is_valid(s) and s["stamps"]["em_measured_monotonic_ns"] > since_ns, "VALID shape", 10, since_ns)
        check(self.daemon.process.poll() is None, "the daemon has ended")

    def true_measurements(self):
        """By frame number: when it was measured (ns), and position and axis of each coil, None without a pose."""
        frames = {}
        rows = list(csv.reader(open(self.truth, encoding="ascii", newline="")))[1:-1]  # the last one may be half written
        for frame, measured_ns, sensor, _, *pose in rows:
            coil = ([float(x) for x in pose[:3]], [float(x) for x in pose[3:]]) if len(pose) == 6 and pose[5] else None
            frames.setdefault(int(frame), (int(measured_ns), {}))[1][int(sensor)] = coil
        return {frame: one for frame, one in frames.items() if len(one[1]) == COILS}


def greatest(a, b):
    return max(abs(x - y) for x, y in zip(a, b))


def compare(samples, truth):
    """Every pose is what the tracker measured under that number. Returns how many coils had one, and the errors of the
    times, ms: of the measurement's, and of the arrival's."""
    poses, wrong, of_measurement_ms, of_arrival_ms = 0, [], [], []
    for sample in samples:
        if sample["tracker_frame"] not in truth:
            continue  # the log is written in blocks
        measured_ns, coils = truth[sample["tracker_frame"]]
        of_measurement_ms.append(beds.milliseconds(sample["measured_monotonic_ns"] - measured_ns))
        of_arrival_ms.append(beds.milliseconds(sample["received_monotonic_ns"] - measured_ns))
        for number, coil in enumerate(sample["coils"], 1):
            if coil["status"] != OK:
                continue
            poses += 1
            true = coils[number]
            if true is None or greatest(coil["p_em_mm"], true[0]) > POSITION_MM or greatest(coil["tangent_em"], true[1]) > AXIS:
                wrong.append((sample["tracker_frame"], number, coil, true))
    check(not wrong, f"{len(wrong)} of {poses} poses are not what was measured: {wrong[:3]}")
    return poses, of_measurement_ms, of_arrival_ms


def p95(values):
    ordered = sorted(abs(value) for value in values)
    return ordered[int(0.95 * (len(ordered) - 1))]


def judge_arrival(bed, layout, **options):
    room = CanRoom(bed, layout, **options)
    time.sleep(1)
    since_ns = time.monotonic_ns()
    # Within 4 s where nothing is lost. A guest that is given less than a CPU measures, and keeps, fewer.
    until = time.monotonic() + 40
    while len(samples := room.measurements.samples(since_ns)) < 160 and time.monotonic() < until:
        time.sleep(0.5)
    time.sleep(1)  # so that the log of the truth has caught up
    poses, of_measurement_ms, of_arrival_ms = compare(samples, room.true_measurements())
    steps = [(b["tracker_frame"] - a["tracker_frame"]) // 8 for a, b in zip(samples, samples[1:])]
    lost = sum(step - 1 for step in steps)
    say(f"{layout}: {len(of_measurement_ms)} measurements compared, {poses} poses, {lost} lost; time of measurement p95 "
        f"{p95(of_measurement_ms):.2f} ms, of arrival p95 {p95(of_arrival_ms):.2f} ms")
    check(len(of_measurement_ms) > 100, f"only {len(of_measurement_ms)} measurements could be compared")
    check(poses > 0.85 * COILS * len(of_measurement_ms), f"only {poses} poses")  # a coil that never comes is 0.8
    check(all(step > 0 for step in steps), "a measurement came twice, or an older one after it")
    # One CPU at 100 Hz: functional. tests/drivers/aurora_can judges the milliseconds.
    check(p95(of_measurement_ms) < p95(of_arrival_ms) / 2, "the times of measurement are hardly better than those of arrival")
    check(all(s["origin"] == samples[0]["origin"] for s in samples), "the origin changes")
    shape = room.shapes.wait_for(is_valid, "VALID shape", 10).json
    check("DEMO_DATA" in shape["reason_names"], f"an emulated tracker that is not said to be one: {shape['reason_names']}")


def what_was_measured_arrives_over_classic_can(bed):
    judge_arrival(bed, "classic")


def what_was_measured_arrives_over_can_fd(bed):
    judge_arrival(bed, "fd")


def what_was_measured_arrives_with_identifiers_of_29_bits(bed):
    judge_arrival(bed, "classic", settings="base_id = 0x18FF5000\nextended_ids = true\n",
                  gateway_options=("--base-id", "0x18FF5000", "--extended"))


class LossyBridge:
    """Hands frames on from vcan0 to vcan1, but for one in `every`, drawn at random."""

    def __init__(self, every):
        self.every = every
        self.random = random.Random(5)
        self.dropped = {}  # frame number: the set of coils that lost a frame; SYNC is coil -1
        self.seen = 0
        self.dropped_frames = 0
        self.inlet, self.outlet = (self.open(name) for name in ("vcan0", "vcan1"))
        self.ends = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    @staticmethod
    def open(name):
        port = socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        port.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
        port.bind((name,))
        port.settimeout(0.2)
        return port

    def run(self):
        number = 0
        while not self.ends:
            try:
                raw = self.inlet.recv(72)
            except socket.timeout:
                continue
            identifier = struct.unpack_from("<I", raw)[0]
            if identifier == SYNC:
                number = struct.unpack_from("<I", raw, 8)[0]
            self.seen += 1
            if self.random.random() < 1 / self.every:
                self.dropped_frames += 1
                coil = (-1 if identifier == SYNC else None if identifier < FD_COIL else
                        identifier - FD_COIL if identifier < CLASSIC_COIL else (identifier - CLASSIC_COIL) // 4)
                self.dropped.setdefault(number, set()).add(coil)
                continue
            with contextlib.suppress(OSError):  # its queue is full: one more that is lost
                self.outlet.send(raw)

    def end(self):
        self.ends = True
        self.thread.join()
        self.inlet.close()
        self.outlet.close()


def judge_losses(bed, layout):
    ip_link("add", "vcan1", "type", "vcan")
    ip_link("set", "vcan1", "mtu", "72", "up")
    bridge = LossyBridge(every=25)
    bed.closing.callback(bridge.end)
    room = CanRoom(bed, layout, heard="vcan1")
    said = room.told("vcan1 loses frames", "coils", timeout_s=10)
    time.sleep(6)
    samples = room.measurements.samples()
    time.sleep(1)
    poses, _, _ = compare(samples, room.true_measurements())
    invented = [(s["tracker_frame"], coil) for s in samples for coil in bridge.dropped.get(s["tracker_frame"], ())
                if coil is not None and coil >= 0 and s["coils"][coil]["status"] == OK]
    hurt = sum(coil is not None and coil >= 0 for s in samples for coil in bridge.dropped.get(s["tracker_frame"], ()))
    without_pose = sum(coil["status"] != OK for s in samples for coil in s["coils"])
    no_sync = sum(-1 in coils for coils in bridge.dropped.values())
    came_without_sync = [s["tracker_frame"] for s in samples if -1 in bridge.dropped.get(s["tracker_frame"], ())]
    say(f"{layout}: {bridge.dropped_frames} of {bridge.seen} frames dropped, {no_sync} of them SYNC; {len(samples)} measurements, "
        f"{poses} poses, {without_pose} coils without one, {hurt} of these had a frame dropped; status: {said}")
    check(hurt > 30, f"only {hurt} coils lost a frame: nothing was tested")
    check(not invented, f"coils of which a frame never came have a pose: {invented[:5]}")
    check(not came_without_sync, f"measurements whose SYNC never came: {came_without_sync[:5]}")
    # A guest that stands still for 20 ms loses some as well, the more the busier the machine is.
    check(poses > 0.5 * COILS * len(samples), "most coils are lost, with all their frames")


def lost_classic_frames_cost_their_coils_and_no_pose_is_wrong(bed):
    judge_losses(bed, "classic")


def lost_fd_frames_cost_their_coils_and_no_pose_is_wrong(bed):
    judge_losses(bed, "fd")


def send_error(classes):
    with socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as port:
        port.bind(("vcan0",))
        port.send(struct.pack("<IB3x8s", CAN_ERR_FLAG | classes, 8, bytes(8)))


@contextlib.contextmanager
def silenced(process):
    """A bus whose controllers are off carries nothing."""
    process.signal(beds.signal.SIGSTOP)
    try:
        yield
    finally:
        process.signal(beds.signal.SIGCONT)


def a_bus_that_went_off_is_told_and_used_again(bed):
    room = CanRoom(bed, "fd")
    room.valid_again(time.monotonic_ns())
    for repetition in range(3):
        off_ns = time.monotonic_ns()
        with silenced(room.gateway):
            send_error(BUS_OFF)
            say(room.told("is bus-off", *([f"restarted {repetition} times"] if repetition else []), since_ns=off_ns))
            room.flagged(off_ns)
            send_error(RESTARTED)
        back_ns = time.monotonic_ns()
        room.valid_again(back_ns)
        room.status.wait_for(lambda s: "stages" in s and not any("bus-off" in stage["why"] for stage in s["stages"]), "end of bus-off", 5,
                             back_ns + 500_000_000)


def an_interface_that_went_down_or_away_is_told_and_used_again(bed):
    room = CanRoom(bed, "classic")
    room.valid_again(time.monotonic_ns())
    down_ns = time.monotonic_ns()
    ip_link("set", "vcan0", "down")
    say(room.told("vcan0 is down", "ip link set", since_ns=down_ns))
    room.flagged(down_ns)
    up_ns = time.monotonic_ns()
    ip_link("set", "vcan0", "up")
    room.valid_again(up_ns)
    away_ns = time.monotonic_ns()
    ip_link("del", "vcan0")
    say(room.told("vcan0 is not there", since_ns=away_ns))
    room.flagged(away_ns)
    ip_link("add", "vcan0", "type", "vcan")
    ip_link("set", "vcan0", "up")
    back_ns = time.monotonic_ns()
    room.valid_again(back_ns)
    words = room.gateway.words()
    check("vcan0 is down" in words and "vcan0 is not there" in words, f"the gateway says only: {words}")


def frames_that_were_read_too_late_are_told(bed):
    room = CanRoom(bed, "classic", receive_buffer_kb=4)
    room.valid_again(time.monotonic_ns())
    room.daemon.signal(beds.signal.SIGSTOP)
    time.sleep(2)  # 1400 frames
    on_ns = room.daemon.signal(beds.signal.SIGCONT)
    def thrown_away(status):
        words = why_of(status)
        return int(words.split(": ")[1].split()[0]) if "frames thrown away here" in words else 0
    said = room.status.wait_for(lambda s: thrown_away(s) > 500, "status that says how many frames were not read", 5, on_ns).json
    say(why_of(said))
    room.valid_again(on_ns)


def the_doctor_says_what_is_wrong_with_a_bus(bed):
    room = CanRoom(bed, "fd")  # its configuration, and a gateway to listen to beside the daemon

    def finds(*expected):
        listens = ("--tracker",) if expected[-1][0] != "tracker port" else ()
        done = bed.tubectl("doctor", "--config", str(bed.folder / "tubed-3.toml"), "--json", *listens)
        found = {one["check"]: one for one in json.loads(done.stdout)}
        for check_name, verdict, words in expected:
            one = found.get(check_name, {"verdict": "none", "found": "", "advice": ""})
            say(f"{check_name}: {one['verdict']}: {one['found']} | {one['advice']}")
            check(one["verdict"] == verdict and words in one["found"] + one["advice"], f"expected {verdict}, '{words}': {found}")

    finds(("tracker port", "good", "up, with CAN FD"), ("bus", "good", "no error frames"), ("gateway", "good", "CAN FD, 5 coils"),
          ("coils", "good", "all coils"))
    with silenced(room.gateway):
        finds(("gateway", "WRONG", "nor of anybody else"))
        with socket.socket(socket.PF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as other:
            other.bind(("vcan0",))
            ends = threading.Event()

            def chatter():
                while not ends.wait(0.1):
                    other.send(struct.pack("<IB3x8s", 0x123, 8, bytes(8)))
            thread = threading.Thread(target=chatter)
            thread.start()
            finds(("gateway", "WRONG", "frames of others"))
            ends.set()
            thread.join()
        elsewhere = room.start("elsewhere", "can-gateway", "--serial", bed.folder / "nothing", "--can", "vcan0", "--base-id", "0x18FF5000",
                               "--extended")
        finds(("gateway", "WRONG", "base_id = 0x18FF5000, extended_ids = true"))
        elsewhere.signal(beds.signal.SIGTERM)
    ip_link("set", "vcan0", "down")
    finds(("tracker port", "WRONG", "vcan0 is down"))
    ip_link("set", "vcan0", "mtu", "16", "up")
    finds(("tracker port", "note", "classic frames only"))
    ip_link("del", "vcan0")
    finds(("tracker port", "WRONG", "vcan0 is not there"))


if __name__ == "__main__":
    beds.main(what_was_measured_arrives_over_classic_can, what_was_measured_arrives_over_can_fd,
              what_was_measured_arrives_with_identifiers_of_29_bits,
              lost_classic_frames_cost_their_coils_and_no_pose_is_wrong, lost_fd_frames_cost_their_coils_and_no_pose_is_wrong,
              a_bus_that_went_off_is_told_and_used_again, an_interface_that_went_down_or_away_is_told_and_used_again,
              frames_that_were_read_too_late_are_told, the_doctor_says_what_is_wrong_with_a_bus)
