#!/usr/bin/env python3
"""Writes tubectl.1 and tubed.toml.5 from what the programs say of themselves: make_man_pages.py PROGRAMS FOLDER."""
import pathlib
import re
import subprocess
import sys


def said_by(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def verbatim(text):
    lines = (line.replace("\\", "\\e").replace("-", "\\-") for line in text.rstrip().splitlines())
    return ".nf\n" + "\n".join("\\&" + line for line in lines) + "\n.fi\n"


def tubectl_page(program):
    help_text = said_by(program, "--help")
    verbs = re.findall(r"^  ([a-z][a-z-]*) ", help_text.split("Examples:")[0], re.M)
    page = ('.TH TUBECTL 1 "2026-11" "tubed" "User commands"\n.SH NAME\n'
            "tubectl \\- track, judge and configure what tubed sees of a catheter\n"
            ".SH SYNOPSIS\n.B tubectl\n.I VERB\n.RI [ options ]\n.SH DESCRIPTION\n" + verbatim(help_text))
    for verb in verbs:
        name = verb.upper().replace("-", "\\-")
        page += f".SH {name}\n" + verbatim(said_by(program, verb, "--help"))
    return page + ".SH SEE ALSO\n.BR tubed (8)\n"


def configuration_page(program):
    return ('.TH TUBED.TOML 5 "2026-11" "tubed" "File formats"\n.SH NAME\ntubed.toml \\- configuration of tubed\n'
            ".SH DESCRIPTION\nTOML. Every key, with what it takes and its default, as\n.B tubed \\-\\-sample\nprints it:\n.PP\n"
            + verbatim(said_by(program, "--sample")) + ".SH SEE ALSO\n.BR tubed (8)\n")


def main():
    programs, folder = map(pathlib.Path, sys.argv[1:3])
    (folder / "tubectl.1").write_text(tubectl_page(programs / "tubectl"))
    (folder / "tubed.toml.5").write_text(configuration_page(programs / "tubed"))


main()
