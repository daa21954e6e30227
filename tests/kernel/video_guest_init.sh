#!/bin/bash
# The first process of a guest (video_guest.py) on this machine's root: file systems, the video device, then the test. Never returns.
export PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp LANG=C.UTF-8

finish() {
  echo "$1" >/mnt/exit_code
  sync
  echo b >/proc/sysrq-trigger  # QEMU was told not to boot again
  sleep 60
}

mount -t proc none /proc
mount -t sysfs none /sys
# The root of the machine is read only, and what runs there is not to be seen.
# A tree that lies there stays to be seen: the topmost folder that has it.
mkdir -p /dev/shm /dev/pts /dev/kept
hide() {  # FOLDER
  local path kept=()
  for path in "$TUBED_TESTS" "$TUBED_PROGRAMS" ${TUBED_MODULES//,/ }; do
    [[ $path == "$1"/* ]] && path=${path#"$1"/} && kept+=("${path%%/*}")
  done
  [ ${#kept[@]} -eq 0 ] || mount --bind "$1/${kept[0]}" /dev/kept
  mount -t tmpfs none "$1"
  [ ${#kept[@]} -eq 0 ] || { mkdir "$1/${kept[0]}" && mount --move /dev/kept "$1/${kept[0]}"; }
}
hide /tmp
hide /run
mount -t tmpfs none /dev/shm
mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 out /mnt
exec >/mnt/output 2>&1 </dev/null
chmod 1777 /tmp /dev/shm
cd /tmp || finish 1
mkdir -p run && mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144 run run 2>/dev/null  # where there is one

# One device: a capture node with one HDMI input, and an output node whose pictures it may show.
IFS=, read -r -a modules <<<"$TUBED_MODULES"
for module in "${modules[@]}"; do
  options=
  [[ $module != */vivid.ko* ]] || options="n_devs=1 node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 output_types=1"
  insmod "$module" $options || { echo "no module $module for kernel $(uname -r)"; finish 1; }
done
[ -c /dev/video0 ] && [ -c /dev/video1 ] || { echo "no video devices: $(ls /dev)"; finish 1; }
ip link set lo up

# Every instruction is emulated.
export TUBED_TIME_FACTOR=10
export TUBED_TEST_IN_NAMESPACE=1 TUBED_KERNEL_GUEST=1 PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$TUBED_TESTS/system
IFS=, read -r -a test <<<"$TUBED_TEST"
case ${test[0]} in
  *.py) python3 "$TUBED_TESTS/kernel/${test[0]}" "$TUBED_PROGRAMS" "${test[@]:1}" ;;
  *) "$TUBED_PROGRAMS/${test[0]}" "${test[@]:1}" ;;
esac
finish $?
