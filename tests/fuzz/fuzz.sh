#!/bin/sh
# Fuzzes one target with libFuzzer: fuzz.sh SOURCE_FOLDER TARGET SECONDS. Builds it with clang-14 and sanitizers of
# its own, whatever the rest is built with. Skips (77) where clang or its run-time library is not installed.
# What crashes stays in the build folder's crash-*; copy it to tests/fuzz/corpus once it is mended.
set -eu
source=$1 target=$2 seconds=$3
for CXX in clang++-14 clang++ ""; do
  command -v "${CXX:-true}" >/dev/null && break
done
if [ -z "$CXX" ]; then
  echo "SKIPPED: no clang++: apt-get install clang-14 libclang-rt-14-dev"
  exit 77
fi
mkdir -p "$target" && cd "$target"
echo 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }' >probe.cpp
if ! "$CXX" -fsanitize=fuzzer,address,undefined probe.cpp -o probe >probe.log 2>&1; then
  echo "SKIPPED: $CXX cannot link a fuzzer: apt-get install libclang-rt-14-dev"
  exit 77
fi
# One target is built by one test at a time.
exec 9>lock && flock 9
"$CXX" -std=c++20 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all -I"$source" \
  -isystem /usr/include/eigen3 "$source/tests/fuzz/fuzz_$target.cpp" "$source"/drivers/aurora/*.cpp -o "fuzz_$target"
flock -u 9
mkdir -p found
exec "./fuzz_$target" -max_total_time="$seconds" -max_len=4096 -timeout=10 -rss_limit_mb=1024 -print_final_stats=1 \
  -verbosity=0 found "$source/tests/fuzz/corpus/$target"
