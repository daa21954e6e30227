#!/bin/sh
# Fuzzes one target that build_targets.sh has built, with libFuzzer: fuzz.sh SOURCE_FOLDER BUILD_FOLDER TARGET SECONDS.
# Each run starts from the kept corpus and from what earlier runs of this build folder found. What crashes stays in
# BUILD_FOLDER/TARGET/crash-*; copy it to tests/fuzz/corpus/TARGET once it is mended.
set -eu
source=$(realpath "$1") build=$(realpath -m "$2") target=$3 seconds=$4
[ -x "$build/bin/fuzz_$target" ] || { echo "SKIPPED: fuzz_$target was not built, see the test fuzz/build"; exit 77; }
mkdir -p "$build/$target/found" && cd "$build/$target"
# Memory is bounded: no small input makes a large allocation, nor many small ones.
# A short quarantine: the peak memory that is printed is the target's own.
export ASAN_OPTIONS=quarantine_size_mb=16 UBSAN_OPTIONS=print_stacktrace=1
exec nice -n 5 "$build/bin/fuzz_$target" -max_total_time="$seconds" -max_len=4096 -timeout=10 -rss_limit_mb=1024 -malloc_limit_mb=640 \
  -print_final_stats=1 -verbosity=0 found "$source/tests/fuzz/corpus/$target"
