#!/usr/bin/env python3
"""Runs a test on a kernel with a video device: video_guest.py KERNEL PROGRAMS TEST [ARGUMENT...]

Debian's kernel boots in QEMU, without KVM, with this machine's root, read only, and its module vivid: what is written to
/dev/video1 comes out of /dev/video0. TEST (a script of this folder, or a program of PROGRAMS) runs in it as root and its exit
code is that of this script. KERNEL: where `./run tests` has unpacked a kernel; the machine's own is taken where it has one.
TUBED_GUEST_SECONDS: how long the guest may take. TUBED_GUEST_PRIORITY: its real-time priority (SCHED_FIFO), where time is what is
tested: else whatever else this machine does stops the emulated card. TUBED_GUEST_SHARE: a folder that is /tmp/run in the guest.
"""
import os
import pathlib
import platform
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import calm

SKIP = 77  # SKIP_RETURN_CODE of these tests
HERE = pathlib.Path(__file__).resolve().parent
PATIENCE_S = float(os.environ.get("TUBED_GUEST_SECONDS", "240"))
PRIORITY = int(os.environ.get("TUBED_GUEST_PRIORITY", "0"))
PATH = os.environ.get("PATH", "") + ":/usr/sbin:/sbin:/usr/bin:/bin"
ROOT_MODULES = ("virtio_pci", "9pnet_virtio", "9p")  # what it takes to see this machine's root
VIDEO_MODULES = ("vivid",)


def skip(why):
    print(f"SKIPPED: {why}\n         the driver v4l2 was NOT tested at a real video device", flush=True)
    sys.exit(SKIP)


def find_program(name, package):
    program = shutil.which(name, path=PATH)
    if program is None:
        skip(f"no {name}: apt-get install {package}")
    return program


def prepare_guest():
    """In the process that becomes QEMU."""
    calm.die_with_parent()
    if PRIORITY > 0:
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        except OSError as error:
            os.write(2, f"no real-time priority for the guest: {error}\n".encode())


class Kernel:
    """A kernel with its modules below a root."""

    def __init__(self, root, release):
        self.image = root / "boot" / f"vmlinuz-{release}"
        self.modules = {}
        for file in (root / "lib/modules" / release / "kernel").rglob("*.ko*"):
            self.modules.setdefault(file.name.split(".ko")[0].replace("-", "_"), file)

    def is_usable(self):
        return os.access(self.image, os.R_OK) and all(name in self.modules for name in ROOT_MODULES + VIDEO_MODULES)

    def in_order(self, names):
        """Files of the modules, each behind those that it needs; of those built into the kernel none."""
        modinfo = find_program("modinfo", "kmod")
        found = []

        def add(name):
            file = self.modules.get(name.replace("-", "_"))
            if file is None or file in found:
                return
            needed = subprocess.run([modinfo, "-F", "depends", file], capture_output=True, text=True, check=True).stdout
            for other in filter(None, needed.strip().split(",")):
                add(other)
            found.append(file)

        for name in names:
            add(name)
        return found


def find_kernel(unpacked):
    for root in (pathlib.Path(unpacked).resolve(), pathlib.Path("/")):
        for folder in sorted((root / "lib/modules").glob("*"), reverse=True):
            kernel = Kernel(root, folder.name)
            if kernel.is_usable():
                return kernel
    skip(f"no Linux with the modules {' '.join(ROOT_MODULES + VIDEO_MODULES)} in {unpacked} nor installed: `./run tests` unpacks Debian's "
         "linux-image-amd64 there where apt-get can download it")


def cpio(files):
    """An initial root: (name, mode, bytes) of each file, in the format newc."""
    archive = bytearray()
    for number, (name, mode, content) in enumerate([*files, ("TRAILER!!!", 0, b"")], 1):
        fields = (number, mode, 0, 0, 1, 0, len(content), 0, 0, 0, 0, len(name) + 1, 0)
        archive += b"070701" + b"".join(b"%08X" % field for field in fields) + name.encode() + b"\0"
        archive += b"\0" * (-len(archive) % 4)
        archive += content
        archive += b"\0" * (-len(archive) % 4)
    return bytes(archive)


FIRST_PROCESS = """#!/busybox sh
/busybox mount -t proc none /proc
/busybox mount -t sysfs none /sys
for module in {modules}; do /busybox insmod /$module || echo "no module $module"; done
/busybox mount -t 9p -o trans=virtio,version=9p2000.L,msize=262144,cache=loose,ro root /root || echo "no root"
/busybox mount -t devtmpfs none /root/dev
exec /busybox switch_root /root {init}
"""


def initial_root(kernel):
    files = [(name, 0o040755, b"") for name in ("proc", "sys", "root")]
    busybox = pathlib.Path(find_program("busybox", "busybox-static"))
    if b"ld-linux" in busybox.read_bytes()[:4096]:
        skip("busybox is not static: apt-get install busybox-static")
    files.append(("busybox", 0o100755, busybox.read_bytes()))
    modules = kernel.in_order(ROOT_MODULES)
    for file in modules:
        files.append((file.name, 0o100644, file.read_bytes()))
    script = FIRST_PROCESS.format(modules=" ".join(file.name for file in modules), init=HERE / "video_guest_init.sh")
    files.append(("init", 0o100755, script.encode()))
    return cpio(files)


def share(tag, path, is_read_only):
    return ["-virtfs", f"local,path={path},mount_tag={tag},security_model=none,multidevs=remap" + (",readonly=on" if is_read_only else "")]


def boot(qemu, kernel, folder, programs, test):
    """True when the guest came to its end in time. Its words are in the folder's `console`."""
    (folder / "initrd").write_bytes(initial_root(kernel))
    # What is no option of the kernel becomes the environment of init.
    options = {"TUBED_PROGRAMS": programs, "TUBED_TESTS": HERE.parent, "TUBED_TEST": ",".join(test),
               "TUBED_MODULES": ",".join(map(str, kernel.in_order(VIDEO_MODULES)))}
    words = " ".join(["console=ttyS0", "quiet", "panic=-1", *(f"{name}={value}" for name, value in options.items())])
    if len(words) > 2000:
        raise RuntimeError(f"a command line of {len(words)} characters: the kernel takes 2047")
    command = [qemu, "-accel", "tcg", "-smp", "1", "-m", "768", "-nodefaults", "-no-user-config", "-no-reboot", "-display", "none",
               "-serial", f"file:{folder / 'console'}", "-kernel", kernel.image, "-initrd", folder / "initrd", "-append", words,
               *share("root", "/", True), *share("out", folder, False),
               *(share("run", os.environ["TUBED_GUEST_SHARE"], False) if "TUBED_GUEST_SHARE" in os.environ else ())]
    with open(folder / "qemu", "wb") as sink:
        guest = subprocess.Popen(list(map(str, command)), stdin=subprocess.DEVNULL, stdout=sink, stderr=sink,
                                 preexec_fn=prepare_guest)
        try:
            guest.wait(PATIENCE_S)
            return True
        except subprocess.TimeoutExpired:
            return False
        finally:
            guest.kill()
            guest.wait()


def words_of(path):
    return path.read_text(errors="replace") if path.exists() else ""


def attempt(qemu, kernel, programs, test):
    """One guest; the exit code of the test."""
    with tempfile.TemporaryDirectory(prefix="tubed-guest-") as name:
        folder = pathlib.Path(name)
        began = time.monotonic()
        in_time = boot(qemu, kernel, folder, programs, test)
        print(words_of(folder / "output"), end="")
        code = words_of(folder / "exit_code").strip()
        if code:
            print(f"(guest: {time.monotonic() - began:.1f} s)", flush=True)
            return int(code)
        console = words_of(folder / "qemu")[-2000:] + re.sub(r"[^\n\x20-\x7e]", "", words_of(folder / "console"))[-4000:]
        reason = "ended without a word" if in_time else f"was not done after {PATIENCE_S:.0f} s"
        print(f"FAILED: the guest {reason}; its console:\n{console}")
        return 1


def main():
    if len(sys.argv) < 4:
        print(__doc__)
        sys.exit(2)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the guest is ended as well
    if platform.machine() != "x86_64":
        skip(f"a machine of kind {platform.machine()}: the guest is an x86_64")
    qemu = find_program("qemu-system-x86_64", "qemu-system-x86")
    kernel = find_kernel(sys.argv[1])
    programs = pathlib.Path(sys.argv[2]).resolve()
    sys.exit(calm.judged_when_calm(lambda: attempt(qemu, kernel, programs, sys.argv[3:])))


if __name__ == "__main__":
    main()
