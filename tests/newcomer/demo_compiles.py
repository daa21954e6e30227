#!/usr/bin/env python3
"""`./run demo` in this tree: it compiles (other files together, with another compiler and fewer options than the tests are built with),
tracks, and draws a tube.

  demo_compiles.py SOURCES     77 when packages are missing that it may not install
"""
import pathlib
import subprocess
import sys
import tempfile

from first_picture import Failure, SKIP, check, judge_picture, say

NOT_AVAILABLE = 69  # of ./run: a package is missing, and cannot be installed


def main():
    sources = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder)
        command = ["./run", "demo", "--headless", "3", "--picture", str(out / "first.svg"), "--json", str(out / "out.json")]
        demo = subprocess.run(command, cwd=sources, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
        say(demo.stdout)
        if demo.returncode == NOT_AVAILABLE and "run: " in demo.stdout:
            return SKIP
        check(demo.returncode == 0, f"`{' '.join(command)}` exits {demo.returncode}")
        judge_picture(out)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Failure as failure:
        say(f"FAILED: {failure}")
        sys.exit(1)
