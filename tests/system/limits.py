"""A daemon whose limits are too small for it says so in one line and ends with 69, at the start: no signal, no abort."""
import os
import shutil
import subprocess
import time

import bed as beds
from bed import Skip, check, is_valid, say

EXIT_UNAVAILABLE = 69  # sysexits.h
NOBODY = 65534
MIB = 1 << 20


def need_prlimit():
    if shutil.which("prlimit") is None:
        raise Skip("no prlimit: apt-get install util-linux")
    if beds.TIME_FACTOR != 1:
        raise Skip("sanitizers reserve terabytes of address space")


def loads(bed, limits):
    """Whether the program can be loaded at all: below that the loader speaks, not tubed."""
    return subprocess.run([*limits, bed.program("tubed"), "--version"], capture_output=True, check=False).returncode in (0, EXIT_UNAVAILABLE)


def runs_for(process, seconds):
    try:
        process.wait(seconds)
        return False
    except subprocess.TimeoutExpired:
        return True


def outcome(bed, limits, configuration, seconds=3.0):
    """"runs", or the exit code; what it wrote to its log."""
    log = bed.folder / "limited.log"
    with open(log, "wb") as sink:
        process = subprocess.Popen([*limits, bed.program("tubed"), "--config", str(configuration)], stdout=sink, stderr=sink,
                                   stdin=subprocess.DEVNULL)
    if runs_for(process, seconds):
        subscriber = bed.subscribe()
        try:
            subscriber.wait_for(is_valid, "VALID shape of a daemon that runs", 10)
        finally:
            subscriber.stop()
            process.terminate()
            check(process.wait(5) == 0, f"{limits}: asked to end, it exits with {process.returncode}")
        return "runs", log.read_text(errors="replace")
    return process.returncode, log.read_text(errors="replace")


def swept(bed, name, prefixes, word):
    """Every limit, from that at which the program loads to that with which it runs: one line of words and 69, or it runs."""
    configuration = bed.write("limited.toml", bed.simulation())
    os.chmod(bed.folder, 0o777)  # also for another user
    said, running = set(), 0
    for limit, prefix in prefixes:
        if not loads(bed, prefix):
            continue
        code, words = outcome(bed, prefix, configuration)
        if code == "runs":
            running += 1
            if running == 2:
                break
            continue
        running = 0
        lines = words.strip().splitlines()
        check(code == EXIT_UNAVAILABLE, f"{name} {limit}: ends with {code}, expected {EXIT_UNAVAILABLE}: {words}")
        check(len(lines) == 1 and lines[0].startswith("tubed: cannot start: "), f"{name} {limit}: {len(lines)} lines: {words}")
        check(word in words, f"{name} {limit}: does not say {word}: {words}")
        said.add(lines[0])
    check(said, f"no {name} was too small")
    check(running, f"no {name} was enough: {sorted(said)[-1]}")
    say("\n".join(sorted(said)[:3]))


def too_little_address_space_ends_in_words(bed):
    need_prlimit()
    sizes = [*range(40, 200, 20), *range(200, 1000, 50), *range(1000, 3000, 100)]
    swept(bed, "address space (MiB)", [(size, ["prlimit", f"--as={size * MIB}", "--"]) for size in sizes], "RLIMIT_AS")


def too_little_memory_for_data_ends_in_words(bed):
    need_prlimit()
    swept(bed, "data (MiB)", [(size, ["prlimit", f"--data={size * MIB}", "--"]) for size in (20, 50, 100, 200, 300, 350, 400, 500, 1000)],
          "RLIMIT_DATA")


def too_small_a_stack_ends_in_words(bed):
    need_prlimit()
    swept(bed, "stack (KiB)", [(size, ["prlimit", f"--stack={size * 1024}", "--"]) for size in (64, 128, 256, 512, 1023, 1024, 8192)],
          "RLIMIT_STACK")


def too_few_files_end_in_words(bed):
    need_prlimit()
    swept(bed, "files", [(count, ["prlimit", f"--nofile={count}", "--"]) for count in (4, 6, 8, 12, 16, 24, 32, 40, 48, 64, 256, 1024)],
          "RLIMIT_NOFILE")


def too_few_threads_end_in_words(bed):
    """Root may start as many as it likes."""
    need_prlimit()
    if os.geteuid() != 0 or shutil.which("setpriv") is None:
        raise Skip("needs root and setpriv: apt-get install util-linux")
    before = int(subprocess.run(["sh", "-c", f"ps -L -U {NOBODY} --no-headers 2>/dev/null | wc -l"], capture_output=True, text=True,
                                check=False).stdout)
    swept(bed, "threads", [(count, ["setpriv", f"--reuid={NOBODY}", "--clear-groups", "--bounding-set=-all", "--inh-caps=-all", "prlimit",
                                    f"--nproc={before + count}", "--"]) for count in (1, 2, 4, 8, 12, 16, 20, 32, 64)], "RLIMIT_NPROC")


if __name__ == "__main__":
    beds.main(too_little_address_space_ends_in_words, too_little_memory_for_data_ends_in_words, too_small_a_stack_ends_in_words, too_few_files_end_in_words,
              too_few_threads_end_in_words)
