"""Whether the documents of hazards, threats and foreign software name tests that exist: check_documents.py SOURCES BUILD CTEST.

In a table whose last heading is "test", each row names at least one test of CTest in back quotes, or says **none**. Requirements
are R-WORD-1; each is stated once. Where a test program is not built, CTest cannot list its tests: those are read from its sources.
check_documents.py --self-test: wrong tables are found.
"""
import json
import pathlib
import re
import subprocess
import sys
import tomllib

DOCUMENTS = ("daemon/HAZARDS.md", "daemon/SECURITY-MODEL.md")
SOUP = "systemd/package/soup.toml"
REQUIREMENT = re.compile(r"\bR-[A-Z]+-\d+\b")
NOT_BUILT = "_NOT_BUILT"


def tests_in_sources(folder):
    """Names as CTest has them, of a folder of GoogleTest sources."""
    tests = pathlib.Path(folder)
    for source in tests.glob("*_test.cpp"):
        for suite, name in re.findall(r"^TEST(?:_F)?\(\s*(\w+),\s*(\w+)", source.read_text(), re.MULTILINE):
            yield f"{suite}.{name}"


def known_tests(sources, build, ctest):
    """All names, and the test programs that are not built."""
    listed = subprocess.run([ctest, "--test-dir", str(build), "--show-only=json-v1"], capture_output=True, text=True, check=True)
    names = {test["name"] for test in json.loads(listed.stdout)["tests"]}
    absent = sorted(name.removesuffix(NOT_BUILT) for name in names if name.endswith(NOT_BUILT))
    folders = {str(path.relative_to(sources / "tests")) for path in (sources / "tests").rglob("*") if path.is_dir()}
    for folder in folders:
        if folder.replace("/", "_") + "_test" in absent:
            names |= {f"{folder}/{name}" for name in tests_in_sources(sources / "tests" / folder)}
    return names, absent


def rows_of(text):
    """(number of the line, cells) of the rows of tables whose last heading is "test"; the heading itself left out."""
    heading = None
    for number, line in enumerate(text.splitlines(), 1):
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else None
        if cells is None:
            heading = None
        elif heading is None:
            heading = cells
        elif heading[-1] == "test" and not set("".join(cells)) <= set("-: "):
            yield number, cells


def faults_of_tables(name, text, known):
    rows = list(rows_of(text))
    if not rows:
        yield f"{name}: no table whose last heading is test"
    for number, cells in rows:
        tests = re.findall(r"`([^`]+)`", cells[-1])
        yield from (f"{name}:{number}: there is no test {test}" for test in tests if test not in known)
        if not tests and "**none**" not in cells[-1]:
            yield f"{name}:{number}: names no test and does not say **none**"


def faults_of_requirements(name, text):
    stated = [found for _, cells in rows_of(text) for found in REQUIREMENT.findall(" ".join(cells[:-1]))]
    yield from (f"{name}: {one} is stated {stated.count(one)} times" for one in sorted(set(stated)) if stated.count(one) > 1)
    yield from (f"{name}: {one} is mentioned and stated nowhere" for one in sorted(set(REQUIREMENT.findall(text)) - set(stated)))


def faults_of_soup(name, entries, known):
    for entry in entries:
        for anomaly in entry.get("anomaly", ()):
            test = anomaly.get("test")
            if test is not None and test not in known:
                yield f"{name}: {entry['title']}: there is no test {test}"


def self_test():
    known = {"a/Good.Test"}
    table = "| R-A-1 x | test |\n|---|---|\n".replace("R-A-1 x", "what")
    good = table + "| R-A-1 | `a/Good.Test` |\n| R-A-2 | **none** |\n"
    wrong = (table + "| R-A-1 | `a/Bad.Test` |\n", table + "| R-A-1 | nothing |\n", "no table",
             table + "| R-A-1 | **none** |\n| R-A-1 | **none** |\n", good + "\nSee R-A-3.\n")
    faults = [[*faults_of_tables("good", text, known), *faults_of_requirements("good", text)] for text in (good, *wrong)]
    soup = list(faults_of_soup("soup", [{"title": "a", "anomaly": [{"test": "a/Bad.Test"}]}], known))
    if faults[0] or not all(faults[1:]) or not soup:
        print(f"FAILED: {faults} {soup}")
        return 1
    print(f"all of {len(wrong) + 1} wrong documents were found")
    return 0


def main():
    if sys.argv[1] == "--self-test":
        return self_test()
    sources, build, ctest = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
    known, absent = known_tests(sources, build, ctest)
    if absent:
        print(f"read from their sources, as they are not built: {' '.join(absent)}")
    faults, counts = [], []
    for name in DOCUMENTS:
        text = (sources / name).read_text()
        faults += [*faults_of_tables(name, text, known), *faults_of_requirements(name, text)]
        counts.append(f"{name} {len(list(rows_of(text)))} rows")
    with open(sources / SOUP, "rb") as file:
        faults += faults_of_soup(SOUP, tomllib.load(file)["soup"], known)
    print("\n".join(faults) if faults else f"{'; '.join(counts)}; {len(known)} tests are known")
    return 1 if faults else 0


sys.exit(main())
