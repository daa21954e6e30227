#!/usr/bin/env python3
"""From a cable to a shape in an afternoon: a room whose numbers are all wrong is calibrated with tubectl's verbs alone,
and then reconstructs a recording as well as with the true numbers."""
import json
import random
import re
import tomllib

import bed as beds
import example_files
from bed import check, say

SEED = 3
LATE_MS = 40
MATRIX = r"\[\s*\[.*?\]\s*\]"
WORSE_BY = 1.15  # RMS with what was found, of that with the true numbers


def run(bed, *words, timeout_s=120):
    done = bed.tubectl(*[str(word) for word in words], timeout_s=timeout_s)
    check(done.returncode == 0, f"tubectl {' '.join(map(str, words))} exits {done.returncode}: {done.stderr}")
    return done


def matrix_of(text, key):
    rows = re.search(key + " = (" + MATRIX + ")", text, re.DOTALL).group(1)
    return json.loads(rows.replace("\n", " "))


def inverse(T, p):
    """What p, in the frame that T leads to, is in the frame that it comes from."""
    q = [p[i] - T[i][3] for i in range(3)]
    return [sum(T[i][j] * q[i] for i in range(3)) for j in range(3)]


def offsets_of(text):
    return [float(number) for number in re.findall(r"offset_from_tip_mm = ([\d.]+)", text)]


def wrong_room(text):
    """The configuration of a room of which nobody has measured anything."""
    T_camera = matrix_of(text, "T_camera_world")
    T_em = matrix_of(text, "T_world_em")
    for axis, off_mm in enumerate((9, -7, 25)):
        T_camera[axis][3] += off_mm
        T_em[axis][3] -= off_mm
    text = re.sub("T_camera_world = " + MATRIX, f"T_camera_world = {T_camera}", text, count=1, flags=re.DOTALL)
    text = re.sub("T_world_em = " + MATRIX, f"T_world_em = {T_em}", text, count=1, flags=re.DOTALL)
    text = re.sub(r"\b(f[xy]) = ([\d.]+)", lambda m: f"{m.group(1)} = {1.04 * float(m.group(2))}", text)
    return re.sub(r"offset_from_tip_mm = ([\d.]+)", lambda m: f"offset_from_tip_mm = {float(m.group(1)) + 4}", text)


def write_markers(bed, T_world_em):
    """Seven markers around the catheter, and how a probe touched them, 0.3 mm an axis."""
    drawn = random.Random(SEED)
    world = ["name,x,y,z"]
    touched = ["name,x,y,z"]
    for i in range(7):
        p = [drawn.uniform(-90, 90), drawn.uniform(-60, 60), drawn.uniform(-200, 40)]
        q = [x + drawn.gauss(0, 0.3) for x in inverse(T_world_em, p)]
        world.append(f"M{i}," + ",".join(f"{x:.4f}" for x in p))
        touched.append(f"M{i}," + ",".join(f"{x:.4f}" for x in q))
    (bed.folder / "markers.csv").write_text("\n".join(world) + "\n")
    (bed.folder / "touched.csv").write_text("\n".join(touched) + "\n")


def take_phantom_up(bed, file, T_world_em):
    """A phantom's file that does not say where it stands, and how a probe touched eight of its balls, 0.3 mm an axis."""
    text = file.read_text()
    phantom = tomllib.loads(text)
    T = phantom["T_world_phantom"]
    (bed.folder / "phantom.toml").write_text("".join(line for line in text.splitlines(True) if not line.startswith("T_world_phantom")))
    drawn = random.Random(SEED + 2)
    touched = ["name,x,y,z"]
    for name, *p, _ in phantom["balls"][::6]:
        p_world = [sum(T[i][j] * p[j] for j in range(3)) + T[i][3] for i in range(3)]
        touched.append(f"{name}," + ",".join(f"{x + drawn.gauss(0, 0.3):.4f}" for x in inverse(T_world_em, p_world)))
    (bed.folder / "balls.csv").write_text("\n".join(touched) + "\n")


def rms_with(bed, folder, config, name):
    run(bed, "reconstruct", folder, "--config", config, "--out", bed.folder / f"{name}.csv", timeout_s=200)
    report = run(bed, "evaluate", folder, "--fused", bed.folder / f"{name}.csv", "--in-view", "--json", "-")
    return json.loads(report.stdout)["fused"]["mm"]["RMS"]["median"]


def an_afternoon_makes_a_room_as_good_as_its_true_numbers(bed):
    folder = bed.folder / "run"
    run(bed, "simulate", "--preset", "to-and-fro", "--seed", SEED, "--every", "2", "--mistake", f"clock={LATE_MS}", "--out", folder, timeout_s=200)
    true_text = run(bed, "configure", folder).stdout
    true_room = bed.folder / "true.toml"
    true_room.write_text(re.sub(r'(\[\[camera\]\]\n)', rf"\1time_offset_ms = {LATE_MS}.0\n", true_text, count=1))
    room = bed.folder / "room.toml"
    room.write_text(wrong_room(true_text))
    accept = ("--config", room, "--yes")

    still = bed.folder / "still"
    example_files.write_still(still, (folder / "sequence.toml").read_text(), offsets_of(true_text), SEED + 1)
    run(bed, "calibrate", "noise", still, "--field-mm", "1.0", *accept)
    run(bed, "calibrate", "coils", still, "--tip", "20,-10,-150", *accept)
    write_markers(bed, matrix_of(true_text, "T_world_em"))
    run(bed, "register", "--markers", bed.folder / "markers.csv", "--touched", bed.folder / "touched.csv", *accept)
    run(bed, "calibrate", "phantom", "--config", true_room, "--camera", "A", "--out", bed.folder / "phantom")
    take_phantom_up(bed, bed.folder / "phantom" / "phantom.toml", matrix_of(true_text, "T_world_em"))
    placed = bed.folder / "placed.toml"
    run(bed, "register", "--phantom", bed.folder / "phantom.toml", "--touched", bed.folder / "balls.csv", "--config", room, "--out", placed)
    images = sorted((bed.folder / "phantom").glob("image-*.png"))
    run(bed, "calibrate", "camera", *images, "--phantom", placed, "--camera", "A", *accept)
    done = run(bed, "calibrate", "time", folder, *accept)
    found_ms = float(re.search(r"time_offset_ms = (-?[\d.]+)", room.read_text()).group(1))
    sigma_ms = float(re.search(r"time_offset_sigma_ms = ([\d.]+)", room.read_text()).group(1))
    say(f"images are {found_ms} ms late, sigma {sigma_ms} ms; {LATE_MS} ms are true")
    check(abs(found_ms - LATE_MS) < 5 + 2 * sigma_ms, f"the clock: {done.stdout}")

    true_mm = rms_with(bed, folder, true_room, "true")
    found_mm = rms_with(bed, folder, room, "found")
    say(f"RMS in view, median: {true_mm:.2f} mm with the true numbers, {found_mm:.2f} mm with those that were found")
    check(found_mm < WORSE_BY * true_mm, f"{found_mm} mm with what was found, {true_mm} mm with the true numbers")


if __name__ == "__main__":
    beds.main(an_afternoon_makes_a_room_as_good_as_its_true_numbers)
