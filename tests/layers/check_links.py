#!/usr/bin/env python3
"""Checks that each static library is linked with the libraries of this project whose functions and variables it uses.

A library that lacks one may still link: another one that the program needs brings the missing object along, by the order on the
command line, or because many files were compiled together (cmake/compile_together.cmake). It then fails with other options.

  check_links.py LIBRARIES       LIBRARIES has a line for each library, "name|file|what it is linked with, separated by semicolons";
                                 prints one line a missing link and exits 1, or 0 when there is none
  check_links.py --self-test     finds what is missing in a small set of libraries
"""
import re
import subprocess
import sys
from pathlib import Path

OWN = re.compile(r"\btubed::|^tubed_")


class Library:
    def __init__(self, links, defined, undefined):
        self.links = links  # names
        self.defined = defined
        self.undefined = undefined


def symbols_of(file):
    """(defined, undefined), demangled, of this project alone."""
    listed = subprocess.run(["nm", "--demangle", "--extern-only", "--format=posix", file], capture_output=True, text=True, check=True)
    defined, undefined = set(), set()
    for line in listed.stdout.splitlines():
        found = re.match(r"(.+) ([A-Za-z])(?: [0-9a-f]+){0,2}\s*$", line)
        if found and OWN.search(found[1]):
            (undefined if found[2] in "Uwv" else defined).add(found[1])
    return defined, undefined - defined


def closure(name, libraries):
    """The library and all that it is linked with, directly or not."""
    found, open_ends = {name}, [name]
    while open_ends:
        for link in libraries[open_ends.pop()].links:
            if link in libraries and link not in found:
                found.add(link)
                open_ends.append(link)
    return found


def missing_links(libraries):
    """[(library, symbol, where it is)], the first symbol of each pair of libraries."""
    home = {}
    for name, library in libraries.items():
        for symbol in library.defined:
            home.setdefault(symbol, set()).add(name)
    missing = {}
    for name, library in libraries.items():
        linked = closure(name, libraries)
        for symbol in sorted(library.undefined):
            homes = home.get(symbol, set())
            if homes and not homes & linked:
                missing.setdefault((name, min(homes)), symbol)
    return [(name, symbol, where) for (name, where), symbol in sorted(missing.items())]


def read(list_file):
    libraries = {}
    for line in Path(list_file).read_text().splitlines():
        name, file, links = line.split("|")
        # A library of headers has no file, and one that neither a test nor a program needs has not been built.
        symbols = symbols_of(file) if Path(file).is_file() else (set(), set())
        libraries[name] = Library({re.sub(r"^\$<LINK_ONLY:(.*)>$", r"\1", link) for link in links.split(";")}, *symbols)
    return libraries


def self_test():
    libraries = {
        "model": Library(set(), {"tubed::length()"}, set()),
        "image": Library({"model"}, {"tubed::filter()"}, {"tubed::length()"}),
        "verbs": Library({"demo"}, {"tubed::layout()"}, {"tubed::demo()", "tubed::filter()"}),
        "demo": Library({"image"}, {"tubed::demo()"}, {"tubed::layout()", "tubed::length()", "tubed::made_elsewhere()"}),
    }
    found = missing_links(libraries)
    if found != [("demo", "tubed::layout()", "verbs")]:
        print(f"found {found}")
        return 1
    print("the one missing link is found, and those over another library are none")
    return 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    libraries = read(sys.argv[1])
    missing = missing_links(libraries)
    for name, symbol, where in missing:
        print(f"{name} uses {symbol} and is not linked with {where}: target_link_libraries()")
    uses = sum(len(library.undefined) for library in libraries.values())
    print(f"{len(libraries)} libraries, {uses} uses of what they do not define")
    return 1 if missing or uses == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
