"""A real daemon with the Aurora's driver, an emulated Aurora, a subscriber: what goes wrong with the tracker is flagged
within 100 ms, 30 Hz go on, and shapes are valid within a second of the tracker's being ready.

TUBED_REPETITIONS says how often each; the figures of all are printed. A repetition during which the machine itself stood
still, as a real-time timer on each of its CPUs tells, says nothing about the daemon: it is made again, and counted.
"""
import os
import random
import shutil
import socket
import subprocess
import sys
import threading
import time

import bed as beds
from bed import age_when_made_ns, check, is_valid, milliseconds, need_real_time, reasons_of, say

REPETITIONS = int(os.environ.get("TUBED_REPETITIONS", "2"))
FLAGGED_WITHIN_MS = 100
VALID_WITHIN_S = 1.0  # of the tracker's being ready

# What the emulated tracker itself needs, as recorded with real ones (drivers/laboratory/aurora_emulator).
RESET_S, INIT_S, PINIT_S, START_S, STOP_S = 1.3, 0.05, 0.14, 1.4, 0.34
PLUGS = 3
FROM_POWER_ON_S = RESET_S + INIT_S + PLUGS * PINIT_S + START_S
FROM_REPLUG_S = STOP_S + PINIT_S + START_S


def real_time():
    """In front of a command: what stands for a device must not be late because this machine is busy."""
    chrt = shutil.which("chrt")
    allowed = chrt and subprocess.run([chrt, "-r", "20", "true"], stderr=subprocess.DEVNULL, check=False).returncode == 0
    return (chrt, "-r", "20") if allowed else ()


class StandstillWitness:
    """On each CPU a real-time process that wants to wake every 2 ms and says when it could not."""

    STOOD_STILL_MS = 8
    CALM_FOR_S = 2
    CALM_WITHIN_S = 6
    PROGRAM = """
import time
while True:
    due = time.monotonic_ns() + 2_000_000
    time.sleep(0.002)
    late_ms = (time.monotonic_ns() - due) * 1e-6
    if late_ms > 5:
        print(due, late_ms, flush=True)
"""

    def __init__(self):
        self.standstills = []  # (ns of CLOCK_MONOTONIC, ms)
        self.processes = []
        for cpu in os.sched_getaffinity(0) if real_time() else ():
            process = subprocess.Popen([shutil.which("chrt"), "-r", "90", "taskset", "-c", str(cpu), sys.executable, "-c", self.PROGRAM],
                                       stdout=subprocess.PIPE, text=True)
            threading.Thread(target=self.listen, args=(process,), daemon=True).start()
            self.processes.append(process)

    def listen(self, process):
        for line in process.stdout:
            at_ns, late_ms = line.split()
            self.standstills.append((int(at_ns), float(late_ms)))

    def longest_ms(self, since_ns):
        """The longest standstill since then; 0: none that matters."""
        time.sleep(0.02)  # the last one is being written
        return max((late for at, late in self.standstills if at >= since_ns and late > self.STOOD_STILL_MS), default=0)

    def wait_for_calm(self):
        """Until nothing stood still for CALM_FOR_S; not longer than CALM_WITHIN_S."""
        until = time.monotonic() + self.CALM_WITHIN_S
        while time.monotonic() < until:
            since_ns = time.monotonic_ns()
            time.sleep(self.CALM_FOR_S)
            if not self.longest_ms(since_ns):
                return

    def stop(self):
        for process in self.processes:
            process.kill()
            process.wait()


def repeat(room, once):
    """`once` until it was done REPETITIONS times on a machine that did not stand still; gives what it gave."""
    witness = StandstillWitness()
    results, standstills_ms = [], []
    try:
        while len(results) < REPETITIONS:
            before_ns, gaps = time.monotonic_ns(), len(room.gaps_ms)
            try:
                result, error = once(), None
            except beds.Failure as failure:
                result, error = None, failure
            standstill_ms = witness.longest_ms(before_ns)
            if standstill_ms:
                standstills_ms.append(standstill_ms)
                del room.gaps_ms[gaps:]
                check(len(standstills_ms) <= REPETITIONS + 6, "this machine stands still too often to judge anything")
                witness.wait_for_calm()
            elif error:
                raise error
            else:
                results.append(result)
    finally:
        witness.stop()
    if standstills_ms:
        say(f"{len(standstills_ms)} repetitions made again: the machine stood still for up to {max(standstills_ms):.0f} ms")
    return [list(column) for column in zip(*results)]


class Room:
    """Daemon, emulated tracker and subscriber of one run. Without images: between coils and subscriber is nothing then
    but what is judged here."""

    def __init__(self, bed):
        self.bed = bed
        self.port = bed.folder / "aurora"
        self.control = bed.folder / "tracker.sock"
        text = '[realtime]\nscheduling = "optional"\n' + "".join(
            f"[realtime.{stage}]\npriority = {priority}\n" for stage, priority in
            (("em_acquisition", 70), ("optimizer", 60), ("publisher", 55)))
        text += ('[dds]\nnetwork_interface = "lo"\n'
                 f'[em]\ndriver = "aurora-serial"\ndevice = "{self.port}"\n'
                 'T_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n'
                 '[[instrument]]\nid = "cath-1"\nmode = "em"\nlength_mm = 380.0\n')
        for sensor, offset_mm in enumerate((10.0, 90.0, 170.0, 270.0, 370.0), 1):
            text += (f"[[instrument.coil]]\nsensor = {sensor}\noffset_from_tip_mm = {offset_mm}\n"
                     f"port = {(sensor + 1) // 2}\nchannel = {(sensor + 1) % 2}\n")
        self.text = text
        self.file = bed.write("emulated.toml", text)
        self.subscriber = bed.subscribe(prefix=real_time())
        self.tracker = None
        self.daemon = None
        self.sample_count, self.sample_time_s = 0, 0.0
        self.gaps_ms = []  # longest time without a sample, in each interruption

    def start_daemon(self):
        self.daemon = self.bed.start_daemon(self.text)

    def end_daemon(self):
        self.daemon.stop()
        self.bed.daemons.remove(self.daemon)

    def switch_on(self, *options):
        """Starts the emulated tracker; CLOCK_MONOTONIC (ns) at which its port is there."""
        command = [*real_time(), self.bed.program("tubectl"), "aurora-emulator", "--link", str(self.port), "--control", str(self.control), *options]
        self.tracker = beds.Daemon(command, self.bed.folder / "tubed-tracker.log")
        self.bed.daemons.append(self.tracker)
        until = time.monotonic() + 5
        while not self.port.exists() and time.monotonic() < until:
            time.sleep(0.005)
        return time.monotonic_ns()

    def switch_off(self):
        self.tracker.stop()
        self.bed.daemons.remove(self.tracker)

    def tell(self, command):
        """CLOCK_MONOTONIC (ns) just before."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
            now_ns = time.monotonic_ns()
            sender.sendto(command.encode(), str(self.control))
        return now_ns

    def flagged(self, reason, since_ns):
        """The first sample with that reason."""
        return self.subscriber.wait_for(lambda s: reason in s.get("reason_names", ""), reason, 2, since_ns).json

    def valid(self, since_ns, timeout_s, wanted=is_valid):
        """The first VALID one, of measurements after `since_ns`."""
        return self.subscriber.wait_for(
            lambda s: wanted(s) and s["stamps"]["em_measured_monotonic_ns"] > since_ns, "VALID shape", timeout_s, since_ns).json

    def judge_samples(self, since_ns, until_ns):
        """Counts them, and no measurement older than 100 ms at its sample's instant without a word."""
        samples = [s for s in self.subscriber.samples(since_ns) if s["received_monotonic_ns"] <= until_ns]
        for sample in samples:
            age_ns = sample["em_age_ns"] if sample["is_image_instant"] else age_when_made_ns(sample, "em_age_ns")
            check("EM_STALE" in reasons_of(sample) or milliseconds(age_ns) <= FLAGGED_WITHIN_MS,
                  f"a measurement {milliseconds(age_ns):.1f} ms old, reasons {sample['reason_names']}")
            check("EM_STALE" not in reasons_of(sample) or not is_valid(sample), "EM_STALE and yet VALID")
        if len(samples) > 1:
            self.gaps_ms.append(beds.longest_gap_ms(samples))
            self.sample_count += len(samples) - 1
            self.sample_time_s += (samples[-1]["received_monotonic_ns"] - samples[0]["received_monotonic_ns"]) * 1e-9

    def ready(self):
        """Tracks, and has for a while."""
        self.valid(time.monotonic_ns(), 20)
        time.sleep(random.uniform(0.4, 0.8))
        self.subscriber.forget()


def age_when_flagged_ms(sample):
    return milliseconds(sample["received_monotonic_ns"] - sample["stamps"]["em_measured_monotonic_ns"])


def seconds_since(sample, ns):
    return (sample["received_monotonic_ns"] - ns) * 1e-9


def judge(room, what, flagged_ms, ages_ms, valid_s, tracker_s):
    """Prints the figures of all repetitions, and fails when one is too late. `flagged_ms`: since it happened; `ages_ms`: of
    the newest measurement when that was flagged, only printed, as judge_samples() judges every sample's."""
    if room.gaps_ms:
        say(f"{what:12} {'without a sample':18} p50 {sorted(room.gaps_ms)[len(room.gaps_ms) // 2]:5.0f} ms, longest "
            f"{max(room.gaps_ms):5.0f} ms; {room.sample_count / room.sample_time_s:.2f} Hz throughout")
        check(29 <= room.sample_count / room.sample_time_s <= 32, "not 30 Hz")
        check(sorted(room.gaps_ms)[len(room.gaps_ms) // 2] < 100, "mostly more than 100 ms without a sample")
    for name, values, limit in (("flagged after", flagged_ms, FLAGGED_WITHIN_MS), ("newest was old", ages_ms, FLAGGED_WITHIN_MS),
                                ("valid again after", [1e3 * v for v in valid_s], 1e3 * (tracker_s + VALID_WITHIN_S))):
        if values:
            ordered = sorted(values)
            in_time = sum(value <= limit for value in values)
            say(f"{what:12} {name:18} p50 {ordered[len(values) // 2]:5.0f} ms, longest {ordered[-1]:5.0f} ms, "
                f"{in_time} of {len(values)} within {limit:.0f} ms"
                + (f", of which the tracker needs {1e3 * tracker_s:.0f} ms" if tracker_s and name.startswith("valid") else ""))
    check(all(value <= FLAGGED_WITHIN_MS for value in flagged_ms), f"{what}: flagged too late: {max(flagged_ms, default=0):.0f} ms")
    check(all(value <= tracker_s + VALID_WITHIN_S for value in valid_s), f"{what}: valid too late: {max(valid_s):.2f} s")


def an_aurora_whose_cable_was_pulled_is_flagged_and_valid_again_in_a_second(bed):
    need_real_time()
    room = Room(bed)
    room.switch_on()
    room.start_daemon()

    def once():
        room.ready()
        out_ns = room.tell("disconnect")
        flagged = room.flagged("EM_STALE", out_ns)
        time.sleep(random.uniform(0, 1.5))
        in_ns = room.tell("connect")
        valid = room.valid(in_ns, 8)
        room.judge_samples(out_ns, valid["received_monotonic_ns"])
        return 1e3 * seconds_since(flagged, out_ns), age_when_flagged_ms(flagged), seconds_since(valid, in_ns)

    judge(room, "cable pulled", *repeat(room, once), 0)


def an_aurora_without_power_is_flagged_and_valid_again_in_a_second(bed):
    need_real_time()
    room = Room(bed)
    room.switch_on()
    room.start_daemon()

    def once():
        room.ready()
        off_s = random.uniform(0.3, 2)
        off_ns = room.tell(f"power-cycle {off_s:.3f}")
        flagged = room.flagged("EM_STALE", off_ns)
        on_ns = off_ns + int(off_s * 1e9)
        valid = room.valid(on_ns, 12)
        room.judge_samples(off_ns, valid["received_monotonic_ns"])
        return 1e3 * seconds_since(flagged, off_ns), age_when_flagged_ms(flagged), seconds_since(valid, on_ns)

    judge(room, "power cycled", *repeat(room, once), FROM_POWER_ON_S)


def a_coil_plugged_in_again_is_flagged_and_valid_again_in_a_second(bed):
    need_real_time()
    room = Room(bed)
    room.switch_on()
    room.start_daemon()

    def once():
        room.ready()
        out_ns = room.tell("unplug 2")
        lost = room.flagged("COIL_LOST", out_ns)
        time.sleep(random.uniform(0.2, 0.8))
        in_ns = room.tell("plug 2")
        age_ms = age_when_flagged_ms(room.flagged("EM_STALE", in_ns))
        valid = room.valid(in_ns, 8, lambda s: is_valid(s) and "COIL_LOST" not in reasons_of(s))
        room.judge_samples(out_ns, valid["received_monotonic_ns"])
        return 1e3 * seconds_since(lost, out_ns), age_ms, seconds_since(valid, in_ns)

    judge(room, "replugged", *repeat(room, once), FROM_REPLUG_S)


def an_aurora_that_comes_after_the_daemon_is_valid_in_a_second(bed):
    need_real_time()
    room = Room(bed)
    valid_s = []
    for _ in range(REPETITIONS):
        room.start_daemon()
        since_ns = time.monotonic_ns()
        first = room.subscriber.wait_for(lambda s: "validity_name" in s, "sample without a tracker", 20, since_ns).json
        check(not is_valid(first), f"{first['validity_name']} without a tracker")
        time.sleep(random.uniform(0, 6))
        on_ns = room.switch_on()
        valid = room.valid(on_ns, 12)
        valid_s.append(seconds_since(valid, on_ns))
        early = [s for s in room.subscriber.samples(since_ns)
                 if s["received_monotonic_ns"] < valid["received_monotonic_ns"]]
        check(not [s for s in early if is_valid(s) and s["stamps"]["em_measured_monotonic_ns"] < on_ns],
              "VALID before there was a tracker")
        room.end_daemon()
        room.switch_off()
        room.subscriber.forget()
    judge(room, "came later", [], [], valid_s, FROM_POWER_ON_S)


if __name__ == "__main__":
    random.seed(1)
    beds.main(an_aurora_whose_cable_was_pulled_is_flagged_and_valid_again_in_a_second,
              an_aurora_without_power_is_flagged_and_valid_again_in_a_second,
              a_coil_plugged_in_again_is_flagged_and_valid_again_in_a_second,
              an_aurora_that_comes_after_the_daemon_is_valid_in_a_second)
