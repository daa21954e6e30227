#!/usr/bin/env python3
"""A registration that is off is corrected from a recording of a swinging C-arm; of a standing one nothing is offered."""
import json
import math
import tomllib

import bed as beds
from bed import check, say

SEED = 31
TRUE_MM = (10, 90, 170, 270, 370)
SWING = ("--swing", "-30", "--pose-noise-deg", "0", "--pose-noise-mm", "0")


def simulated(bed, name, *words):
    folder = bed.folder / name
    done = bed.tubectl("simulate", "--preset", "paper", "--seed", str(SEED), "--every", "2", "--out", str(folder), *words, timeout_s=150)
    check(done.returncode == 0, f"tubectl simulate exits {done.returncode}: {done.stderr}")
    return folder


def registration_of(folder):
    return tomllib.loads((folder / "sequence.toml").read_text())["registration"]["T_world_em"]


def moved(T, p):
    return [sum(T[i][j] * p[j] for j in range(3)) + T[i][3] for i in range(3)]


def back(T, p):
    q = [p[i] - T[i][3] for i in range(3)]
    return [sum(T[i][j] * q[i] for i in range(3)) for j in range(3)]


def a_swing_corrects_the_registration(bed):
    wrong = simulated(bed, "wrong", *SWING, "--mistake", "registration=4,1.5")
    right = simulated(bed, "right")
    done = bed.tubectl("calibrate", "registration", str(wrong), "--json", "-", timeout_s=150)
    check(done.returncode == 0, f"tubectl calibrate registration exits {done.returncode}: {done.stderr}")
    found = json.loads(done.stdout)
    p_em = back(found["T_world_em"], found["centre_world_mm"])
    true = moved(registration_of(right), p_em)
    before_mm = math.dist(moved(registration_of(wrong), p_em), true)
    after_mm = math.dist(found["centre_world_mm"], true)
    say(f"the coils' middle was {before_mm:.1f} mm off and is {after_mm:.2f} mm, known to {found['worst_shift_mm']:.2f} mm at worst; "
        f"across {found['rms_before_mm']:.2f} mm before, {found['rms_after_mm']:.2f} mm after")
    check(before_mm > 3, f"nothing was wrong: {before_mm:.1f} mm")
    check(after_mm < 3 * math.sqrt(3) * found["worst_shift_mm"] and after_mm < before_mm / 2, f"it is still {after_mm:.1f} mm off")
    report = bed.folder / "page.svg"
    done = bed.tubectl("calibrate", "registration", str(wrong), "--report", str(report), timeout_s=150)
    check(done.returncode == 0 and "T_world_em" in done.stdout, f"it exits {done.returncode}: {done.stdout}{done.stderr}")
    check("Registration of the EM tracker by images" in report.read_text(), "the page is not there")


def from_one_direction_nothing_is_offered(bed):
    done = bed.tubectl("calibrate", "registration", str(simulated(bed, "still")), timeout_s=150)
    check(done.returncode == 65, f"it exits {done.returncode}: {done.stdout}")
    check("directions of view lie 0 degrees apart" in done.stderr and "swings by 30 degrees" in done.stderr, f"it says {done.stderr}")
    check(not done.stdout, f"it prints {done.stdout}")


def arc_lengths_are_found_from_a_recording_in_use(bed):
    """All coils are described 5 mm too far from the tip, the third one 6 mm more."""
    wrong = simulated(bed, "wrong", "--mistake", "offsets=5", "--mistake", "offset=3,6")
    done = bed.tubectl("calibrate", "arc-lengths", str(wrong), "--json", "-", timeout_s=150)
    check(done.returncode == 0, f"tubectl calibrate arc-lengths exits {done.returncode}: {done.stderr}")
    found = json.loads(done.stdout)
    check(found["from_tip"], "the tube's end was not seen")
    for coil, true_mm in zip(found["coils"], TRUE_MM):
        say(f"sensor {coil['sensor']}: {coil['stated_mm']:.1f} mm stated, {coil['found_mm']:.2f} mm found, {true_mm:.1f} true, sigma {coil['sigma_mm']:.2f}")
        check(abs(coil["stated_mm"] - true_mm) > 3, f"sensor {coil['sensor']} was described rightly: the test proves nothing")
        check(abs(coil["found_mm"] - true_mm) < 3 * coil["sigma_mm"] and abs(coil["found_mm"] - true_mm) < 3,
              f"sensor {coil['sensor']} is {coil['found_mm'] - true_mm:+.2f} mm off, sigma {coil['sigma_mm']:.2f} mm")
    report = bed.folder / "arcs.svg"
    done = bed.tubectl("calibrate", "arc-lengths", str(wrong), "--report", str(report), timeout_s=150)
    check(done.returncode == 0 and "offset_from_tip_mm" in done.stdout, f"it exits {done.returncode}: {done.stdout}{done.stderr}")
    check("Arc lengths from a recording" in report.read_text(), "the page is not there")


if __name__ == "__main__":
    beds.main(a_swing_corrects_the_registration, from_one_direction_nothing_is_offered, arc_lengths_are_found_from_a_recording_in_use)
