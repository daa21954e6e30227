#!/bin/sh
# Runs our publisher and the other vendor's subscriber in a network of their own.
# Usage: interop_test.sh FOLDER_OF_PROGRAMS "MISSING PACKAGES" [secured]
#   secured: with DDS Security, then the other vendor with the keys of another room, who must read nothing
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
  TUBED_TEST_IN_NAMESPACE=1 exec unshare -n -m -i "$0" "$1" "" ${3+"$3"}
fi
ip link set lo up
mount -t tmpfs tmpfs /dev/shm  # Fast DDS leaves files there
rooms=
if [ "${3:-}" = secured ]; then
  rooms=$(mktemp -d)
  "$1/tubectl" keys make-room "$rooms/own" --days 1 >/dev/null && "$1/tubectl" keys make-room "$rooms/other" --days 1 >/dev/null || exit 1
fi
"$1/distinct_publisher" ${rooms:+"$rooms/own/daemon"} &
publisher=$!
"$1/fastdds_subscriber" ${rooms:+"$rooms/own/subscriber"} 2>/dev/null
result=$?
if [ -n "$rooms" ]; then
  # It gives up after 15 s a topic: the first is enough.
  stranger=$(timeout 20 "$1/fastdds_subscriber" "$rooms/other/subscriber" 2>/dev/null)
  echo "with the keys of another room: $stranger"
  case "$stranger" in
    *right*|*WRONG*) echo "a stranger read what is published"; result=1 ;;
    *"NOTHING RECEIVED: TubeEstimate"*) ;;
    *) echo "the stranger did not listen"; result=1 ;;
  esac
  rm -rf "$rooms"
fi
kill "$publisher" 2>/dev/null
wait "$publisher" 2>/dev/null
exit "$result"
