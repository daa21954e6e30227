"""What real-time scheduling is worth: every core busy, the daemon with SCHED_FIFO and locked memory beside default scheduling.

By turns, A B A B, and in each turn at the same time a noise floor: a thread of the daemon's highest priority (or of none)
that only sleeps for 10 ms and looks at the clock (cyclictest).

    tests/system/interference.py build/release/bin under_load_fifo_misses_fewer_deadlines_than_default_scheduling
"""
import collections
import json
import os
import shutil
import statistics
import subprocess
import time

import bed as beds
from bed import Skip, check, is_fused, milliseconds, need_real_time, say

TURNS = int(os.environ.get("TUBED_REPETITIONS", "2"))
SECONDS = float(os.environ.get("TUBED_SECONDS", "8"))
PERIOD_MS = 1000 / 30
PRIORITIES = (("em_acquisition", 60), ("image_grab", 55), ("publisher", 52), ("optimizer", 50), ("frangi", 45))

Turn = collections.namedtuple("Turn", "published missed flagged latencies_ms floor_us")


def configuration(bed, is_fifo):
    head = "[realtime]\nscheduling = \"required\"\n" + "".join(
        f"[realtime.{stage}]\npriority = {priority}\n" for stage, priority in PRIORITIES) if is_fifo else ""
    return bed.simulation(head=head)


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def noise_floor(bed, is_fifo):
    """A running cyclictest, with or without priority, that writes its histogram when it ends."""
    file = bed.folder / f"floor-{time.monotonic_ns()}.json"
    # A thread of our own clock would be this program's; cyclictest takes times inside the real-time thread.
    command = ["cyclictest", "--quiet", "--interval=10000", f"--duration={SECONDS:.0f}", "--histogram=100000", f"--json={file}"]
    command += ["--mlockall", f"--priority={PRIORITIES[0][1]}"] if is_fifo else ["--policy=other"]
    return file, subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def floor_of(file, process):
    process.wait(SECONDS + 30)
    thread = json.loads(file.read_text())["thread"]["0"]
    return [int(us) for us, count in thread["histogram"].items() for _ in range(count)]


def turn(bed, is_fifo):
    """One daemon under load; what it published, from its own stamps, as a subscriber of highest priority has it."""
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(configuration(bed, is_fifo))
    subscriber.wait_for(is_fused, "VALID shape with an image", 20)
    subscriber.stop()
    # Into a file: whoever reads a pipe under this load makes its writer wait.
    lines = bed.folder / f"samples-{time.monotonic_ns()}.json"
    with open(lines, "wb") as sink:
        listener = subprocess.Popen(["chrt", "-f", "70", bed.program("tubectl"), "echo", "--json"], stdout=sink)
    load = subprocess.Popen(["stress-ng", "--quiet", "--cpu", str(2 * os.cpu_count()), "--timeout", f"{SECONDS + 60:.0f}s"])
    try:
        time.sleep(1)
        file, floor = noise_floor(bed, is_fifo)
        begun_ns = time.monotonic_ns()
        time.sleep(SECONDS)
        ended_ns = time.monotonic_ns()
        floor_us = floor_of(file, floor)
    finally:
        load.terminate()
        load.wait()
        listener.terminate()
        listener.wait()
    check(daemon.stop() == 0, "the daemon did not end well")
    # Behind the last line break is what the listener was writing when it was ended.
    received = [json.loads(line) for line in lines.read_text().split("\n")[:-1]]
    samples = [s for s in received if "event" not in s and begun_ns <= s["stamps"]["publish_started_monotonic_ns"] <= ended_ns]
    instants = [begun_ns] + [s["stamps"]["publish_started_monotonic_ns"] for s in samples] + [ended_ns]
    # A period without a sample is a missed one, however many follow at once.
    missed = sum(max(0, round(milliseconds(b - a) / PERIOD_MS) - 1) for a, b in zip(instants, instants[1:]))
    latencies = [milliseconds(s["stamps"]["publish_started_monotonic_ns"] - s["stamps"]["exposure_monotonic_ns"])
                 for s in samples if s["is_image_instant"] and s["stamps"]["exposure_monotonic_ns"]]
    flagged = sum("DEADLINE_MISSED" in s["reason_names"] for s in samples)
    return Turn(len(samples), missed, flagged, latencies, floor_us)


def under_load_fifo_misses_fewer_deadlines_than_default_scheduling(bed):
    need_real_time()
    for tool, package in (("stress-ng", "stress-ng"), ("cyclictest", "rt-tests"), ("chrt", "util-linux")):
        if shutil.which(tool) is None:
            raise Skip(f"no {tool}: apt-get install {package}")
    if subprocess.run(["chrt", "-f", "70", "true"], stderr=subprocess.DEVNULL, check=False).returncode != 0:
        raise Skip("this user may not use SCHED_FIFO: run as root")
    turns = {"fifo": [], "default": []}
    for _ in range(TURNS):
        for words, played in turns.items():
            played.append(turn(bed, words == "fifo"))
    say(f"{TURNS} turns each of {SECONDS:.0f} s, {2 * os.cpu_count()} busy processes on {os.cpu_count()} cores")
    say(f"{'scheduling':10} {'published':>9} {'missed':>6} {'late':>5} {'latency p50':>11} {'p90':>7} {'n':>4} {'noise floor p50':>15} {'p99':>9}")
    sums = {}
    for words, played in turns.items():
        latencies = [ms for one in played for ms in one.latencies_ms]
        floor_us = [us for one in played for us in one.floor_us]
        sums[words] = Turn(*(sum(getattr(one, name) for one in played) for name in ("published", "missed", "flagged")), latencies, floor_us)
        check(latencies, f"{words}: no shape with an image under load")
        say(f"{words:10} {sums[words].published:9} {sums[words].missed:6} {sums[words].flagged:5} {statistics.median(latencies):8.2f} ms "
            f"{quantile(latencies, 0.9):4.1f} ms {len(latencies):4} {statistics.median(floor_us):12.0f} us {quantile(floor_us, 0.99):6.0f} us")
    fifo, default = sums["fifo"], sums["default"]
    # What takes the whole machine away for a moment, a hypervisor for one, hits whoever runs then.
    by_chance = 0.005 * fifo.published
    check(fifo.missed + fifo.flagged <= default.missed + default.flagged + by_chance, "FIFO misses more than default scheduling")
    # Other real-time work on the machine is in the noise floor too.
    check(statistics.median(fifo.latencies_ms) <= statistics.median(default.latencies_ms), "FIFO is slower than default scheduling")


if __name__ == "__main__":
    beds.main(under_load_fifo_misses_fewer_deadlines_than_default_scheduling)
