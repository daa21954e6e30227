#!/usr/bin/env bash
# check_model.sh MODEL.pml [CONTROL...]: the model must pass, and with each CONTROL defined it must fail. A name alone is a
# control; several with commas between them are defined together; +NAME is a variant that must pass like the model itself.
set -euo pipefail
command -v spin >/dev/null || { echo "SKIPPED: needs the Debian package 'spin'"; exit 77; }
model=$(realpath "$1"); shift
work=$(mktemp -d); trap 'rm -rf "$work"' EXIT; cd "$work"
verify() {  # prints spin's error count
  spin -a "$@" "$model" >spin.out 2>&1 || { cat spin.out >&2; exit 1; }
  cc -O1 -DSAFETY -DCOLLAPSE -w -o pan pan.c
  ./pan -m1000000 >pan.out
  # Neither a search that was cut off nor a history that is too short says anything.
  if grep -qE 'search depth too small|out of memory|newest_store\[.*< *\(' pan.out; then cat pan.out >&2; exit 1; fi
  sed -n 's/.*errors: \([0-9]*\).*/\1/p' pan.out
}
must_pass() {  # WORDS DEFINE...
  local words=$1 errors; shift
  errors=$(verify "$@")
  grep -E 'states, stored|max search depth' pan.out
  [ "$errors" = 0 ] || { echo "FAILED: the model has an error"; grep pan: pan.out; ./pan -r "$(basename "$model").trail" 2>/dev/null | tail -20; exit 1; }
  echo "passes: $words"
}
must_pass "$(basename "$model")"
for control in "$@"; do
  read -ra defines <<<"$(sed 's/^+//; s/^/-D/; s/,/ -D/g' <<<"$control")"
  if [[ $control == +* ]]; then
    must_pass "$control" "${defines[@]}"
    continue
  fi
  errors=$(verify "${defines[@]}")
  [ "$errors" != 0 ] || { echo "FAILED: nothing found with $control; the model proves nothing"; exit 1; }
  echo "fails as it must: $control, $(sed -n 's/^pan:[0-9]*: \(.*\) (at depth.*/\1/p' pan.out)"
done
