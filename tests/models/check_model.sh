#!/usr/bin/env bash
# check_model.sh MODEL.pml CONTROL...: the model must pass, and with each CONTROL defined it must fail.
set -euo pipefail
command -v spin >/dev/null || { echo "SKIPPED: needs the Debian package 'spin'"; exit 77; }
model=$(realpath "$1"); shift
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
verify() {  # prints spin's error count
  spin -a "$@" "$model" >/dev/null
  cc -O2 -DSAFETY -DCOLLAPSE -w -o pan pan.c
  ./pan -m1000000 | tee pan.out | sed -n 's/.*errors: \([0-9]*\).*/\1/p'
}
errors=$(verify)
grep -E 'states, stored|max search depth' pan.out
[ "$errors" = 0 ] || { echo "FAILED: the model has an error"; ./pan -r 2>/dev/null | tail -20; exit 1; }
echo "passes: $(basename "$model")"
for control in "$@"; do
  errors=$(verify "-D$control")
  [ "$errors" != 0 ] || { echo "FAILED: nothing found with $control; the model proves nothing"; exit 1; }
  echo "fails as it must: $control"
done
