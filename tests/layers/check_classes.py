#!/usr/bin/env python3
"""Checks that no class of the estimator has more than 15 fields or 25 methods, as its headers declare them.

Methods are all functions that a class declares or defines, constructors and overloads among them; fields are what its objects hold.
Classes within a class count for themselves. Comments do not count, nor what is static constexpr.

  check_classes.py [ROOT]       prints one line a class that is too large (file: class, fields, methods) and exits 1, or 0 when there is none
  check_classes.py --self-test  counts a class of which the numbers are known
"""
import re
import sys
from pathlib import Path

FOLDER = "daemon/estimator"
MAX_FIELDS = 15
MAX_METHODS = 25
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
CLASS = re.compile(r"(?<!enum )\b(?:class|struct)\s+(\w+)(?:\s+final)?(?:\s*:\s*[^{;(]+)?\s*\{")
ACCESS = re.compile(r"\b(?:public|private|protected)\s*:")
# What declares neither.
NEITHER = re.compile(r"(?:using|friend|enum|static constexpr|static inline constexpr|static_assert|typedef|class|struct)\b")


def statements(text, start):
    """What stands at the depth of the class whose body begins at `start`; each body in braces is "{}"."""
    found, statement, depth = [], "", 1
    for at in range(start, len(text)):
        character = text[at]
        if character == "{":
            depth += 1
            statement += "{" if depth == 2 else ""
        elif character == "}":
            depth -= 1
            if depth == 0:
                return found
            if depth == 1:
                statement += "}"
                # A function's body ends it; that of a nested class waits for its semicolon, an initialiser for what follows.
                is_within = statement.count("(") != statement.count(")") or text[at + 1:].lstrip()[:1] in (",", "{")
                if is_function(statement) and not is_within:
                    found.append(statement)
                    statement = ""
        elif depth == 1 and character == ";":
            found.append(statement)
            statement = ""
        elif depth == 1:
            statement += character
    raise ValueError("a class without an end")


def head(statement):
    """Before an initialiser or a body, without access specifiers, attributes and templates' brackets."""
    words = ACCESS.sub("", statement)
    words = re.sub(r"\[\[.*?\]\]", "", words, flags=re.DOTALL).strip()
    words = re.sub(r"operator\s*(==|!=|<=|>=|=|<|>|\(\))", "operator_", words)
    while True:
        fewer = re.sub(r"<[^<>]*>", "", words)
        if fewer == words:
            break
        words = fewer
    return re.split(r"[={]", words)[0]


def is_function(statement):
    return "(" in head(statement) and not NEITHER.match(head(statement))


def count(text, start):
    """(fields, methods) of the class whose body begins at `start`."""
    fields = methods = 0
    for statement in statements(text, start):
        words = head(statement)
        if not words.strip():
            continue
        if NEITHER.match(words):
            # A nested class with an object of it: struct { int a; } name;
            fields += 1 if re.match(r"(?:class|struct)\b", words) and re.search(r"\}\s*\w+\s*$", statement.strip()) else 0
        elif "(" in words:
            methods += 1
        else:
            fields += 1
    return fields, methods


def too_large(root):
    for path in sorted((root / FOLDER).rglob("*.hpp")):
        text = COMMENT.sub("", path.read_text(encoding="utf-8"))
        for match in CLASS.finditer(text):
            fields, methods = count(text, match.end())
            if fields > MAX_FIELDS or methods > MAX_METHODS:
                yield (f"{path.relative_to(root)}: {match[1]} has {fields} fields and {methods} methods, "
                       f"{MAX_FIELDS} and {MAX_METHODS} are the most: give what belongs together a class of its own")


KNOWN = """
class Known final : public Base<int> {
 public:
  Known() = default;                       // a method
  explicit Known(int a) : a_{a}, b_(2) {}  /* a method; */
  ~Known() override;
  Known& operator=(const Known&) = delete;
  bool operator==(const Known& other) const { return a_ == other.a_; }
  [[nodiscard]] std::function<void(int)> call() const;
  void call(std::function<int(int)> f = {}) {
    if (f) { a_ = f(1); }
  }
  struct Inner { int x = 0; std::array<int, 3> y{}; void z(); };
  using Row = std::array<float, 4>;
  static constexpr int kMost = 3;
  enum class Kind { kOne, kTwo };

 private:
  int a_ = 0;
  double b_{1};
  std::function<void(int)> done_;
  std::array<std::pair<int, int>, 4> pairs_{};
};
"""


def self_test():
    text = COMMENT.sub("", KNOWN)
    counts = {match[1]: count(text, match.end()) for match in CLASS.finditer(text)}
    expected = {"Known": (4, 7), "Inner": (2, 1)}
    if counts != expected:
        print(f"expected {expected}, found {counts}")
        return 1
    return 0


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    found = list(too_large(Path(sys.argv[1] if len(sys.argv) > 1 else ".")))
    print("\n".join(found) if found else f"{FOLDER}: no class has more than {MAX_FIELDS} fields or {MAX_METHODS} methods")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
