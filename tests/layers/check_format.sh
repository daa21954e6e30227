#!/bin/sh
# Are all tracked sources formatted as .clang-format says? Exit 77 (skipped) when the tool is missing.
# usage: check_format.sh ROOT
cd "$1" || exit 1
if ! command -v clang-format >/dev/null 2>&1; then
  echo "SKIPPED: clang-format is missing, the format was NOT checked. Install the Debian package clang-format."
  exit 77
fi
# Outside a git work tree (a release archive) every source of the folders counts as tracked.
if git rev-parse --is-inside-work-tree >/dev/null 2>&1; then
  files=$(git ls-files '*.cpp' '*.hpp' '*.c' '*.h')
else
  files=$(find daemon drivers idl clients tests bench -name '*.cpp' -o -name '*.hpp' -o -name '*.c' -o -name '*.h')
fi
existing=$(for file in $files; do if [ -f "$file" ]; then echo "$file"; fi; done)
if [ -z "$existing" ]; then
  echo "no source files under $1: is it the project's root?"
  exit 1
fi
# shellcheck disable=SC2086  # no file name of the tree has a blank
clang-format --dry-run -Werror $existing
