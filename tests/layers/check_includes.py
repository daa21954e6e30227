#!/usr/bin/env python3
"""Checks that each .cpp file reaches, over its own #include lines, the headers of this project whose types and constants it uses.

A build that compiles many files together (cmake/compile_together.cmake) does not notice when one of them lacks an #include that
another one has. This check reads the sources only: some seconds instead of a second build.

  check_includes.py [ROOT]       prints one line a missing #include (file:line: name, header) and exits 1, or 0 when there is none
  check_includes.py --self-test  makes a small tree with known omissions and demands that exactly these are reported

Types, enumerations, aliases and constants at namespace scope are looked for, and what stands in the unnamed namespace of one .cpp
file or is taken over there by "using std::chrono::seconds;" while another one uses it. A .cpp file must not have for itself a name
that a header beside it has: compiled together, the header's own use of the name is ambiguous.
"""
import functools
import re
import sys
import tempfile
from pathlib import Path

FOLDERS = ("daemon", "drivers", "idl", "clients", "bench", "tests")
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
# At the beginning of a line, where the format puts what stands in a namespace.
TYPE = re.compile(r"^(?:template <[^>]*>\s*)?(?:class|struct|union|enum class|enum struct|enum|using)\s+(?:\[\[\w+\]\]\s*)?(\w+)\b(?!;)(?!::)",
                  re.MULTILINE)
CONSTANT = re.compile(r"^(?:inline |extern |static )*(?:constexpr|const)\b[^;{=()]*?\b(k[A-Z]\w*)\s*[=\[{;]", re.MULTILINE)
# Programs of other DDS implementations: their types have the same names, and are made from the IDL while building.
FOREIGN = "tests/interop/"
# Anywhere: a nested type, a forward declaration, a template's parameter, an enumerator or a constant of a class.
DECLARED = re.compile(r"\b(?:class|struct|union|enum|using|typename)\s+(?:class\s+)?(\w+)|\b(k[A-Z]\w*)\s*(?:=|\{|\[|,$|,\s)")
# Also: what a macro of GoogleTest or Google Benchmark makes of its first argument is no use of a type.
LITERALS = re.compile(r'#include <[^>]*>|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/'
                      r"|\b(?:TEST|TEST_F|TEST_P|RC_GTEST_PROP|BENCHMARK|INSTANTIATE_TEST_SUITE_P)\(\s*\w+", re.DOTALL)
# What other .cpp files do not see, at the beginning of a line: "using std::chrono::seconds;", functions and variables.
TAKEN_OVER = re.compile(r"^\s*using\s+(?:[a-z]\w*::)+(\w+);", re.MULTILINE)
OF_FILE = re.compile(r"^(?!using |return |namespace |#)(?:[\w:<>,]+[ *&]+)+(\w+)(?=\(|\{|;|\[| =)", re.MULTILINE)
# Everything that may be a declaration: a name behind a type, in brackets (structured bindings), or initialised in a capture.
BEHIND_TYPE = re.compile(r"([\w>&*\]]+)\s+[*&]*(\w+)\s*(?=[({=;,)\[:])|[\w>][*&]+\s*(\w+)\b|[\[,]\s*(\w+)(?=[\],])|[\[,(]\s*&?(\w+) = ")
NO_TYPE = {"return", "else", "new", "throw", "case", "delete", "operator", "and", "or", "not", "co_return"}
OF_THE_SYSTEM = {"connect", "listen"}  # functions of <sys/socket.h>
PLAIN_USE = re.compile(r"(?<![\w.:])(?<!->)(?:([A-Za-z]\w*)(?=\(|\{)|(k[A-Z]\w*)\b)")
FORWARD = re.compile(r"\b(?:class|struct|union|enum|enum class)\s+(\w+)\s*;")
USE = re.compile(r"(?<![\w.:])(?<!->)((?:[a-z]\w*::)*)([A-Z]\w+|k[A-Z]\w*)\b(::)?")


def without_literals(text):
    """The text with strings, comments and names of tests blanked, its lines where they were."""
    return LITERALS.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


class Sources:
    def __init__(self, root):
        self.root = Path(root)
        self.files = {}  # path from the root: (raw text, text without literals)
        for folder in FOLDERS:
            for path in sorted((self.root / folder).rglob("*")):
                if path.suffix in (".cpp", ".hpp", ".h"):
                    text = path.read_text(errors="replace")
                    self.files[path.relative_to(self.root).as_posix()] = (text, without_literals(text))
        self.headers_of = {}  # name at namespace scope: headers that define it
        for name, (_, text) in self.files.items():
            if not name.endswith(".cpp"):
                for defined in {*TYPE.findall(text), *CONSTANT.findall(text)}:
                    self.headers_of.setdefault(defined, set()).add(name)

    def resolved(self, name, included):
        beside = (Path(name).parent / included).as_posix()
        return next((path for path in (included, beside) if path in self.files), None)

    @functools.cache
    def reached(self, name):
        """The files that this one includes, directly or not, and itself."""
        found, open_ends = {name}, [name]
        while open_ends:
            file = open_ends.pop()
            for included in INCLUDE.findall(self.files[file][0]):
                path = self.resolved(file, included)
                if path and path not in found:
                    found.add(path)
                    open_ends.append(path)
        return found

    @functools.cache
    def declared(self, name):
        """Two sets of names: what the file defines, and what it only announces."""
        text = self.files[name][1]
        return {a or b for a, b in DECLARED.findall(FORWARD.sub("", text))}, set(FORWARD.findall(text))

    @functools.cache
    def may_declare(self, name):
        """All names that this file may declare anywhere."""
        text = self.files[name][1]
        names = set(TAKEN_OVER.findall(text))
        for before, behind, *others in BEHIND_TYPE.findall(text):
            names.update({behind} if before not in NO_TYPE else set(), others)
        return names

    @functools.cache
    def own(self, name):
        """What a .cpp file defines for itself, or takes over."""
        text = self.files[name][1]
        return {*TAKEN_OVER.findall(text), *OF_FILE.findall(text), *TYPE.findall(text), *CONSTANT.findall(text)}

    def borrowed(self, name):
        """(line, name used, files beside this one that define it for themselves), the first use of each."""
        folder = Path(name).parent
        owners = {}
        for other in self.files:
            if other != name and other.endswith(".cpp") and Path(other).parent == folder:
                for owned in self.own(other):
                    owners.setdefault(owned, []).append(other)
        text = self.files[name][1]
        reached = self.reached(name)
        told = set()
        for use in PLAIN_USE.finditer(text):
            used = use[1] or use[2]
            if used not in owners or used in told or used in self.headers_of or used in OF_THE_SYSTEM:
                continue
            told.add(used)
            if not any(used in self.may_declare(file) or used in self.declared(file)[0] for file in reached):
                yield text.count("\n", 0, use.start()) + 1, used, owners[used]

    def same_names(self, name):
        """(line, name, header) for what this .cpp file has for itself under the name of something in a header beside it.

        The header cannot use its own then, where both files are compiled together: the name stands for two things."""
        folder = Path(name).parent
        beside = {file for other in self.files if other.endswith(".cpp") and Path(other).parent == folder
                  for file in self.reached(other) if Path(file).parent == folder}
        text = self.files[name][1]
        for found in (*TYPE.finditer(text), *CONSTANT.finditer(text)):
            headers = self.headers_of.get(found[1], set()) & beside
            if headers and not found[0].startswith("using "):
                yield text.count("\n", 0, found.start(1)) + 1, found[1], min(headers)

    def missing(self, name):
        """(line, name used, headers that would do), the first use of each."""
        reached = self.reached(name)
        text = self.files[name][1]
        defined, announced = (set().union(*names) for names in zip(*map(self.declared, reached)))
        told = set()
        for use in USE.finditer(text):
            scope, used, opened = use.groups()
            known = used in defined or used in announced and not opened
            headers = self.headers_of.get(used)
            foreign = re.match(r"std::|cv::|Eigen::|ceres::|testing::|CLI::|rc::|spdlog::|nlohmann::", scope)
            if not headers or foreign or known or used in told or headers & reached:
                continue
            told.add(used)
            yield text.count("\n", 0, use.start()) + 1, used, sorted(headers)


def check(root):
    sources = Sources(root)
    complaints = []
    for name in sources.files:
        if name.endswith(".cpp") and not name.startswith(FOREIGN):
            for line, used, headers in sources.missing(name):
                complaints.append(f"{name}:{line}: {used} is used, and {' or '.join(headers)} is not included")
            for line, used, files in sources.borrowed(name):
                complaints.append(f"{name}:{line}: {used} is used, which {min(files)} has for itself")
            for line, used, header in sources.same_names(name):
                complaints.append(f"{name}:{line}: {used} is used for another thing in {header}")
    return len(sources.files), complaints


def self_test():
    tree = {
        "idl/coil.hpp": "#pragma once\nnamespace tubed {\nstruct Coil {\n  int sensor;\n};\ninline constexpr int kMaxCoils = 16;\n}\n",
        "idl/tube.hpp": '#pragma once\n#include "idl/coil.hpp"\nnamespace tubed {\nclass Tube {\n  Coil coil_;\n};\n}\n',
        "daemon/direct.cpp": '#include "idl/coil.hpp"\nint f(Coil c) { return c.sensor + kMaxCoils; }\n',
        "daemon/over_another.cpp": '#include "idl/tube.hpp"\nint f(Coil c) { return kMaxCoils; }\n',
        "daemon/beside.hpp": "struct Beside {};\n",
        "daemon/beside.cpp": '#include "beside.hpp"\nBeside f();\n',
        "daemon/own.cpp": 'namespace {\nstruct Coil {};\nconstexpr int kMaxCoils = 3;\n}\nCoil f(int n = kMaxCoils);\n',
        "daemon/other_scope.cpp": "int f(other::Tube t);\nint g() { return Foreign::Coil(); }\n// a Tube\nconst char* kWords = \"Coil\";\n",
        "daemon/lacks.cpp": "\nint f(tubed::Coil c);\nint g() { return kMaxCoils; }\n",
        "idl/announced.hpp": "#pragma once\nclass Tube;\nint g(const Tube& tube);\n",
        "daemon/passes_on.cpp": '#include "idl/announced.hpp"\nint f(const Tube& tube) { return g(tube); }\n',
        "daemon/looks_in.cpp": '#include "idl/announced.hpp"\nint f() { return Tube::kMax; }\n',
        "daemon/image/has.cpp": "using std::chrono::seconds;\nnamespace {\nint half(int x) { return x / 2; }\nconstexpr int kOwn = 1;\n}\n",
        "daemon/image/borrows.cpp": "int f(int x) {\n  g(seconds(1));\n  return half(x) + kOwn;\n}\n",
        "daemon/image/has_its_own.cpp": "int f(int half) {\n  const int kOwn = half(2);\n  g(std::chrono::seconds(1), other.half(3));\n  return kOwn;\n}\n",
        "daemon/model/bench.hpp": "#pragma once\nconstexpr int kPeriod = 3;\nstruct Bench {\n  int ms = kPeriod;\n};\n",
        "daemon/model/uses_bench.cpp": '#include "bench.hpp"\nint f(Bench b) { return b.ms; }\n',
        "daemon/model/has_the_name_too.cpp": "constexpr int kPeriod = 5;\n\nint g(int x = kPeriod);\n",
        "tests/idl/tube_test.cpp": '#include "idl/coil.hpp"\nTEST(Tube, IsLong) { Coil c; Tube t; }\n',
    }
    with tempfile.TemporaryDirectory() as root:
        for name, text in tree.items():
            (Path(root) / name).parent.mkdir(parents=True, exist_ok=True)
            (Path(root) / name).write_text(text)
        found = [complaint.split(" is used")[0] for complaint in check(root)[1]]
    wanted = ["daemon/image/borrows.cpp:2: seconds", "daemon/image/borrows.cpp:3: half", "daemon/image/borrows.cpp:3: kOwn",
              "daemon/lacks.cpp:2: Coil", "daemon/lacks.cpp:3: kMaxCoils", "daemon/looks_in.cpp:2: Tube", "daemon/model/has_the_name_too.cpp:1: kPeriod",
              "daemon/other_scope.cpp:1: Tube", "tests/idl/tube_test.cpp:2: Tube"]
    if sorted(found) != wanted:
        print(f"found {sorted(found)}\nexpected {wanted}")
        return 1
    print("every omission of the small tree is reported, and nothing else")
    return 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    count, complaints = check(sys.argv[1] if len(sys.argv) > 1 else ".")
    print("\n".join(complaints) if complaints else f"{count} files, each includes what it uses of this project")
    return 1 if complaints or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
