#!/bin/sh
# Runs our publisher and the other vendor's subscriber in a network of their own.
# Usage: interop_test.sh FOLDER_OF_PROGRAMS "MISSING PACKAGES"
set -u
if [ -n "$2" ]; then
  echo "SKIPPED: no second DDS vendor to read us; apt-get install $2, then configure again"
  exit 77
fi
if [ "${TUBED_TEST_IN_NAMESPACE:-}" != 1 ]; then
  if ! unshare -n -m -i true 2>/dev/null; then
    echo "SKIPPED: no network namespace of its own; run as root"
    exit 77
  fi
  TUBED_TEST_IN_NAMESPACE=1 exec unshare -n -m -i "$0" "$1" ""
fi
ip link set lo up
mount -t tmpfs tmpfs /dev/shm  # Fast DDS leaves files there
"$1/distinct_publisher" &
publisher=$!
"$1/fastdds_subscriber"
result=$?
kill "$publisher" 2>/dev/null
wait "$publisher" 2>/dev/null
exit "$result"
