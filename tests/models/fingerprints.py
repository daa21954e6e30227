#!/usr/bin/env python3
"""Holds the models to the source that they model.

  fingerprints.py                  has any function that a model names changed since the model was checked? Has every memory
                                   order its row in the table of README.md, and each row its source and its control?
  fingerprints.py --accept MODEL.. after looking at the model and running it: takes the source as it is now

A model names what it models in lines `MODELS FILE FUNCTION FINGERPRINT`; FUNCTION may have its parameters behind it, or be
`class NAME`. The fingerprint is the SHA-256 of the text without comments and white space, cut to 16 digits.
"""
import argparse
import hashlib
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SOURCES = ("daemon/pipeline/*.hpp", "daemon/pipeline/*.cpp", "idl/shm_*.hpp", "idl/shm_*.cpp")
NAMED = re.compile(r"^ \* MODELS (?P<file>\S+) (?P<what>.*?)(?: (?P<print>[0-9a-f]{16}))?$", re.M)
LITERAL_OR_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/', re.S)
CLOSING = {"(": ")", "{": "}"}


def without_comments(text):
    return LITERAL_OR_COMMENT.sub(lambda found: " " if found[0].startswith("/") else found[0], text)


def closed(text, opening):
    """Index behind the bracket that closes the one at `opening`."""
    depth, pair = 0, (text[opening], CLOSING[text[opening]])
    for at in range(opening, len(text)):
        depth += (text[at] == pair[0]) - (text[at] == pair[1])
        if depth == 0:
            return at + 1
    raise ValueError("a bracket is not closed")


def body_after(text, at):
    """Index of the `{` of a definition whose parameters end at `at`; None for a call or a declaration."""
    while at < len(text):
        if text[at] == "(":
            at = closed(text, at)
        elif text[at] == "{":
            return at
        elif text[at] in ";)}=":
            return None
        else:
            at += 1
    return None


def pattern_of(what):
    tokens = re.findall(r"\w+|\S", what)
    return re.compile(r"(?<!\w)" + r"\s*".join(re.escape(token) for token in tokens) + r"(?!\w)")


def definitions(text, what):
    for found in pattern_of(what).finditer(text):
        at = found.end()
        if what.startswith(("class ", "struct ")):
            opening = re.compile(r"[^;{]*\{").match(text, at)
            body = opening.end() - 1 if opening else None
        else:
            if not what.endswith(")"):
                parameters = re.compile(r"\s*\(").match(text, at)
                if not parameters:
                    continue
                at = closed(text, parameters.end() - 1)
            body = body_after(text, at)
        if body is not None:
            yield text[found.start():closed(text, body)]


def fingerprint(file, what):
    """None when there is no such thing."""
    path = ROOT / file
    if not path.exists():
        return None
    text = "".join(definitions(without_comments(path.read_text()), what))
    return hashlib.sha256("".join(text.split()).encode()).hexdigest()[:16] if text else None


def models():
    return sorted(model for model in HERE.glob("*.pml") if model.stem != "weak_memory")


def changed(model):
    for named in NAMED.finditer(model.read_text()):
        now = fingerprint(named["file"], named["what"])
        if now is None:
            yield (f"{model.name} models {named['what']}, which {named['file']} does not have: correct the line MODELS of "
                   f"tests/models/{model.name}")
        elif now != named["print"]:
            yield (f"the source of {named['what']} ({named['file']}) has changed since its model was checked: look at "
                   f"tests/models/{model.name}, run it (ctest -R models/{model.stem}), then accept the change with "
                   f"tests/models/fingerprints.py --accept {model.stem}")


def controls_not_run():
    built = (HERE / "CMakeLists.txt").read_text()
    for model in models():
        run = re.search(rf"tubed_model\({model.stem}\b([^)]*)\)", built)
        for control in re.findall(r"^ \*   ([A-Z][A-Z_,=0-9]+)  ", model.read_text(), re.M):
            if not run or control not in run[1].split():
                yield f"{model.name} describes the control {control}, which tests/models/CMakeLists.txt does not run"


def accept(name):
    model = HERE / f"{name.removesuffix('.pml')}.pml"
    accepted = NAMED.sub(lambda named: f" * MODELS {named['file']} {named['what']} "
                         f"{fingerprint(named['file'], named['what'])}", model.read_text())
    model.write_text(accepted)
    return list(changed(model))


def squeezed(code):
    return re.sub(r"\s+", "", code)


def statements():
    """(file, statement without white space, order) of every memory order."""
    for pattern in SOURCES:
        for path in sorted(ROOT.glob(pattern)):
            text = without_comments(path.read_text())
            at = 0
            for end in re.finditer(r";|[{}]\s*\n", text):
                for order in re.findall(r"memory_order_(\w+)", text[at:end.start()]):
                    yield str(path.relative_to(ROOT)), squeezed(text[at:end.start()]), order
                at = end.end()


def table():
    for line in (HERE / "README.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if len(cells) == 4 and cells[0].startswith("`") and cells[1].startswith("`"):
            yield cells[0].strip("`"), squeezed(cells[1].strip("`")), cells[2].strip("`"), cells[3]


def unknown_controls(control):
    built = (HERE / "CMakeLists.txt").read_text()
    for model, name in re.findall(r"`(\w+): ([\w,]+)`", control):
        words = (HERE / f"{model}.pml").read_text() if (HERE / f"{model}.pml").exists() else ""
        if not all(re.search(rf"\b{part}\b", words) for part in name.split(",")) or not re.search(rf"\b{name}\b", built):
            yield f"{model}: {name}"


def table_problems():
    rows, used = list(table()), set()
    for file, statement, order in statements():
        fitting = [row for row in rows if row[0] == file and row[1] in statement and row[2] == order]
        used.update(fitting)
        if not fitting:
            yield f"{file}: the memory order {order} of '{statement}' has no row in tests/models/README.md: what needs it, what shows that?"
    for row in rows:
        boost = row[0].startswith("boost/") and row[1] + f"memory_order_{row[2]}" in squeezed(
            pathlib.Path("/usr/include", row[0]).read_text())
        if row not in used and not boost:
            yield f"tests/models/README.md has a row for '{row[1]}' with {row[2]}, which {row[0]} does not have"
        for control in unknown_controls(row[3]):
            yield f"tests/models/README.md names the control {control}, which is not run"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--accept", nargs="+", metavar="MODEL", default=[])
    chosen = arguments.parse_args()
    problems = [problem for name in chosen.accept for problem in accept(name)]
    if not chosen.accept:
        problems = [problem for model in models() for problem in changed(model)] + list(controls_not_run()) + list(table_problems())
    print("\n".join(problems) if problems else "every model fits its source")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
