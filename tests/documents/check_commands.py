"""Whether what the documents tell a person to type can be typed: check_commands.py SOURCES FOLDER_OF_PROGRAMS.

Every command of tubectl, tubed and tubed-view in a block of code or between back quotes of a Markdown file of the tree names verbs and options that the
program's --help has; so does every ./run, whose demo and view are tubectl's, and whose benchmarks are programs of their own; and a script of the tree
that is run is there. It says nothing of other files and of values. check_commands.py --self-test: wrong commands are found.
"""
import functools
import pathlib
import re
import shlex
import subprocess
import sys

PROGRAMS = ("tubectl", "tubed", "tubed-view", "tubed-exporter")
CODE = re.compile(r"^(?:    |\t)(?P<indented>.*)$|`(?P<inline>[^`\n]+)`", re.MULTILINE)
SCRIPT = re.compile(r"(?:\./)?(?:bench|clients|daemon|drivers|idl|systemd|tests)/[\w./-]+\.(?:py|sh)")
FENCE = re.compile(r"^```[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)


def code_of(text):
    """(line number, code) of each line of a block and of each span."""
    def number(at):
        return text.count("\n", 0, at) + 1

    for match in FENCE.finditer(text):
        for i, line in enumerate(match[1].splitlines(), start=1):
            yield number(match.start()) + i, line
    blank = FENCE.sub(lambda match: "\n" * match[0].count("\n"), text)
    for match in CODE.finditer(blank):
        yield number(match.start()), match["indented"] if match["inline"] is None else match["inline"]


def commands_of(code):
    """Words of each command of one of the programs in a line of code, the program first."""
    code = re.sub(r"\s#\s.*$", "", code)
    try:
        words = list(shlex.shlex(code, posix=True, punctuation_chars="|&;<>()"))
    except ValueError:  # a quote that is not closed: words about a command
        return
    command = None
    for word in [*words, ";"]:
        if set(word) <= set("|&;<>()"):
            if command:
                yield command
            command = None
        elif command is not None:
            command.append(word)
        elif pathlib.PurePath(word).name in PROGRAMS and (word in PROGRAMS or "/bin/" in word):
            command = [pathlib.PurePath(word).name]
        elif word == "./run" or SCRIPT.fullmatch(word):
            command = [word]


def split_options(words):
    """shlex cuts at punctuation only where it is told to: --x=1 stays, and so does --x."""
    return [word.partition("=")[0] for word in words if re.match(r"--?[a-zA-Z]", word)]


class Helps:
    """What the programs' --help says, asked once a command."""

    def __init__(self, sources, folder):
        self.sources, self.folder = pathlib.Path(sources).absolute(), pathlib.Path(folder)

    @functools.lru_cache(maxsize=None)
    def of(self, *words):
        """None: there is no such program here, or no such verb."""
        if "/" in words[0] and words[0] != "./run":  # a script, the folder of a benchmark
            return "" if (self.sources / words[0]).exists() else None
        program = (self.sources if words[0] == "./run" else self.folder) / words[0]
        if not program.exists():
            return None
        done = subprocess.run([program, *words[1:], "--help"], capture_output=True, text=True, timeout=30, check=False)
        return done.stdout if done.returncode == 0 else None


def names_of(text):
    options = set(re.findall(r"(?<![\w-])(--?[a-zA-Z][\w-]*)", text))
    verbs = set(re.findall(r"^  ([a-z][a-z-]*) {2,}\S", text, re.MULTILINE))
    return options, verbs


def fault_of_run(words, helps):
    """The same of ./run, which passes on what it does not know itself."""
    commands = re.findall(r"^  \./run (\w+)", helps("./run"), re.MULTILINE)
    if len(words) == 1 or not re.fullmatch(r"[a-z]+", words[1]):  # ./run itself, or COMMAND
        return None
    if words[1] not in commands:
        return f"`./run` has no command '{words[1]}'"
    if words[1] in ("demo", "view"):
        return fault_of(["tubectl", *words[1:]], helps)
    if words[1] != "bench" or len(words) == 2 or not re.fullmatch(r"[a-z][a-z_-]*", words[2]) or words[2] in ("all", "table"):
        return None
    if helps(f"bench/{words[2]}") is None:
        return f"there is no benchmark '{words[2]}'"
    return fault_of([f"{words[2]}_bench", *words[3:]], helps)


def fault_of(words, helps):
    """What is wrong with a command; None: nothing."""
    if words[0] == "./run":
        return fault_of_run(words, helps)
    if SCRIPT.fullmatch(words[0]):
        return f"there is no {words[0]}" if helps(words[0]) is None else None
    path = [words[0]]
    if helps(*path) is None:
        return None  # not built here
    for word in words[1:]:
        options, verbs = names_of(helps(*path))
        if not verbs or word.startswith("-"):
            break
        if not re.fullmatch(r"[a-z][a-z-]*", word):  # VERB, ...
            return None
        if word not in verbs:
            return f"`{' '.join(path)}` has no verb '{word}'"
        path.append(word)
    options, _ = names_of(helps(*path))
    for option in split_options(words[len(path):]):
        if option not in options and option != "--help":
            return f"`{' '.join(path)}` has no option {option}"
    return None


def faults(sources, helps):
    """(where, what is wrong) of every command in the documents; and how many there are."""
    listed = subprocess.run(["git", "-C", str(sources), "ls-files", "-co", "--exclude-standard", "*.md"], capture_output=True, text=True, check=True)
    found, count = [], 0
    for name in sorted(listed.stdout.splitlines()):
        if name == "CHANGELOG.md":  # tells of what has been
            continue
        for line, code in code_of((sources / name).read_text(encoding="utf-8")):
            for words in commands_of(code):
                count += 1
                if fault := fault_of(words, helps):
                    found.append((f"{name}:{line}", fault))
    return found, count


def self_test():
    helps = {("tubectl",): "  echo    Print\n  keys    Make\n  demo    See\n", ("tubectl", "echo"): "  --count UINT  \n  -h,--help\n",
             ("tubectl", "keys"): "  add   One\n", ("tubectl", "keys", "add"): "  --days INT\n"}
    helps |= {("./run",): "  ./run demo [...]   see\n  ./run bench NAME  \n  ./run docs   \n", ("tubectl", "demo"): "  --web  \n", ("bench/load",): "",
              ("load_bench",): "  --seconds N  \n", ("bench/grab",): "", ("tests/a.py",): ""}
    for code, is_right in (("./run demo --web", True), ("./run demo --wed", False), ("./run doc", False), ("./run", True), ("./run COMMAND", True),
                           ("./run bench load --seconds 3", True), ("./run bench load --second 3", False), ("./run bench laod", False),
                           ("./run bench grab --not-built 3", True), ("python3 tests/a.py", True), ("tests/b.py X", False),
                           ("tubectl echo --count 3", True), ("tubectl echo --counts 3", False), ("tubectl ecko", False), ("tubectl VERB --help", True),
                           ("tubectl keys add x --days=3 | grep --nothing", True), ("tubectl keys add x --dys=3", False),
                           ("a; build/release/bin/tubectl echo --no", False), ("see tubectl", True), ("tubectl echo # --comment", True)):
        wrong = [fault for words in commands_of(code) if (fault := fault_of(words, lambda *path: helps.get(path)))]
        assert bool(wrong) != is_right, (code, wrong)
    text = "a `tubectl echo` b\n\n    tubectl keys\n\n```sh\ntubed --check x\n```\n"
    assert [line for line, _ in code_of(text)] == [6, 1, 3], list(code_of(text))
    return 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    sources, folder = pathlib.Path(sys.argv[1]), sys.argv[2]
    found, count = faults(sources, Helps(sources, folder).of)
    for where, fault in found:
        print(f"{where}: {fault}")
    print(f"{count} commands in the documents, {len(found)} cannot be typed")
    if count < 50:
        print("the documents have lost their commands")
    return 1 if found or count < 50 else 0


if __name__ == "__main__":
    sys.exit(main())
