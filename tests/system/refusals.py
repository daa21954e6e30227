"""What the daemon refuses, and how it says so."""
import collections
import os
import pathlib
import re
import subprocess
import time

import bed as beds
from bed import check, is_fused, need_real_time, say

EXIT_UNAVAILABLE, EXIT_CONFIGURATION = 69, 78  # sysexits.h
# Root without the right to real-time scheduling: neither the capability nor the limit.
WITHOUT_RIGHT = ("setpriv", "--bounding-set=-sys_nice", "--inh-caps=-sys_nice")


def asks_for_real_time(bed, scheduling):
    return bed.simulation(head=f'[realtime]\nscheduling = "{scheduling}"\n[realtime.optimizer]\npriority = 60\n')


def need_setpriv():
    try:
        refused = subprocess.run([*WITHOUT_RIGHT, "true"], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        raise beds.Skip("no setpriv: apt-get install util-linux") from None
    if refused.returncode != 0:
        raise beds.Skip(f"setpriv cannot take a right away: {refused.stderr.strip()}")


def refused_real_time_scheduling_is_an_error_when_required(bed):
    need_setpriv()
    daemon = bed.start_daemon(asks_for_real_time(bed, "required"), prefix=WITHOUT_RIGHT, limit_rtprio=0)
    code = daemon.wait(5)
    check(code == EXIT_UNAVAILABLE, f"exit code {code}, expected {EXIT_UNAVAILABLE}: {daemon.words()}")
    line = daemon.words().splitlines()[-1]
    say(line)
    for word in ("optimizer", "SCHED_FIFO", "60", "refused", "RLIMIT_RTPRIO"):
        check(word in line, f"the last line does not say {word}: {line}")


def refused_real_time_scheduling_is_a_warning_when_optional(bed):
    need_setpriv()
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(asks_for_real_time(bed, "optional"), prefix=WITHOUT_RIGHT, limit_rtprio=0)
    subscriber.wait_for(is_fused, "VALID shape with an image", 10)
    warnings = [line for line in daemon.words().splitlines() if "SCHED_FIFO" in line]
    check(len(warnings) == 1 and " warning " in warnings[0], f"one warning expected: {warnings}")
    say(warnings[0])


def granted_real_time_scheduling_is_used(bed):
    """The counterpart: who may, gets it, with exactly that priority in exactly that thread."""
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(asks_for_real_time(bed, "required"))
    if daemon.process.poll() is not None or not comes_up(subscriber, daemon):
        check("refused" in daemon.words(), f"the daemon did not come up: {daemon.words()}")
        raise beds.Skip(f"this user may not use SCHED_FIFO here: {daemon.words().splitlines()[-1]}")
    policies = {}
    for task in pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir():
        name = (task / "comm").read_text().strip()
        fields = (task / "stat").read_text().rsplit(")", 1)[1].split()
        policies[name] = (int(fields[38]), int(fields[37]))  # policy, rt_priority: proc(5), fields 41 and 40
    say(f"{policies}")
    check(policies["optimizer"] == (1, 60), f"the optimizer's policy and priority are {policies['optimizer']}, not FIFO, 60")
    check(policies["frangi-A"][0] == 0, f"frangi-A was not asked to be real-time and is {policies['frangi-A']}")


def a_real_time_daemon_keeps_its_programs_in_memory_and_no_library_that_nobody_calls(bed):
    need_real_time()
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(asks_for_real_time(bed, "optional"))
    check(comes_up(subscriber, daemon), f"the daemon did not come up: {daemon.words()}")
    if "locking the memory refused" in daemon.words():
        raise beds.Skip("this user may not lock memory here")
    mappings = mappings_of(daemon.process.pid)
    say(f"{sum(m.resident_kb for m in mappings) / 1024:.0f} MB are resident")
    programs = [m for m in mappings if m.may == "r-xp" and re.search(r"/(tubed$|libc\.so|libstdc\+\+|libddsc)", m.line)]
    check(len(programs) == 4, f"where are the programs: {[m.line for m in programs]}")
    for m in programs:
        check(m.resident_kb == m.size_kb and m.locked_kb > 0, f"{m.line}: {m.resident_kb} kB of {m.size_kb} kB are resident, {m.locked_kb} kB locked")
    idle = [m for m in mappings if m.may == "r-xp" and re.search(r"/lib(lapack|openblas|gfortran|cholmod)", m.line)]
    size_kb, resident_kb = (sum(getattr(m, name) for m in idle) for name in ("size_kb", "resident_kb"))
    check(resident_kb < size_kb / 4 or not idle, f"{resident_kb} kB of {size_kb} kB that nobody calls are resident")
    stacks = [m for m in mappings if m.may == "rw-p" and m.size_kb >= 8000 and m.resident_kb > m.size_kb / 2 and len(m.line.split()) == 5]
    check(not stacks, f"stacks, or what else: {[m.line for m in stacks]}")


Mapping = collections.namedtuple("Mapping", "line may size_kb resident_kb locked_kb")


def mappings_of(pid):
    found = []
    for line in pathlib.Path(f"/proc/{pid}/smaps").read_text().splitlines():
        if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
            found.append({"line": line, "may": line.split()[1]})
        elif field := re.match(r"(Size|Rss|Locked): +(\d+) kB", line):
            found[-1][{"Size": "size_kb", "Rss": "resident_kb", "Locked": "locked_kb"}[field[1]]] = int(field[2])
    return [Mapping(**mapping) for mapping in found]


def comes_up(subscriber, daemon):
    until = time.monotonic() + 10 * beds.TIME_FACTOR
    while time.monotonic() < until and daemon.process.poll() is None:
        if any(map(is_fused, subscriber.samples())):
            return True
        time.sleep(0.05)
    return False


def an_unknown_network_interface_is_an_error(bed):
    daemon = bed.start_daemon(bed.simulation(interface="nosuch0"))
    code = daemon.wait(10)
    say(daemon.words().strip())
    check(code == EXIT_UNAVAILABLE, f"exit code {code}, expected {EXIT_UNAVAILABLE}")
    for word in ("nosuch0", "interface", "ip address"):
        check(word in daemon.words(), f"the message does not say {word!r}")


def a_missing_configuration_is_an_error(bed):
    done = subprocess.run([bed.program("tubed"), "--config", "/nowhere/tubed.toml"], capture_output=True, text=True,
                          check=False, timeout=20)
    check(done.returncode == EXIT_CONFIGURATION, f"exit code {done.returncode}, expected {EXIT_CONFIGURATION}")
    check("/nowhere/tubed.toml" in done.stderr, f"the message does not name the file: {done.stderr}")


def what_this_machine_does_not_have_is_found_by_the_check(bed):
    cases = {'group = "nosuchgroup"': ("shm.group", "no group 'nosuchgroup'"),
             f'estimates_socket = "{bed.folder}/nosuch/e.sock"': ("shm.estimates_socket", "No such file or directory"),
             f'estimates_socket = "{bed.folder}/tubed.toml/e.sock"': ("shm.estimates_socket", "is no folder"),
             f'estimates_socket = "{"e" * 100}"': ("shm.estimates_socket", "at most 107 bytes")}
    for line, (key, words) in cases.items():
        head = "" if "socket" in line else 'estimates_socket = "e.sock"\n'
        file = bed.write("tubed.toml", f"[shm]\n{head}{line}\n" + bed.simulation())
        place = f"{file}:{3 if head else 2}:"
        for option in ("--check", "--config"):
            done = subprocess.run([bed.program("tubed"), option, str(file)], capture_output=True, text=True, check=False, timeout=20)
            check(done.returncode == EXIT_CONFIGURATION, f"{option}, {line}: exit code {done.returncode}: {done.stderr}")
            check(place in done.stderr and key in done.stderr and words in done.stderr, f"{option}, {line}: {done.stderr}")
    if os.geteuid() == 0:  # who may write everywhere
        os.chmod(bed.folder, 0o755)
        file = bed.write("tubed.toml", '[shm]\nestimates_socket = "e.sock"\n' + bed.simulation())
        done = subprocess.run(["setpriv", "--reuid=65534", "--clear-groups", bed.program("tubed"), "--check", str(file)], capture_output=True,
                              text=True, check=False, timeout=20)
        check(done.returncode == EXIT_CONFIGURATION and f"{file}:2:" in done.stderr and "cannot be written by user 'nobody'" in done.stderr,
              f"as nobody: {done.returncode}, {done.stderr}")
    grabbed = bed.simulation().replace('1200],[0,0,0,1]]\ndriver = "simulation"', '1200],[0,0,0,1]]\ndriver = "image_shm"')
    file = bed.write("tubed.toml", grabbed + '[image_shm]\nuser = "nosuchuser"\n')
    done = subprocess.run([bed.program("tubed"), "--check", str(file)], capture_output=True, text=True, check=False, timeout=20)
    check(done.returncode == EXIT_CONFIGURATION and "image_shm.user: this system has no user 'nosuchuser'" in done.stderr, done.stderr)
    say(done.stderr.strip())


if __name__ == "__main__":
    beds.main(refused_real_time_scheduling_is_an_error_when_required,
              refused_real_time_scheduling_is_a_warning_when_optional, granted_real_time_scheduling_is_used,
              a_real_time_daemon_keeps_its_programs_in_memory_and_no_library_that_nobody_calls,
              an_unknown_network_interface_is_an_error, a_missing_configuration_is_an_error,
              what_this_machine_does_not_have_is_found_by_the_check)
