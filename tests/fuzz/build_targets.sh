#!/bin/sh
# Builds all fuzz targets with clang and sanitizers of their own, whatever the rest is built with:
# build_targets.sh SOURCE_FOLDER BUILD_FOLDER. Skips (77) where clang or its run-time library is not installed.
set -eu
source=$1 build=$2
for CXX in clang++-14 clang++ ""; do
  command -v "${CXX:-true}" >/dev/null && break
done
if [ -z "$CXX" ]; then
  echo "SKIPPED: no clang++: apt-get install clang-14 libclang-rt-14-dev"
  exit 77
fi
mkdir -p "$build"
exec 9>"$build/lock" && flock 9
echo 'extern "C" int LLVMFuzzerTestOneInput(const unsigned char*, unsigned long) { return 0; }' >"$build/probe.cpp"
if ! "$CXX" -fsanitize=fuzzer,address,undefined "$build/probe.cpp" -o "$build/probe" >"$build/probe.log" 2>&1; then
  echo "SKIPPED: $CXX cannot link a fuzzer: apt-get install libclang-rt-14-dev"
  exit 77
fi
cmake -D CMAKE_DISABLE_PRECOMPILE_HEADERS=ON -S "$source" -B "$build" -G Ninja -DCMAKE_CXX_COMPILER="$CXX" -DCMAKE_C_COMPILER="$(echo "$CXX" | sed 's/++//')" \
  -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS="-O1 -g1" -DCMAKE_C_FLAGS="-O1 -g1" \
  -DTUBED_FUZZ=ON -DTUBED_TESTS=OFF -DTUBED_BENCH=OFF -DTUBED_SANITIZE="fuzzer-no-link,address,undefined" \
  >"$build/cmake.log" 2>&1 || { cat "$build/cmake.log"; exit 1; }
exec ninja -C "$build" -j 2 fuzz_targets
