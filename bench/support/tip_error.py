#!/usr/bin/env python3
"""How far a run's tip is off, along the tube as the first view shows it, in depth, and in all: tip_error.py FOLDER ESTIMATES.csv

FOLDER: a sequence folder with truth.csv. ESTIMATES.csv: of `tubectl reconstruct FOLDER --out ESTIMATES.csv`. Instants at which the tip
points at the source or away from it (less than 0.3 of its direction in the image's plane) say nothing of "along" and are left out.
Then in how many instants the front part of the shape lies on something else than the tube as the view shows it.
"""
import csv
import math
import pathlib
import statistics
import sys
import tomllib


FRONT_MM = 60
OFF_THE_TUBE_MM = 1.5


def minus(a, b):
    return [x - y for x, y in zip(a, b)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def times(a, k):
    return [k * x for x in a]


def true_tips(folder):
    """Tip and unit direction out of it, by frame."""
    points = {}
    for row in csv.DictReader((folder / "truth.csv").open()):
        if float(row["s_mm"]) <= 3:
            points.setdefault(int(row["frame"]), {})[float(row["s_mm"])] = [float(row[axis]) for axis in "xyz"]
    tips = {}
    for frame, of_frame in points.items():
        out = minus(of_frame[min(of_frame)], of_frame[max(of_frame)])
        tips[frame] = (of_frame[min(of_frame)], times(out, 1 / math.sqrt(dot(out, out))))
    return tips


def frames_of(path, max_mm):
    """(arc length, point) of each frame's points up to there."""
    frames = {}
    for row in csv.DictReader(open(path)):
        if float(row["s_mm"]) <= max_mm:
            frames.setdefault(int(row["frame"]), []).append((float(row["s_mm"]), [float(row[axis]) for axis in "xyz"]))
    return frames


def off_the_tube(folder, estimates, axes):
    """By frame: is a point off the true centreline in the plane of these axes?"""
    def in_plane(point):
        return [dot(axis, point) for axis in axes]

    truth = frames_of(folder / "truth.csv", 2 * FRONT_MM)
    off = {}
    for frame, points in frames_of(estimates, FRONT_MM).items():
        curve = [in_plane(point) for _, point in truth.get(frame, [])]
        if not curve:
            continue
        off[frame] = any(min(math.dist(in_plane(point), true) for true in curve) > OFF_THE_TUBE_MM for s_mm, point in points if s_mm % 5 == 0)
    return off


def words(name, values):
    ordered = sorted(abs(value) for value in values)
    return f"{name} {statistics.median(ordered):.2f} / {ordered[min(len(ordered) - 1, round(0.95 * len(ordered)))]:.2f} mm"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    *axes, view = [row[:3] for row in tomllib.loads((folder / "sequence.toml").read_text())["camera"][0]["T_camera_world"][:3]]
    tips = true_tips(folder)
    along, depth, whole, within = [], [], [], 0
    for row in csv.DictReader(open(sys.argv[2])):
        if float(row["s_mm"]) != 0 or int(row["frame"]) not in tips:
            continue
        tip, out = tips[int(row["frame"])]
        in_plane = minus(out, times(view, dot(view, out)))
        length = math.sqrt(dot(in_plane, in_plane))
        if length < 0.3:
            continue
        in_plane = times(in_plane, 1 / length)
        off = minus([float(row[axis]) for axis in "xyz"], tip)
        covariance = [[float(row["cov_" + "".join(sorted((a, b)))]) for b in "xyz"] for a in "xyz"]
        sigma = math.sqrt(dot(in_plane, [dot(line, in_plane) for line in covariance]))
        along.append(dot(off, in_plane))
        depth.append(dot(off, view))
        whole.append(math.sqrt(dot(off, off)))
        within += abs(along[-1]) < 3 * sigma
    print(f"{folder.name}: {len(along)} instants, median / 95 %: {words('along in the image', along)} ({100 * within / len(along):.1f} % within "
          f"3 sigma), {words('in depth', depth)}, {words('in all', whole)}")
    off = off_the_tube(folder, sys.argv[2], axes)
    valid = {int(row["frame"]) for row in csv.DictReader(open(sys.argv[2])) if row["validity"] == "VALID"} & off.keys()
    print(f"  the first {FRONT_MM} mm are more than {OFF_THE_TUBE_MM} mm off the tube in the image in {sum(off.values())} of {len(off)} instants, "
          f"in {sum(off[frame] for frame in valid)} of the {len(valid)} that are VALID")


if __name__ == "__main__":
    main()
