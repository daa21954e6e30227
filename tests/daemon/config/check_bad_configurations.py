#!/usr/bin/env python3
"""Runs `tubed --check` on every case of bad_configurations.tsv: each has to end with exit code 78 and say file, line,
column, key and the expected word. The file as it is, and the installed sample, have to pass.

  check_bad_configurations.py TUBED     prints one line a case that went wrong and exits 1, or 0 when there is none
"""
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
EXIT_CONFIGURATION = 78  # sysexits.h


def unescaped(text):
    plain, escape = "", False
    for character in text:
        if escape:
            plain += {"n": "\n", "t": "\t"}.get(character, character)
        elif character != "\\":
            plain += character
        escape = character == "\\" and not escape
    return plain


def cases():
    for line in (HERE / "bad_configurations.tsv").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            find, replacement, position, key, word = line.split("\t")
            yield unescaped(find), unescaped(replacement), position, key, word


def check(tubed, file):
    run = subprocess.run([tubed, "--check", str(file)], capture_output=True, text=True, timeout=20)
    return run.returncode, run.stderr


def complaint(tubed, file, position, key, word):
    """What is wrong with how `file` was refused; empty when nothing is."""
    code, said = check(tubed, file)
    place = f"{file}:{position}: " + ("" if key == "-" else key + ":")
    after = said.partition(place)[2]
    if code != EXIT_CONFIGURATION:
        return f"exit code {code}"
    if place not in said or (word != "-" and word not in after):
        return f"expected {place} .. {word}, said {said.strip()}"
    return ""


def main(tubed):
    base = (HERE / "base.toml").read_text(encoding="utf-8")
    wrong, count = [], 0
    for good in (HERE / "base.toml", HERE.parents[2] / "systemd/tubed.toml"):
        if check(tubed, good)[0] != 0:
            wrong.append(f"{good} was refused")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "bad.toml"
        for find, replacement, *expected in cases():
            count += 1
            file.write_text(base.replace(find, replacement, 1), encoding="utf-8")
            why = complaint(tubed, file, *expected) if find in base else "base.toml does not have it"
            if why:
                wrong.append(f"{replacement!r}: {why}")
    print("\n".join(wrong + [f"{count} bad configurations, {len(wrong)} wrong"]))
    return 1 if wrong or count < 100 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
