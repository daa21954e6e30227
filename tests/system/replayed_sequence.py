"""A recording replayed by the daemon gives subscribers what tubectl reconstruct finds offline.

By hand, with any sequence folder:
    tests/system/replayed_sequence.py build/release/bin --sequence FOLDER [--mode em|joint|filter]
"""
import argparse
import csv
import json
import math
import pathlib
import statistics
import sys
import time

import bed as beds
import sequences
from bed import check, need_real_time, say

GREATEST_MEDIAN_MM = 0.1
START_IN_S = 4  # until then the daemon has decoded the images and the subscriber is there


def point_at(sample, s_mm):
    """The published uniform cubic B-spline at an arc length: coefficient i sits at (i - 1) * spacing."""
    position = s_mm / sample["coefficient_spacing_mm"]
    span = min(int(position), sample["coefficient_count"] - 4)
    u = position - span
    weights = ((1 - u) ** 3, 3 * u ** 3 - 6 * u ** 2 + 4, -3 * u ** 3 + 3 * u ** 2 + 3 * u + 1, u ** 3)
    nearest = sample["coefficients_mm"][span:span + 4]
    return [sum(weight * c[axis] for weight, c in zip(weights, nearest)) / 6 for axis in range(3)]


def offline_shapes(bed, folder, mode, arguments=()):
    """frame -> (validity, [(s_mm, point)]), reconstructed with these further arguments."""
    file = bed.folder / f"{mode}.csv"
    done = bed.tubectl("reconstruct", str(folder), "--mode", mode, "--out", str(file), *arguments, timeout_s=300)
    check(done.returncode == 0, f"tubectl reconstruct exits {done.returncode}: {done.stderr}")
    shapes = {}
    with open(file, encoding="utf-8", newline="") as rows:
        for row in csv.DictReader(rows):
            _, points = shapes.setdefault(int(row["frame"]), (row["validity"], []))
            if row["s_mm"]:
                points.append((float(row["s_mm"]), [float(row[axis]) for axis in "xyz"]))
    return shapes


def replayed_samples(bed, folder, mode):
    """What a subscriber gets from image instants while the folder is replayed once, by frame."""
    done = bed.tubectl("configure", str(folder), "--mode", mode)
    check(done.returncode == 0, f"tubectl configure exits {done.returncode}: {done.stderr}")
    start_ns = time.monotonic_ns() + int(START_IN_S * beds.TIME_FACTOR * 1e9)
    subscriber = bed.subscribe()
    bed.start_daemon(done.stdout.replace("[replay]", f"[replay]\nstart_monotonic_ns = {start_ns}"))
    with open(folder / "frames.csv", encoding="utf-8", newline="") as rows:
        last_s = max(float(row["t_s"]) for row in csv.DictReader(rows))
    time.sleep((start_ns - time.monotonic_ns()) * 1e-9 + last_s + 1)
    return {sample["image_frame"]: sample for sample in subscriber.samples() if sample["is_image_instant"]}


def compare(bed, folder, mode, arguments=()):
    """Prints and checks the distance of the two, over frames that were not skipped."""
    shapes, samples = offline_shapes(bed, folder, mode, arguments), replayed_samples(bed, folder, mode)
    check(set(samples) <= set(shapes), f"frames that are not in the folder: {sorted(set(samples) - set(shapes))}")
    distances, medians, other_word, without_shape = [], {}, [], 0
    for frame, sample in samples.items():
        validity, points = shapes[frame]
        other_word += [] if sample["validity_name"] == validity else [frame]
        if not points or not sample["coefficient_count"]:
            without_shape += 1
            continue
        of_frame = [math.dist(point_at(sample, s), point) for s, point in points if s <= sample["length_mm"]]
        medians[frame] = statistics.median(of_frame)
        distances += of_frame
    check(distances, f"no shape to compare: {len(samples)} samples of image instants, {len(shapes)} frames")
    distances.sort()
    median = statistics.median(distances)
    apart = sorted(frame for frame, frame_median in medians.items() if frame_median > GREATEST_MEDIAN_MM)
    say(f"{len(shapes)} frames, {len(shapes) - len(samples)} skipped, {without_shape} without a shape; distance of shapes "
        f"median {median:.4f} mm, p90 {distances[int(0.9 * len(distances))]:.4f} mm, greatest {distances[-1]:.3f} mm; "
        f"{len(apart)} frames are apart by more than {GREATEST_MEDIAN_MM} mm: {apart[:10]}; "
        f"{len(other_word)} with another validity than offline: {other_word[:10]}")
    check(all("REPLAY_DATA" in sample["reason_names"] for sample in samples.values()), "replayed and does not say so")
    check(median < GREATEST_MEDIAN_MM, f"{median:.3f} mm apart in the median, expected {GREATEST_MEDIAN_MM} mm")
    return len(samples) / len(shapes), samples


def write_estimates(file, samples):
    """The samples as `tubectl reconstruct` writes estimates, every millimetre from the tip."""
    with open(file, "w", encoding="utf-8") as rows:
        rows.write("frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity\n")
        for frame, sample in sorted(samples.items()):
            word = sample["validity_name"]
            if not sample["coefficient_count"]:
                rows.write(f"{frame},,,,,,,,{word}\n")
                continue
            for s_mm in range(int(sample["length_mm"]) + 1):
                rows.write(f"{frame},{s_mm}," + ",".join(f"{c:.4f}" for c in point_at(sample, s_mm)) + f",1,1,1,{word}\n")


def of_frames(file, frames):
    """The rows of a CSV that belong to these frames, in place."""
    head, *rows = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text(head + "".join(row for row in rows if int(row.split(",", 1)[0]) in frames), encoding="utf-8")


def compare_accuracy(bed, folder, mode, samples):
    """Prints and checks what the truth of a simulated folder says of both, frames that were not skipped; after compare()."""
    if not (folder / "truth.csv").exists():
        say("no truth.csv: the accuracy of both cannot be compared")
        return
    live, offline = bed.folder / "live.csv", bed.folder / f"{mode}.csv"
    write_estimates(live, samples)
    of_frames(offline, set(samples))
    report = bed.folder / "accuracy.json"
    done = bed.tubectl("evaluate", str(folder), "--em", str(offline), "--fused", str(live), "--in-view", "--json", str(report))
    check(done.returncode == 0, f"tubectl evaluate exits {done.returncode}: {done.stderr}")
    rms = json.loads(report.read_text(encoding="utf-8"))["comparison"]["metrics"]["RMS"]
    offline_mm, live_mm = rms["em_mm"]["median"], rms["fused_mm"]["median"]
    say(f"RMS, median over {len(samples)} frames that were not superseded: {offline_mm:.3f} mm offline, {live_mm:.3f} mm live")
    check(abs(live_mm - offline_mm) <= max(0.02 * offline_mm, 0.02), "the live pipeline is not as accurate as the offline one")


def a_replayed_sequence_gives_the_shapes_of_the_offline_reconstruction(bed):
    need_real_time()  # an image that the filter delivers too late is not used, offline it always is
    folder = bed.folder / "sequence"
    off_frames = range(60, 70)
    sequences.write_sequence(folder, seconds=4, off_frames=off_frames)
    share, samples = compare(bed, folder, "filter")
    check(share >= 0.9, f"only {100 * share:.0f} % of the frames were not skipped")
    fused = [sample for sample in samples.values() if sample["has_image"]]
    inliers = statistics.median(sample["image_inlier_ratio"] for sample in fused)
    say(f"{len(fused)} with an image, inliers median {inliers:.2f}")
    check(len(fused) >= 0.9 * (120 - len(off_frames)), f"{len(fused)} of the samples have an image")
    # Otherwise both might agree on coils alone.
    check(inliers > 0.6, f"the images show {inliers:.2f} of the catheter: the drawing or the filter is wrong")
    check(all("IMAGE_OFF" in samples[frame]["reason_names"] for frame in off_frames if frame in samples),
          "an instant without fluoroscopy does not say IMAGE_OFF")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs")
    parser.add_argument("scenario", nargs="?")
    parser.add_argument("--sequence", type=pathlib.Path)
    parser.add_argument("--mode", default="filter")
    arguments = parser.parse_args()

    def by_hand(bed):
        _, samples = compare(bed, arguments.sequence.absolute(), arguments.mode)
        compare_accuracy(bed, arguments.sequence.absolute(), arguments.mode, samples)

    sys.exit(beds.run_scenario((a_replayed_sequence_gives_the_shapes_of_the_offline_reconstruction, by_hand),
                               arguments.programs, "by_hand" if arguments.sequence else arguments.scenario,
                               visible=[arguments.sequence] if arguments.sequence else []))
