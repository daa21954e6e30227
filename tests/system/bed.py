"""The test bed of the system tests: real processes in a network of their own.

A scenario is a function that takes a Bed. run_scenario() calls the one named on the command line, inside namespaces
in which nobody else exists: a loopback interface, a private /dev/shm, /tmp and /run. Whatever the bed started ends with it.
"""
import collections
import contextlib
import fcntl
import functools
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import traceback

import calm
import own_namespace

SKIP = 77  # SKIP_RETURN_CODE of these tests

# How much slower than a release build the programs are: sanitizers.
TIME_FACTOR = float(os.environ.get("TUBED_TIME_FACTOR", "1"))
# So that slower programs keep up, their images are smaller.
IMAGE_SCALE = 1 if TIME_FACTOR == 1 else 0.5

# Names of the reasons (TubeEstimate.reason_names) that every simulated or replayed sample carries.
ORIGINS = {"DEMO_DATA", "REPLAY_DATA"}


class Failure(Exception):
    """What was expected and what came instead."""


class Skip(Exception):
    """What is missing on this machine, and how to get it."""


def check(condition, message):
    if not condition:
        raise Failure(message)


def check_timing(condition, message):
    """A check of a rate, a count in a time or resident memory: with a sanitizer, which makes all threads late and keeps
    what was freed, it is only printed."""
    if TIME_FACTOR == 1:
        check(condition, message)
    elif not condition:
        say(f"not judged in a build with a sanitizer: {message}")


def need_real_time():
    if TIME_FACTOR != 1:
        raise Skip("its figures mean nothing in a build with a sanitizer; run it in a release build")


def need_preloading():
    """A library in front of the daemon (LD_PRELOAD); a sanitizer's has to be the first itself."""
    if TIME_FACTOR != 1:
        raise Skip("a library in front of a sanitizer's")


def say(message):
    print(message, flush=True)


def milliseconds(ns):
    return ns / 1e6


def threads_of(pid):
    """What each thread waits for, a line each: for the message of a failure."""
    lines = []
    for task in sorted(pathlib.Path(f"/proc/{pid}/task").glob("*"), key=lambda path: int(path.name)):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            state = (task / "stat").read_text().rpartition(")")[2].split()[0]
            calls = re.findall(r"\] (\w+)", (task / "stack").read_text())
            lines.append(f"    {(task / 'comm').read_text().strip()}: {state}, in {' < '.join(calls[:12]) or '-'}")
    return "\n".join(lines)


class Daemon:
    """A running tubed; its log is kept for the message of a failure."""

    def __init__(self, command, log, limit_rtprio=None):
        self.log = log
        self.command = command

        def before_exec():
            calm.die_with_parent()
            if limit_rtprio is not None:
                resource.setrlimit(resource.RLIMIT_RTPRIO, (limit_rtprio, limit_rtprio))

        with open(log, "ab") as sink:
            self.started_ns = time.monotonic_ns()
            self.process = subprocess.Popen(command, stdout=sink, stderr=sink, stdin=subprocess.DEVNULL,
                                            preexec_fn=before_exec)

    def signal(self, number):
        """Sends a signal; the CLOCK_MONOTONIC (ns) just before."""
        now_ns = time.monotonic_ns()
        os.kill(self.process.pid, number)
        return now_ns

    def wait(self, timeout_s):
        """The exit code; a failure when it is still running after so long."""
        try:
            return self.process.wait(timeout_s * TIME_FACTOR)
        except subprocess.TimeoutExpired:
            raise Failure(f"tubed (pid {self.process.pid}) still runs after {timeout_s * TIME_FACTOR:.1f} s") from None

    def words(self):
        return self.log.read_text(errors="replace")

    def stop(self):
        """Ends it if it still runs; then the exit code that a stopped daemon has."""
        if self.process.poll() is not None:
            return 0
        os.kill(self.process.pid, signal.SIGCONT)
        self.process.terminate()
        try:
            return self.process.wait(5 * TIME_FACTOR)
        except subprocess.TimeoutExpired:
            say(f"{self.log.name}: asked to end, it still runs after {5 * TIME_FACTOR:.0f} s; its threads:\n"
                f"{threads_of(self.process.pid)}")
            self.process.kill()
            return self.process.wait()


Line = collections.namedtuple("Line", "read_ns json")  # read_ns: CLOCK_MONOTONIC at which this process had the line


class Subscriber:
    """A tubectl echo --json, read line by line."""

    def __init__(self, command, errors):
        self.errors = errors
        with open(errors, "ab") as sink:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=sink, stdin=subprocess.DEVNULL,
                                            preexec_fn=calm.die_with_parent)
        # A line has 40 kB: a test that is busy, or that others keep from the processor, does not hold the subscriber up.
        fcntl.fcntl(self.process.stdout, fcntl.F_SETPIPE_SZ, 1 << 20)
        self._lines = []
        self._changed = threading.Condition()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for text in self.process.stdout:
            if not text.endswith(b"\n"):
                return  # it was ended in the middle of a line
            line = Line(time.monotonic_ns(), json.loads(text))
            with self._changed:
                self._lines.append(line)
                self._changed.notify_all()

    def lines(self, since_ns=0):
        """All lines read at or after `since_ns`, samples and events."""
        with self._changed:
            return [line for line in self._lines if line.read_ns >= since_ns]

    def samples(self, since_ns=0, instrument=None):
        """The samples among them, as dictionaries."""
        return [line.json for line in self.lines(since_ns) if "event" not in line.json
                and instrument in (None, line.json["instrument_id"])]

    def events(self, since_ns=0):
        return [line for line in self.lines(since_ns) if "event" in line.json]

    def wait_for(self, wanted, what, timeout_s, since_ns=0):
        """The first line read at or after `since_ns` for whose JSON `wanted` is true."""
        until = time.monotonic() + timeout_s * TIME_FACTOR
        seen = 0
        with self._changed:
            while True:
                for line in self._lines[seen:]:
                    if line.read_ns >= since_ns and wanted(line.json):
                        return line
                seen = len(self._lines)
                left = until - time.monotonic()
                if left <= 0:
                    newest = json.dumps(shortened(self._lines[-1].json)) if self._lines else "nothing"
                    raise Failure(f"no {what} within {timeout_s * TIME_FACTOR:.1f} s; the subscriber's newest of "
                                  f"{len(self._lines)} lines: {newest}")
                self._changed.wait(left)

    def forget(self):
        """Lets go of what has been read: for long tests."""
        with self._changed:
            self._lines.clear()

    def stop(self):
        if self.process.poll() is None:
            os.kill(self.process.pid, signal.SIGCONT)  # what a test has stopped does not end
            self.process.terminate()
            self.process.wait()
        self._reader.join(2)


def shortened(sample):
    """A sample without its long lists, for a message."""
    return {key: value for key, value in sample.items() if not isinstance(value, (list, dict))}


def reasons_of(sample):
    """Names of the reasons, without those of simulated and replayed data."""
    return set(sample["reason_names"].split("|")) - ORIGINS - {"-"}


def is_valid(sample):
    return sample.get("validity_name") == "VALID"


def is_fused(sample):
    return is_valid(sample) and sample["has_image"]


def age_when_made_ns(sample, of):
    """Of the newest measurement (`of` = "em_age_ns" or "image_age_ns") when the optimizer began; -1: never one."""
    since_valid_ns = sample["stamps"]["optimizer_started_monotonic_ns"] - sample["valid_time_monotonic_ns"]
    return -1 if sample[of] == -1 else since_valid_ns + sample[of]


def rate_hz(samples):
    """From when the subscriber took them from DDS."""
    check(len(samples) >= 2, f"{len(samples)} samples are too few for a rate")
    return (len(samples) - 1) / ((samples[-1]["received_monotonic_ns"] - samples[0]["received_monotonic_ns"]) * 1e-9)


def longest_gap_ms(samples):
    times = [sample["received_monotonic_ns"] for sample in samples]
    return max(milliseconds(b - a) for a, b in zip(times, times[1:]))


Instrument = collections.namedtuple("Instrument", "id first_sensor mode", defaults=("cath-1", 1, "filter"))


class Bed:
    """Starts daemons and subscribers, and ends them."""

    def __init__(self, programs):
        self.programs = pathlib.Path(programs)
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="tubed-system-"))
        self.daemons = []
        self.subscribers = []
        self.closing = contextlib.ExitStack()

    def program(self, name):
        path = self.programs / name
        check(os.access(path, os.X_OK), f"no program {path}: build it first")
        return str(path)

    def end_daemons(self):
        """Those that still run have to end well: a sanitizer's report of the whole run is an exit code."""
        codes = [daemon.stop() for daemon in self.daemons]
        check(not any(codes), f"asked to end, the daemons exit with {codes}, expected 0")

    def close(self):
        for subscriber in self.subscribers:
            subscriber.stop()
        for daemon in self.daemons:
            daemon.stop()
        self.closing.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    # Configurations

    def simulation(self, instruments=(Instrument(),), interface="lo", head="", simulation=""):
        """The text of a configuration: a simulated tracker and fluoroscope, and instruments with five coils each.

        `head` goes before everything else, `simulation` into the table [simulation].
        """
        text = f'{head}\n[dds]\nnetwork_interface = "{interface}"\n\n'
        text += '[em]\ndriver = "simulation"\nT_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n\n'
        # A sanitized Frangi filter takes longer than an image may be late: an image of a quarter of the pixels then, with
        # little noise, which comes again every two seconds and would be taken for a background that jumps. Looking for a
        # hook at the tip, once a second, takes it up to two seconds: a straight tip then, about which nobody is asked.
        size = IMAGE_SCALE
        text += (f'[[camera]]\nname = "A"\nwidth = {400 * size:.0f}\nheight = {600 * size:.0f}\nfx = {2000.0 * size}\n'
                 f'fy = {2000.0 * size}\ncx = {200.0 * size}\ncy = {300.0 * size}\n'
                 'T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,1200],[0,0,0,1]]\ndriver = "simulation"\n\n')
        for instrument in instruments:
            text += f'[[instrument]]\nid = "{instrument.id}"\nmode = "{instrument.mode}"\nlength_mm = 380.0\n'
            text += "" if IMAGE_SCALE == 1 else 'rest_shape = "straight"\ntrust_straight = true\n'
            for place, offset_mm in enumerate((10.0, 90.0, 170.0, 270.0, 370.0)):
                text += (f'[[instrument.coil]]\nsensor = {instrument.first_sensor + place}\n'
                         f'offset_from_tip_mm = {offset_mm}\n')
        noise = "" if IMAGE_SCALE == 1 or "cnr" in simulation else "cnr = 27.0\n"
        return text + f'\n[simulation]\ncontrol_folder = "{self.folder}"\n{noise}{simulation}\n'

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    # Processes

    def start_daemon(self, configuration=None, prefix=(), limit_rtprio=None):
        """A tubed with that configuration text, by default one simulated instrument."""
        number = len(self.daemons) + 1
        file = self.write(f"tubed-{number}.toml", configuration or self.simulation())
        daemon = Daemon([*prefix, self.program("tubed"), "--config", str(file)], self.folder / f"tubed-{number}.log",
                        limit_rtprio)
        self.daemons.append(daemon)
        return daemon

    def subscribe(self, *arguments, prefix=()):
        """A tubectl echo --json with these further arguments."""
        command = [*prefix, self.program("tubectl"), "echo", "--json", *arguments]
        subscriber = Subscriber(command, self.folder / f"echo-{len(self.subscribers) + 1}.err")
        self.subscribers.append(subscriber)
        return subscriber

    def tubectl(self, *arguments, timeout_s=60):
        """Runs tubectl to its end: completed process with text."""
        return subprocess.run([self.program("tubectl"), *arguments], capture_output=True, text=True, check=False,
                              timeout=timeout_s * TIME_FACTOR, preexec_fn=calm.die_with_parent)

    def tracked(self, configuration=None):
        """A daemon and a subscriber that has just got a VALID shape with an image."""
        subscriber = self.subscribe()
        daemon = self.start_daemon(configuration)
        subscriber.wait_for(is_fused, "VALID shape with an image", 10)
        return daemon, subscriber

    def fault(self, source, command):
        """Sends a command to a simulated source ("em", "image-A"); CLOCK_MONOTONIC (ns) just before."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
            now_ns = time.monotonic_ns()
            sender.sendto(command.encode(), str(self.folder / f"{source}.sock"))
        return now_ns

    def tails(self):
        """The last words of all processes, for the message of a failure."""
        text = ""
        for path in sorted([*self.folder.glob("tubed-*.log"), *self.folder.glob("echo-*.err")]):
            words = path.read_text(errors="replace").splitlines()[-30:]
            text += f"--- last words in {path.name}\n" + "".join(f"    {line}\n" for line in words)
        return text


def _attempt(scenario, programs):
    """Once, in a bed of its own; the exit code of the test."""
    bed = Bed(programs)
    try:
        scenario(bed)
        bed.end_daemons()
    except Skip as missing:
        say(f"SKIPPED: {missing}")
        return SKIP
    except Failure as failure:
        say(f"FAILED: {scenario.__name__.replace('_', ' ')}\n{failure}\n{bed.tails()}")
        return 1
    except Exception:
        say(f"FAILED: {scenario.__name__.replace('_', ' ')}\n{traceback.format_exc()}\n{bed.tails()}")
        return 1
    finally:
        bed.close()
    say("passed")
    return 0


def run_scenario(scenarios, programs, name, visible=()):
    """Runs the function of that name; the exit code of the test."""
    by_name = {scenario.__name__: scenario for scenario in scenarios}
    if name not in by_name:
        say(f"no scenario {name}; there are: {' '.join(by_name)}")
        return 2
    missing = own_namespace.enter([programs, __file__, *visible])
    if missing:
        say(f"SKIPPED: {missing}")
        return SKIP
    attempt = functools.partial(_attempt, by_name[name], programs)
    # A guest is watched from outside: it has one CPU, which is busy.
    return attempt() if os.environ.get("TUBED_KERNEL_GUEST") else calm.judged_when_calm(attempt)


def main(*scenarios):
    """The main program of a script of scenarios: SCRIPT FOLDER_OF_PROGRAMS SCENARIO."""
    if len(sys.argv) != 3:
        say(f"usage: {sys.argv[0]} FOLDER_OF_PROGRAMS SCENARIO\nscenarios: "
            + " ".join(scenario.__name__ for scenario in scenarios))
        sys.exit(2)
    sys.exit(run_scenario(scenarios, sys.argv[1], sys.argv[2]))
