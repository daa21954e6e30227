"""A run that a daemon's tracker and fluoroscope gave is recorded, and the recording is what was played."""
import csv
import math
import signal
import statistics
import subprocess
import time

import bed as beds
import calm
import sequences
from bed import check, check_timing, say
from replayed_sequence import offline_shapes
from shared_memory import Grabber, configuration_of

SECONDS = 4
START_IN_S = 4  # until then daemon, grabber and recorder have found each other
EXIT_OK, EXIT_FAILED, EXIT_UNAVAILABLE = 0, 1, 69


def rows_of(file):
    with open(file, encoding="utf-8", newline="") as rows:
        return list(csv.DictReader(rows))


def recorder(bed, *arguments, config="tubed-1.toml"):
    """A tubectl record of the bed's daemon, which ends with the bed."""
    process = subprocess.Popen([bed.program("tubectl"), "record", str(bed.folder / "run"), "--config", str(bed.folder / config),
                                *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, preexec_fn=calm.die_with_parent)
    bed.closing.callback(process.kill)
    return process


def by_place(rows):
    """Measured positions, by frame and sensor."""
    return {(int(row["em_frame"]), int(row["sensor"])): [float(row[axis]) for axis in "xyz"] for row in rows if row["status"] == "OK"}


def played_and_recorded(bed, *arguments):
    folder = bed.folder / "played"
    sequences.write_sequence(folder, SECONDS, off_frames=(10, 11), image_rate_hz=15)
    start_ns = time.monotonic_ns() + START_IN_S * 1_000_000_000
    bed.start_daemon(configuration_of(bed, folder, "image_shm", start_ns))
    Grabber(bed, folder, "--start-monotonic-ns", str(start_ns))
    process = recorder(bed, *arguments)
    time.sleep((start_ns - time.monotonic_ns()) * 1e-9 + SECONDS + 1)
    process.send_signal(signal.SIGINT)
    words = process.communicate(timeout=20)[1]
    say(words.strip().splitlines()[-2])
    return folder, process.returncode, words


def a_run_that_is_recorded_is_the_run_that_was_played(bed):
    folder, code, words = played_and_recorded(bed)
    check(code == EXIT_OK and "next: tubectl check" in words, words)
    run = bed.folder / "run"

    played, recorded = (by_place(rows_of(each / "em.csv")) for each in (folder, run))
    common = played.keys() & recorded.keys()
    check_timing(len(common) >= 0.95 * len(played), f"{len(common)} of {len(played)} coils of measurements")
    check(all(math.dist(played[key], recorded[key]) < 1e-9 for key in common), "coils lie elsewhere in the recording")

    first = {int(row["em_frame"]): float(row["t_s"]) for row in rows_of(folder / "em.csv")}
    offsets_s = [float(row["t_s"]) - first[int(row["em_frame"])] for row in rows_of(run / "em.csv")]
    offset_s = statistics.median(offsets_s)
    check(max(abs(each - offset_s) for each in offsets_s) < 1e-6, "measurements are not as far apart as they were played")

    frames, kept = (rows_of(each / "frames.csv") for each in (folder, run))
    check_timing(len(kept) >= 0.95 * len(frames), f"{len(kept)} of {len(frames)} images")
    number_at = {round(float(row["t_s"]), 5): int(row["frame"]) for row in frames}
    number_of = {int(row["frame"]): number_at.get(round(float(row["t_s"]) - offset_s, 5)) for row in kept}
    check(None not in number_of.values(), "coils and images are not of one clock")
    off = {number_of[int(row["frame"])] for row in kept if not row["file"]}
    check(off <= {10, 11} and off == {10, 11} & set(number_of.values()), f"without radiation are {off}")

    played_shapes, recorded_shapes = (offline_shapes(bed, each, "joint") for each in (folder, run))
    common = [number for number in sorted(number_of) if number_of[number] > 20]  # the tracker's noise is known by then
    apart_mm = [math.dist(a[1], b[1]) for number in common
                for a, b in zip(played_shapes[number_of[number]][1], recorded_shapes[number][1])]
    say(f"shapes of the recording lie {statistics.median(apart_mm):.5f} mm from those of what was played, {max(apart_mm):.5f} at most")
    check(len(apart_mm) > 1000 and max(apart_mm) < 0.01, "images or coils are others")
    check(recorder(bed).communicate(timeout=20)[1].count("is there already and not empty") == 1, "it would have written over a run")


def what_cannot_be_recorded_is_told(bed):
    bed.write("tubed.toml", bed.simulation())
    process = recorder(bed, "--seconds", "1", config="tubed.toml")
    words = process.communicate(timeout=20)[1]
    check(process.returncode == EXIT_FAILED and "has the driver simulation, whose images one program reads" in words
          and "--without-images" in words, words)
    process = recorder(bed, "--seconds", "1", "--without-images", config="tubed.toml")
    words = process.communicate(timeout=20)[1]
    check(process.returncode == EXIT_UNAVAILABLE and "no daemon published coils in domain 0" in words, f"{process.returncode}: {words}")


def it_listens_where_the_configuration_publishes_and_ends_with_its_terminal(bed):
    bed.write("tubed.toml", bed.simulation().replace("[dds]", "[dds]\ndomain = 78"))
    process = recorder(bed, "--without-images", config="tubed.toml")
    time.sleep(2 * beds.TIME_FACTOR)
    process.send_signal(signal.SIGHUP)
    words = process.communicate(timeout=20)[1]
    check(process.returncode == EXIT_UNAVAILABLE and "in domain 78" in words, f"{process.returncode}: {words}")
    check(rows_of(bed.folder / "run" / "em.csv") == [] and (bed.folder / "run" / "em.csv").stat().st_size > 0, "em.csv has no header")


def a_camera_that_gives_no_image_is_told_at_the_end(bed):
    folder = bed.folder / "played"
    sequences.write_sequence(folder, SECONDS)
    bed.start_daemon(configuration_of(bed, folder, "image_shm", loop=True))
    process = recorder(bed, "--seconds", "3")
    words = process.communicate(timeout=30)[1]
    check(process.returncode == EXIT_FAILED and "camera A gave no image: is its grabber running" in words.splitlines()[-1], words)


def coils_alone_are_recorded_and_calibrated_with(bed):
    bed.tracked()
    process = recorder(bed, "--seconds", "6", "--without-images")
    words = process.communicate(timeout=30)[1]
    check(process.returncode == EXIT_OK, words)
    check("SIMULATED. recorded by" in (bed.folder / "run" / "sequence.toml").read_text(), "the folder does not say that its coils are simulated")
    done = bed.tubectl("calibrate", "noise", "--moving", str(bed.folder / "run"))
    check("sigma_position_mm" in done.stdout + done.stderr, f"{done.returncode}: {done.stdout}{done.stderr}")


if __name__ == "__main__":
    beds.main(a_run_that_is_recorded_is_the_run_that_was_played, what_cannot_be_recorded_is_told,
              it_listens_where_the_configuration_publishes_and_ends_with_its_terminal, a_camera_that_gives_no_image_is_told_at_the_end,
              coils_alone_are_recorded_and_calibrated_with)
