"""What TAB offers after `tubectl`: in an interactive bash at a pseudo-terminal, and for every verb and option as COMPREPLY.

  completion.py FOLDER_OF_PROGRAMS COMPLETION_FILE
"""
import os
import pathlib
import pty
import re
import select
import signal
import subprocess
import sys
import tempfile
import time

TIME_FACTOR = float(os.environ.get("TUBED_TIME_FACTOR", "1"))
ANSWER_S = 60 * TIME_FACTOR

# What is typed, and how the line reads afterwards. The shell stands in a folder with "bin", "a folder" and "notes.txt".
LINES = (("tubectl dem\t", "tubectl demo "),
         ("tubectl demo --pre\t", "tubectl demo --preset "),
         ("tubectl demo --preset fi\t", "tubectl demo --preset field "),
         ("tubectl demo --preset=fi\t", "tubectl demo --preset=field "),
         ("tubectl demo --tracker aurora-s\t", "tubectl demo --tracker aurora-serial "),
         ("tubectl reconstruct --mode pa\t", "tubectl reconstruct --mode paper "),
         ("tubectl reconstruct a\t", "tubectl reconstruct a\\ folder/"),
         ("tubectl check no\t", "tubectl check notes.txt "),
         ("tubectl keys ren\t", "tubectl keys renew "),
         ("bin/tubectl dem\t", "bin/tubectl demo "))
# What is typed, and what a second TAB lists, all of it.
LISTS = (("tubectl demo --tracker \t\t", {"simulation", "aurora-serial", "aurora-can"}),
         ("tubectl reconstruct --mode \t\t", {"em", "paper", "joint", "filter"}),
         ("tubectl stat\t\t", {"stat", "status"}))

OFFERED = """source "$1"; shift
COMP_WORDS=(tubectl "$@"); COMP_CWORD=$#; _tubectl tubectl "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


class Shell:
    """An interactive bash in this folder that has read the completion. Use as a context manager."""

    def __init__(self, folder, completion, keys):
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            if keys.startswith("bin/"):  # the one that is typed explains itself
                os.environ["PATH"] = "/usr/bin:/bin"
            os.environ.update(PS1="$ ", TERM="dumb", INPUTRC="/dev/null", HISTFILE="/dev/null", LC_ALL="C")
            os.execvp("bash", ["bash", "--norc", "--noprofile", "-i"])
        self.type(f"bind 'set enable-bracketed-paste off'; source '{completion}'; echo rea''dy\n")
        # What is typed before the prompt is there is echoed by the kernel, and looks like an answer.
        self.read_until(lambda screen: screen.endswith("ready\r\n$ "))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.kill(self.pid, signal.SIGKILL)
        os.waitpid(self.pid, 0)
        os.close(self.terminal)

    def type(self, keys):
        os.write(self.terminal, keys.encode())

    def read_until(self, found):
        """What the screen shows, without bells, when it shows what is looked for or too much time has passed."""
        screen, until = "", time.monotonic() + ANSWER_S
        while not found(screen) and time.monotonic() < until:
            if select.select([self.terminal], [], [], 0.2)[0]:
                screen += os.read(self.terminal, 4096).decode(errors="replace").replace("\a", "")
        return screen


def programs_in_a_folder(folder, programs):
    (folder / "a folder").mkdir()
    (folder / "notes.txt").write_text("")
    (folder / "bin").symlink_to(programs)


def in_an_interactive_shell(folder, completion):
    wrong = []
    for keys, line in LINES:
        with Shell(folder, completion, keys) as shell:
            shell.type(keys)
            screen = shell.read_until(lambda shown, line=line: line in shown)
            if not screen.endswith(line):
                wrong.append(f"{keys!r} reads {screen!r}, not {line!r}")
    for keys, words in LISTS:
        with Shell(folder, completion, keys) as shell:
            shell.type(keys)
            # The list, then the line once more.
            screen = shell.read_until(lambda shown, keys=keys: shown.count(keys.rstrip("\t")) >= 2)
            listed = set(screen.partition("\n")[2].rpartition("\n")[0].split())
            if listed != words:
                wrong.append(f"{keys!r} lists {sorted(listed)}, not {sorted(words)}")
    return wrong


def words_offered(completion, *words):
    done = subprocess.run(["bash", "-c", OFFERED, "offered", str(completion), *words], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def help_of(*verb):
    return subprocess.run(["tubectl", *verb, "--help"], capture_output=True, text=True, check=True).stdout


def verbs_below(*verb):
    """Lists of words, as ["calibrate", "camera"]."""
    text = help_of(*verb).partition("\nExample")[0]
    below = re.findall(r"^  ([a-z][a-z-]*) ", text, re.MULTILINE)
    return [[*verb, name] for name in below] + [longer for name in below for longer in verbs_below(*verb, name)]


def as_help_explains(completion):
    """Every verb, every option and every word that an option takes is offered."""
    wrong, verbs = [], verbs_below()
    if len(verbs) < 20:
        wrong.append(f"tubectl --help names {len(verbs)} verbs only: {verbs}")
    for verb in verbs:
        if verb[-1] not in words_offered(completion, *verb[:-1], verb[-1][:2]):
            wrong.append(f"{verb} is not offered")
        text = help_of(*verb)
        if verbs_below(*verb):
            continue
        options = set(re.findall(r"^ +(?:-\w,)?(--[a-z][a-z0-9-]*)", text, re.MULTILINE))
        offered = words_offered(completion, *verb, "--")
        if offered != options or "--help" not in options:
            wrong.append(f"{' '.join(verb)} has {sorted(options)}, offered: {sorted(offered)}")
        for option, words in re.findall(r"^ +(--[a-z-]+) \w+:\{([^}]*)\}", text, re.MULTILINE):
            offered = words_offered(completion, *verb, option, "")
            if offered != set(words.split(",")):
                wrong.append(f"{' '.join(verb)} {option} takes {words}, offered: {sorted(offered)}")
    return wrong


def main(programs, completion):
    os.environ["PATH"] = f"{programs}:{os.environ['PATH']}"
    with tempfile.TemporaryDirectory(prefix="tubed-completion-") as name:
        programs_in_a_folder(pathlib.Path(name), programs)
        wrong = in_an_interactive_shell(name, completion) + as_help_explains(completion)
    print("\n".join([f"FAILED: {line}" for line in wrong] or ["passed"]))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(str(pathlib.Path(sys.argv[1]).resolve()), pathlib.Path(sys.argv[2]).resolve()))
