"""Every fault that the emulated Aurora has, at 1 % and 10 %, through a pseudo-terminal, the driver, the daemon and DDS:
no measurement reaches a subscriber that the tracker has not made so.

TUBED_SECONDS_A_FAULT says how long each; 20 makes the table of drivers/aurora/README.md (ten minutes).
"""
import csv
import os
import time

import bed as beds
from aurora_faults import Room
from bed import check, say

SECONDS = float(os.environ.get("TUBED_SECONDS_A_FAULT", "0.8"))
OF_REPLIES = ("crc", "header-crc", "length", "truncate", "drop", "garbage", "no-reply", "error", "duplicate", "stale", "delay",
              "split")
OF_MEASUREMENTS = ("coil-broken", "out-of-volume", "stuck")
RATE_HZ = 40
OK, MISSING = 1, 0  # status of a coil in EmSamples


def truth_of(path):
    """By frame number: the coils that the tracker reported, as (x, y, z), None without a pose."""
    frames = {}
    whole_lines = path.read_text(encoding="ascii").rpartition("\n")[0]  # the last one may be half written
    for row in csv.DictReader(whole_lines.splitlines()):
        pose = tuple(float(row[axis]) for axis in "xyz") if row["tz"] else None
        frames.setdefault(int(row["frame"]), {})[int(row["sensor"])] = pose
    return frames


def is_as_reported(sample, reported):
    for number, coil in enumerate(sample["coils"], 1):
        if coil["status"] != OK:
            continue  # nothing is claimed
        pose = reported.get(number)
        if pose is None or any(abs(a - b) > 0.01 for a, b in zip(coil["p_em_mm"], pose)):
            return False
    return True


def no_fault_of_a_live_tracker_is_taken_for_a_measurement(bed):
    room = Room(bed)
    truth = bed.folder / "truth.csv"
    room.switch_on("--truth", str(truth))
    measurements = bed.subscribe("--topic", "em")
    room.start_daemon()
    measurements.wait_for(lambda s: "tracker_frame" in s, "measurement", 20)
    time.sleep(1)
    table = []
    for fault in OF_REPLIES + OF_MEASUREMENTS:
        for probability in (0.01, 0.1):
            measurements.forget()
            since_ns = room.tell(f"fault {fault} {probability}")
            time.sleep(SECONDS)
            until_ns = room.tell(f"fault {fault} off")
            time.sleep(0.3)  # what was on the way
            table.append((fault, probability, (until_ns - since_ns) * 1e-9, measurements.samples(since_ns)))
    reported = truth_of(truth)
    newest = max(reported)  # the log is written in blocks: the last measurement may be cut, later ones are not there yet
    wrong = 0
    taken = 0
    for fault, probability, seconds, samples in table:
        judged = [s for s in samples if s["tracker_frame"] < newest]
        unknown = [s for s in judged if s["tracker_frame"] not in reported]
        bad = [s for s in judged if s["tracker_frame"] in reported and not is_as_reported(s, reported[s["tracker_frame"]])]
        steps = [(b["tracker_frame"] - a["tracker_frame"]) // 8 for a, b in zip(samples, samples[1:])]
        check(all(step > 0 for step in steps), f"{fault}: frame numbers that do not grow")
        lost = sum(step - 1 for step in steps)
        say(f"{fault:14} {100 * probability:3.0f} %  {seconds:5.1f} s  {len(samples):5} measurements  lost "
            f"{100 * lost / max(1, lost + len(samples)):5.2f} %  longest gap {max(steps, default=1) - 1:3}  wrong "
            f"{len(bad) + len(unknown)}")
        wrong += len(bad) + len(unknown)
        taken += len(samples)
    check(wrong == 0, f"{wrong} wrong measurements of {taken}")
    check(taken > 0.3 * RATE_HZ * SECONDS * len(table), f"only {taken} measurements")


if __name__ == "__main__":
    beds.main(no_fault_of_a_live_tracker_is_taken_for_a_measurement)
