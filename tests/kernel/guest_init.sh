#!/bin/bash
# The first process of a guest (guest.py): file systems, modules, a virtual bus, then the test. Never returns.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp LANG=C.UTF-8

finish() {
  echo "$1" >/run/out/exit_code
  sync
  echo o >/proc/sysrq-trigger
  sleep 60
}

mount -t proc none /proc
mount -t sysfs none /sys
mountpoint -q /dev || mount -t devtmpfs none /dev
mkdir -p /dev/pts /dev/shm
mount -t devpts none /dev/pts
# The root of the machine is read only, and what runs there is not to be seen.
for folder in /tmp /run /dev/shm; do mount -t tmpfs none "$folder"; done
mkdir /run/out /run/programs /run/tests
mount -t hostfs -o "$TUBED_OUT" none /run/out
mount -t hostfs -o "$TUBED_PROGRAMS" none /run/programs
mount -t hostfs -o "$TUBED_TESTS" none /run/tests
exec >/run/out/output 2>&1 </dev/null
chmod 1777 /tmp /dev/shm
cd /tmp || finish 1

modules=/usr/lib/uml/modules/$(uname -r)/kernel
for module in net/can/can net/can/can-raw drivers/net/can/dev/can-dev drivers/net/can/vcan fs/fuse/fuse fs/fuse/cuse; do
  insmod "$modules/$module.ko" || { echo "no module $module for kernel $(uname -r)"; finish 1; }
done
ip link set lo up
ip link add vcan0 type vcan && ip link set vcan0 mtu 72 up || { echo "no virtual CAN interface"; finish 1; }

# Nobody else is here: the beds of tests/system need no namespaces of their own.
# One CPU, and every call of the system costs several times as much.
export TUBED_TIME_FACTOR=3
export TUBED_TEST_IN_NAMESPACE=1 TUBED_KERNEL_GUEST=1 PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=/run/tests/system
IFS=, read -r -a test <<<"$TUBED_TEST"
case ${test[0]} in
  *.py) python3 "/run/tests/kernel/${test[0]}" /run/programs "${test[@]:1}" ;;
  *) "/run/programs/${test[0]}" "${test[@]:1}" ;;
esac
finish $?
