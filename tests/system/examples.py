#!/usr/bin/env python3
"""The examples of clients/tubectl/examples.md, typed into a shell: what is printed is what the document says.

examples.py FOLDER_OF_PROGRAMS SCENARIO runs them. examples.py FOLDER_OF_PROGRAMS --write puts what is printed now into the document, where that
differs. examples.py --files FOLDER writes the files that the examples begin with.
"""
import itertools
import os
import pathlib
import re
import subprocess
import sys

import bed as beds
import calm
import example_files
from bed import check, say

DOCUMENT = pathlib.Path(__file__).resolve().parents[2] / "clients/tubectl/examples.md"
END = "\x1e"  # after what a command has printed, and after its exit code
ANYTHING = "…"  # in a line, or a line of its own for any lines
LIMIT_S = 120  # of one command


def blocks_of(text):
    """(first line, line behind the last) of the tested blocks, without their fences."""
    lines, first = text.splitlines(), None
    for i, line in enumerate(lines):
        if line == "```console":
            first = i + 1
        elif line == "```" and first is not None:
            yield first, i
            first = None


def commands_of(lines):
    """(command, lines that it is said to print)."""
    command, said = None, []
    for line in lines:
        if line.startswith("$ "):
            if command is not None:
                yield command, said
            command, said = line[2:], []
        else:
            check(command is not None, f"a block of examples does not begin with a command: {line}")
            said.append(line)
    if command is not None:
        yield command, said


def as_a_terminal_shows(text):
    """Lines, where a carriage return begins one anew."""
    shown = []
    for line in text.rstrip("\n").split("\n") if text else []:
        parts = [re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", part) for part in line.split("\r")]
        shown.append(next((part for part in reversed(parts) if part.strip()), "").rstrip())
    return shown


def pattern_of(line):
    """What a line may be printed as: other numbers, other dates, other blanks between columns."""
    if re.fullmatch(r"\d+", line):
        return re.escape(line)
    parts = re.split(rf"({ANYTHING}|[-+]?\d[\d.e]*|\s+)", line.strip())
    as_pattern = {ANYTHING: ".*"}
    return r"\s*" + "".join(as_pattern.get(part) or (r"\s+" if part.isspace() else r"[-+]?\d[-+\d.e]*" if re.fullmatch(r"[-+]?\d[\d.e]*", part)
                                                     else re.escape(part)) for part in parts) + r"\s*"


def matches(said, shown):
    """Whether the lines that were printed are as it is said."""
    if not said:
        return not shown
    if said[0] == ANYTHING:
        return any(matches(said[1:], shown[i:]) for i in range(len(shown) + 1))
    return bool(shown) and re.fullmatch(pattern_of(said[0]), shown[0]) is not None and matches(said[1:], shown[1:])


def merged(said, shown):
    """What is printed now, with the lines of the document that are right."""
    if ANYTHING in said:
        at = said.index(ANYTHING)
        behind = said[at + 1:]
        if matches(said[:at], shown[:at]) and (not behind or matches(behind, shown[len(shown) - len(behind):])):
            return said
    return [line if line is not None and re.fullmatch(pattern_of(line), now) else now
            for line, now in itertools.islice(itertools.zip_longest(said, shown), len(shown))]


class Shell:
    """One bash in a folder; its output and its errors in the order in which they come."""

    def __init__(self, folder, programs):
        environment = dict(os.environ, PATH=f"{pathlib.Path(programs).resolve()}:{os.environ['PATH']}", LC_ALL="C.UTF-8", COLUMNS="100")
        self.process = subprocess.Popen(["bash", "--noprofile", "--norc"], cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True, bufsize=1, preexec_fn=calm.die_with_parent)

    def run(self, command):
        """The lines that a command prints."""
        text = ""
        self.process.stdin.write(f"(exit ${{code:-0}})\n{command}\ncode=$?; printf '{END}'\n")
        self.process.stdin.flush()
        while not text.endswith(END):
            letter = self.process.stdout.read(1)
            check(letter, f"the shell has ended in {command}")
            text += letter
        return as_a_terminal_shows(text[:-1])

    def end(self):
        self.process.stdin.write("kill $(jobs -p) 2>/dev/null; wait; exit\n")
        self.process.stdin.close()
        self.process.wait(20)


def run_examples(bed, judge):
    """Types every command; `judge` gets the command, what is said, what is printed."""
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    folder = bed.folder / "examples"
    folder.mkdir()
    example_files.write_all(folder)
    shell = Shell(folder, bed.programs)
    bed.closing.callback(shell.process.kill)
    for first, end in blocks_of("\n".join(lines)):
        for command, said in commands_of(lines[first:end]):
            judge(command, said, shell.run(f"timeout {LIMIT_S} {command}" if re.fullmatch(r"tubectl [^|>&;]*", command) else command))
    shell.end()


def every_example_prints_what_the_document_says(bed):
    wrong, count = [], 0

    def judge(command, said, shown):
        nonlocal count
        count += 1
        if not matches(said, shown):
            wrong.append(f"$ {command}\n--- the document says\n" + "\n".join(said) + "\n--- it prints\n" + "\n".join(shown))

    run_examples(bed, judge)
    say(f"{count} commands, {len(wrong)} of them print something else")
    check(count > 40, "the document has lost its examples")
    check(not wrong, "\n".join(wrong) + f"\n(if that is right now: {pathlib.Path(__file__).name} FOLDER_OF_PROGRAMS --write)")


def every_verb_has_an_example(bed):
    text = DOCUMENT.read_text(encoding="utf-8")
    listed = bed.tubectl("--help").stdout
    verbs = [match[1] for match in re.finditer(r"^  ([a-z-]+) {2,}[A-Z]", listed, re.MULTILINE) if not match[1].startswith("-")]
    check(len(verbs) > 15, f"`tubectl --help` lists {verbs}")
    typed = {command.split()[i + 1] for first, end in blocks_of(text) for command, _ in commands_of(text.splitlines()[first:end])
             for i, word in enumerate(command.split()[:-1]) if word == "tubectl"}
    check(set(verbs) <= typed, f"without an example: {sorted(set(verbs) - typed)}")
    headings = set(re.findall(r"^### (\S+)$", text, re.MULTILINE))
    check(set(verbs) <= headings, f"without a heading: {sorted(set(verbs) - headings)}")


def wrong_examples_are_found(bed):
    """Of the comparison itself."""
    for said, shown, is_right in ((["rate 30.1 Hz"], ["rate 9 Hz"], True), (["rate 30.1 Hz"], ["rates 9 Hz"], False), (["69"], ["70"], False),
                                  (["a …"], ["a b c"], True), (["a", "…", "z"], ["a", "b", "z"], True), (["a", "…", "z"], ["a", "b"], False),
                                  ([], ["a"], False), (["a"], [], False), (["x   y"], ["x y"], True), (["1.5 mm", "b"], ["-2e-05 mm", "b"], True)):
        check(matches(said, shown) == is_right, f"{said} and {shown} are {'not ' if is_right else ''}taken for the same")
    check(as_a_terminal_shows("a\rb\n\x1b[Kc\n") == ["b", "c"], "carriage returns")
    check(len(list(blocks_of("```sh\na\n```\n```console\n$ b\n```"))) == 1, "blocks")


def write_document(bed):
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    printed = []
    run_examples(bed, lambda command, said, shown: printed.append((command, merged(said, shown))))
    text, at, answers = [], 0, iter(printed)
    for first, end in blocks_of("\n".join(lines)):
        text += lines[at:first]
        for _ in commands_of(lines[first:end]):
            command, shown = next(answers)
            text += [f"$ {command}", *shown]
        at = end
    DOCUMENT.write_text("\n".join([*text, *lines[at:]]) + "\n", encoding="utf-8")
    say(f"wrote {DOCUMENT.name}: {len(printed)} commands")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--files":
        example_files.write_all(pathlib.Path(sys.argv[2]))
    elif len(sys.argv) == 3 and sys.argv[2] == "--write":
        sys.exit(beds.run_scenario([write_document], sys.argv[1], write_document.__name__, visible=[DOCUMENT]))
    else:
        beds.main(every_example_prints_what_the_document_says, every_verb_has_an_example, wrong_examples_are_found)
