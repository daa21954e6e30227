#!/usr/bin/env python3
"""Runs a test on a kernel of its own: guest.py PROGRAMS TEST [ARGUMENT...]

A User-mode Linux guest boots with this machine's root, read only, and Debian's modules; TEST (a script of this folder, or a
program of PROGRAMS) runs in it as root and its exit code is that of this script. The guest has no network but its own, its
/tmp, /run and /dev/shm are its own, and it ends with this script. TUBED_GUEST_SECONDS: how long it may take. TUBED_GUEST_PROCESSOR=wide: as on a processor
with more registers than the guest's kernel knows.
"""
import os
import pathlib
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
MODULES = ("net/can/can.ko", "net/can/can-raw.ko", "drivers/net/can/dev/can-dev.ko", "drivers/net/can/vcan.ko", "fs/fuse/cuse.ko")
TIMEOUT_S = float(os.environ.get("TUBED_GUEST_SECONDS", "200"))
MEMORY = "512M"


def skip(why):
    print(f"SKIPPED: {why}\n         what only a kernel with CAN and CUSE shows was NOT tested", flush=True)
    sys.exit(SKIP)


def find_kernel(programs, test):
    kernel = shutil.which("linux.uml", path=os.environ.get("PATH", "") + ":/usr/bin")
    if kernel is None:
        skip("no User-mode Linux: apt-get install user-mode-linux")
    releases = [folder for folder in pathlib.Path("/usr/lib/uml/modules").glob("*") if folder.is_dir()]
    if not any(all((release / "kernel" / module).exists() for module in MODULES) for release in releases):
        skip(f"User-mode Linux without the modules {' '.join(MODULES)}: apt-get install --reinstall user-mode-linux")
    for tool, package in (("insmod", "kmod"), ("ip", "iproute2")):
        if shutil.which(tool, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin") is None:
            skip(f"no {tool}: apt-get install {package}")
    if test == "serial_break.py" and not (pathlib.Path(programs) / "cuse_aurora").exists():
        skip("the serial port in user space was not built: apt-get install libfuse3-dev, configure and build again")
    return kernel


def members_of_session(session):
    """Numbers of the processes of that session that still run."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, of_session = path.read_text().rpartition(")")[2].split()[:4]
        except (OSError, ValueError):
            continue  # it has ended meanwhile
        if int(of_session) == session and state != "Z":
            found.append(int(path.parent.name))
    return found


def end(session):
    """Whatever the guest has left, by number."""
    until = time.monotonic() + 10
    while (left := members_of_session(session)) and time.monotonic() < until:
        for number in left:
            try:
                os.kill(number, signal.SIGKILL)
            except ProcessLookupError:
                pass
        time.sleep(0.02)


def leave_nothing_behind(session):
    """Starts a process that ends the guest when this script can no longer: a guest has helpers that outlive it.

    Returns its number and what keeps it waiting; closing that, or the death of this script, sets it to work.
    """
    told, keeps_waiting = os.pipe()
    undertaker = os.fork()
    if undertaker:
        os.close(told)
        return undertaker, keeps_waiting
    os.setsid()
    os.close(keeps_waiting)
    nothing = os.open(os.devnull, os.O_RDWR)
    for descriptor in range(3):
        os.dup2(nothing, descriptor)
    os.read(told, 1)
    end(session)
    os._exit(0)


def preloaded(programs):
    """What makes the guest run on processors with more registers than it knows (whole_registers.c), and what pretends to be one."""
    names = ["libwhole_registers.so"] + (["libwide_processor.so"] if os.environ.get("TUBED_GUEST_PROCESSOR") == "wide" else [])
    return " ".join(str(programs / name) for name in names)


def boot(kernel, folder, programs, test):
    """True when the guest came to its end in time. Its words are in the folder's `console`."""
    command = [kernel, f"mem={MEMORY}", "rootfstype=hostfs", "rootflags=/", "ro", f"init={HERE / 'guest_init.sh'}", "con=null",
               "con0=null,fd:1", "con1=null,fd:1", f"uml_dir={folder}", "umid=guest", "panic=-1",
               # What is no option of the kernel becomes the environment of init.
               f"TUBED_OUT={folder}", f"TUBED_PROGRAMS={programs}", f"TUBED_TESTS={HERE.parent}", f"TUBED_TEST={','.join(test)}"]
    with open(folder / "console", "wb") as console:
        guest = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=console, stderr=console, start_new_session=True,
                                 preexec_fn=calm.die_with_parent,
                                 env=dict(os.environ, LD_PRELOAD=preloaded(programs)))
        undertaker, keeps_waiting = leave_nothing_behind(guest.pid)
        try:
            guest.wait(TIMEOUT_S)
            return True
        except subprocess.TimeoutExpired:
            return False
        finally:
            os.close(keeps_waiting)
            os.waitpid(undertaker, 0)
            guest.wait()


def attempt(kernel):
    """One guest; the exit code of the test."""
    with tempfile.TemporaryDirectory(prefix="tubed-guest-") as name:
        folder = pathlib.Path(name)
        began = time.monotonic()
        in_time = boot(kernel, folder, pathlib.Path(sys.argv[1]).resolve(), sys.argv[2:])
        console = (folder / "console").read_text(errors="replace")
        output = folder / "output"
        if output.exists():
            print(output.read_text(errors="replace"), end="")
        code = folder / "exit_code"
        if code.exists():
            print(f"(guest: {time.monotonic() - began:.1f} s)", flush=True)
            return int(code.read_text())
        if not in_time:
            print(f"FAILED: the guest was not done after {TIMEOUT_S:.0f} s; its console:\n{console[-4000:]}")
            return 1
        if "as init process" not in console:
            skip(f"User-mode Linux does not boot here (ptrace forbidden?); its console:\n{console[-2000:]}")
        print(f"FAILED: the guest ended without a word; its console:\n{console[-4000:]}")
        return 1


def main():
    if len(sys.argv) < 3:
        print(__doc__)
        sys.exit(2)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the guest is ended as well
    kernel = find_kernel(sys.argv[1], sys.argv[2])
    sys.exit(calm.judged_when_calm(lambda: attempt(kernel)))


if __name__ == "__main__":
    main()
