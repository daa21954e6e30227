#!/usr/bin/env python3
"""A run that went through a capture card gives the shapes of the run itself, to the bit: video_shapes.py KERNEL PROGRAMS

Simulated radiographs are written to a video device of a kernel (video_guest.py) and read from another by the driver v4l2; both runs are
reconstructed here, outside of the guest, whose emulated processor is too slow for it.
"""
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent

EVERY, PICTURES = 12, 28  # of the preset's 337 exposures


def reconstructed(tubectl, folder):
    out = folder.with_suffix(".csv")
    subprocess.run([tubectl, "reconstruct", folder, "--out", out], check=True, stdout=subprocess.DEVNULL)
    return out.read_bytes()


def main():
    if len(sys.argv) != 3:
        print(__doc__)
        sys.exit(2)
    programs = pathlib.Path(sys.argv[2]).resolve()
    tubectl = programs / "tubectl"
    with tempfile.TemporaryDirectory(prefix="tubed-run-") as name:
        folder = pathlib.Path(name)
        shown = folder / "shown"
        subprocess.run([tubectl, "simulate", "--preset", "field", "--seed", "8", "--every", str(EVERY), "--out", shown], check=True,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        shared = folder / "shared"
        shutil.copytree(shown, shared / "run")
        guest = subprocess.run([sys.executable, HERE / "video_guest.py", sys.argv[1], programs, "video_run", "copy", "/tmp/run/run"],
                               env={**os.environ, "TUBED_GUEST_SHARE": str(shared)})
        if guest.returncode != 0:
            sys.exit(guest.returncode)
        written = [file for file in (shared / "run/images").iterdir() if file.stat().st_mtime_ns != (shown / "images" / file.name).stat().st_mtime_ns]
        before, after = reconstructed(tubectl, shown), reconstructed(tubectl, shared / "run")
        shapes = len({line.split(b",")[0] for line in before.splitlines()[1:]})
        print(f"{len(written)} radiographs went through the card; {shapes} shapes, {'the same' if before == after else 'OTHERS'} to the bit")
        sys.exit(0 if before == after and shapes == len(written) == PICTURES else 1)


if __name__ == "__main__":
    main()
