"""Fluoroscopic runs of DICOM files, through shared memory. The files are written here, byte by byte, not by the library that reads them."""
import csv
import math
import struct
import time

import bed as beds
import sequences
import shared_memory as shared
from bed import check, check_timing, is_fused, say

SECONDS = 3
START_IN_S = 3


def element(group, number, kind, value):
    """Explicit VR, little endian (PS3.5 7.1.2)."""
    value += (b"\0" if kind == b"UI" else b" ") if len(value) % 2 else b""
    length = struct.pack("<HI", 0, len(value)) if kind in (b"OW", b"OB") else struct.pack("<H", len(value))
    return struct.pack("<HH", group, number) + kind + length + value


def write_run(path, images, times_s):
    """An X-ray angiographic image of rows of 8 bit, stored as 12 bits in 16, with a FrameTimeVector."""
    width, height = len(images[0][0]), len(images[0])
    increments = "\\".join(["0"] + [f"{1000 * (b - a):.4f}" for a, b in zip(times_s, times_s[1:])])
    short = lambda value: struct.pack("<H", value)
    pixels = b"".join(struct.pack(f"<{width}H", *(16 * level for level in row)) for image in images for row in image)
    meta = element(2, 0x10, b"UI", b"1.2.840.10008.1.2.1")
    body = (element(8, 0x60, b"CS", b"XA") + element(0x10, 0x10, b"PN", b"Secret^Patient") + element(0x18, 0x1065, b"DS", increments.encode())
            + element(0x20, 0xE, b"UI", b"1.2.3") + element(0x28, 2, b"US", short(1)) + element(0x28, 4, b"CS", b"MONOCHROME2")
            + element(0x28, 8, b"IS", str(len(images)).encode()) + element(0x28, 0x10, b"US", short(height))
            + element(0x28, 0x11, b"US", short(width)) + element(0x28, 0x100, b"US", short(16)) + element(0x28, 0x101, b"US", short(12))
            + element(0x28, 0x102, b"US", short(11)) + element(0x28, 0x103, b"US", short(0)) + element(0x28, 0x1040, b"CS", b"LOG"))
    path.write_bytes(bytes(128) + b"DICM" + element(2, 0, b"UL", struct.pack("<I", len(meta))) + meta + body
                     + element(0x7FE0, 0x10, b"OW", pixels))


def run_of(folder, path):
    """The images of a sequence folder as a DICOM file; the time of its first, s."""
    rows = list(csv.DictReader((folder / "frames.csv").open()))
    times = [float(row["t_s"]) for row in rows]
    write_run(path, [sequences.rows_of((folder / row["file"]).read_bytes()) for row in rows], times)
    return times[0]


def played(bed, folder, run=None, first_s=0.0):
    """Tips by the exposure's time since the start, while the folder's coils are played, with the images of the folder or the run."""
    start_ns = time.monotonic_ns() + START_IN_S * 1_000_000_000
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(shared.configuration_of(bed, folder, "image_shm", start_ns))
    if run is None:
        grabber = shared.Grabber(bed, folder, "--start-monotonic-ns", str(start_ns))
    else:
        grabber = shared.Grabber(bed, run, "--start-monotonic-ns", str(start_ns + round(first_s * 1e9)), option="--dicom")
    time.sleep(START_IN_S + SECONDS + 0.5)
    samples = [sample for sample in subscriber.samples() if is_fused(sample) and sample["is_image_instant"]
               and sample["valid_time_monotonic_ns"] > start_ns + 1_000_000_000]
    subscriber.stop()
    check(daemon.stop() == 0, "the daemon did not end well")
    words = grabber.log.read_text()
    check(grabber.process.wait(5) == 0, words)
    return {round((sample["valid_time_monotonic_ns"] - start_ns) / 1e6): sample["points"][0]["p_world_mm"] for sample in samples}, words


def a_run_gives_the_shapes_of_the_folder_that_it_is_made_of(bed):
    folder, run = bed.folder / "sequence", bed.folder / "run.dcm"
    sequences.write_sequence(folder, SECONDS, image_rate_hz=15)
    first_s = run_of(folder, run)
    of_folder, _ = played(bed, folder)
    of_run, words = played(bed, folder, run, first_s)
    check("response = \"log\"" in words and "12 bits" in words, words)
    check("Secret" not in words, "a patient's name is told")
    common = sorted(set(of_folder) & set(of_run))
    check_timing(len(common) >= 0.7 * max(len(of_folder), len(of_run)), f"{len(common)} of {len(of_folder)} and {len(of_run)} exposures in common")
    apart = sorted(math.dist(of_folder[at], of_run[at]) for at in common)
    say(f"{len(common)} exposures in common, tips apart: median {apart[len(apart) // 2]:.4f} mm, at most {apart[-1]:.4f} mm")
    check(apart[len(apart) // 2] < 0.05 and apart[int(0.9 * len(apart))] < 0.3, f"shapes differ: {apart[-5:]} mm")


def what_is_no_run_is_told_in_words(bed):
    bad = bed.write("notes.txt", "no pictures")
    done = bed.tubectl("grab", "--dicom", str(bad), "--socket", str(bed.folder / "image-A.sock"))
    check(done.returncode == 69 and "is no DICOM file" in done.stderr, f"{done.returncode}: {done.stderr}")
    done = bed.tubectl("grab", "--dicom", str(bad), "--video", "/dev/video0", "--socket", str(bed.folder / "image-A.sock"))
    check(done.returncode == 64 and "one of them" in done.stderr, f"{done.returncode}: {done.stderr}")


if __name__ == "__main__":
    beds.main(a_run_gives_the_shapes_of_the_folder_that_it_is_made_of, what_is_no_run_is_told_in_words)
