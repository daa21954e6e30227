"""Daemons that die or hang: what the subscriber is told, when, and that nothing old reaches it afterwards."""
import contextlib
import ctypes
import os
import pathlib
import signal
import socket
import subprocess
import time

import bed as beds
from bed import check, check_timing, is_fused, milliseconds, say

# The client library says "deadline missed" 100 ms after the newest sample and "liveliness lost" 250 ms after it. The
# contract gives 250 ms until the subscriber is told at all.
TOLD_MS = 250


def told_of_silence(subscriber, since_ns):
    """The first event at or after an instant, in time."""
    told = subscriber.wait_for(lambda line: "event" in line, "event", 2, since_ns)
    took_ms = milliseconds(told.read_ns - since_ns)
    say(f"told '{told.json['event']}' after {took_ms:.0f} ms")
    check(told.json["event"] in ("deadline missed", "liveliness lost"), f"event {told.json}")
    check_timing(took_ms <= TOLD_MS, f"the subscriber was told after {took_ms:.0f} ms, expected {TOLD_MS} ms")
    return told


def a_killed_daemon_is_missed_and_valid_again_after_its_restart(bed):
    daemon, subscriber = bed.tracked()
    time.sleep(1)
    killed_ns = daemon.signal(signal.SIGKILL)
    daemon.process.wait()
    told_of_silence(subscriber, killed_ns)
    subscriber.wait_for(lambda line: line.get("event") == "liveliness lost", "event 'liveliness lost'", 1, killed_ns)
    before = subscriber.samples()
    restarted = bed.start_daemon()
    again = subscriber.wait_for(is_fused, "VALID shape with an image", 2, restarted.started_ns)
    say(f"VALID with an image {milliseconds(again.read_ns - restarted.started_ns):.0f} ms after the restart")
    time.sleep(2)
    after = subscriber.samples(restarted.started_ns)
    check(len({sample["daemon_start"] for sample in before}) == 1, "one run of a daemon had several starts")
    check({sample["daemon_start"] for sample in after}.isdisjoint({before[0]["daemon_start"]}),
          "the restarted daemon has the start of the dead one")
    numbers = [sample["sequence_number"] for sample in after]
    check(numbers[0] < before[-1]["sequence_number"], f"numbers went on at {numbers[0]} instead of beginning anew")
    check_timing(numbers == list(range(numbers[0], numbers[0] + len(numbers))), f"numbers are missing: {numbers}")
    check_timing(not any(sample["lost_before"] for sample in after), "a restart was counted as a loss")


def a_hung_daemon_is_missed_and_sends_nothing_old_afterwards(bed):
    daemon, subscriber = bed.tracked()
    time.sleep(1)
    stopped_ns, _ = stop_and_continue(daemon, subscriber, 3)
    subscriber.wait_for(lambda line: line.get("event") == "liveliness lost", "event 'liveliness lost'", 1, stopped_ns)
    # Where in its cycle a daemon is stopped is chance: many short stops find what one long one does not.
    for stop in range(12):
        stop_and_continue(daemon, subscriber, 0.45 + stop * 0.003)


def stop_and_continue(daemon, subscriber, seconds):
    """Stops a daemon for so long; checks what the subscriber gets then."""
    real_minus_monotonic_ns = time.time_ns() - time.monotonic_ns()
    stopped_ns = daemon.signal(signal.SIGSTOP)
    told_of_silence(subscriber, stopped_ns)
    time.sleep(seconds - milliseconds(time.monotonic_ns() - stopped_ns) / 1e3)
    # What was on its way when the daemon stopped came long before this.
    continued_ns = daemon.signal(signal.SIGCONT)
    subscriber.wait_for(is_fused, "VALID shape with an image", 2, continued_ns)
    time.sleep(max(0, 1.05 - milliseconds(time.monotonic_ns() - continued_ns) / 1e3))
    after = subscriber.samples(continued_ns)
    for sample in after:
        number = sample["sequence_number"]
        valid_ms = milliseconds(sample["valid_time_monotonic_ns"] - stopped_ns)
        published_ms = milliseconds(sample["publish_time_ns"] - real_minus_monotonic_ns - stopped_ns)
        # A millisecond for the two clocks' being read one after the other.
        check(published_ms > -1, f"sample {number}, published {-published_ms:.1f} ms before the stop, came after it")
        stale = "EM_STALE" in sample["reason_names"]
        check(valid_ms > 0 or stale, f"sample {number} of {-valid_ms:.1f} ms before the stop came after it, unflagged: "
              f"{beds.shortened(sample)}")
        check(valid_ms > 0 or sample["validity_name"] in ("INVALID", "NOT_AVAILABLE"),
              f"a shape of before the stop is {sample['validity_name']}")
    first_second = [sample for sample in after if sample["received_monotonic_ns"] <= continued_ns + 1e9]
    say(f"{len(first_second)} samples in the first second after a stop of {seconds:.2f} s")
    # 30 or 31 instants, one at once, one that says EM_STALE, one that was under way; what the stop held back would be 13 and more.
    check_timing(len(first_second) <= 34, f"a burst: {len(first_second)} samples in the first second after the stop")
    check_timing(len(first_second) >= 25, f"only {len(first_second)} samples in the first second after the stop")
    return stopped_ns, continued_ns


@contextlib.contextmanager
def hung_thread(pid, name):
    """Stops this thread of a process alone, as ptrace(2) can; gives the CLOCK_MONOTONIC (ns) from which it stands still."""
    seize, interrupt, detach, wait_all = 0x4206, 0x4207, 17, 0x40000000
    tid = next(int(task.name) for task in pathlib.Path(f"/proc/{pid}/task").iterdir() if (task / "comm").read_text().strip() == name)
    libc = ctypes.CDLL(None, use_errno=True)

    def ptrace(request):
        check(libc.ptrace(request, tid, None, None) == 0, f"ptrace {request:#x}: {os.strerror(ctypes.get_errno())}")

    ptrace(seize)
    ptrace(interrupt)
    os.waitpid(tid, wait_all)
    try:
        yield time.monotonic_ns()
    finally:
        ptrace(detach)


class ServiceManager:
    """Hears what a daemon tells systemd."""

    def __init__(self, path):
        self.path = path
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(path))

    def wait_for_status(self, wanted, timeout_s):
        """The first STATUS= with all these words from now on."""
        until = time.monotonic() + timeout_s * beds.TIME_FACTOR
        while time.monotonic() < until:
            self.socket.settimeout(max(until - time.monotonic(), 0.01))
            with contextlib.suppress(TimeoutError):
                message = self.socket.recv(65536).decode()
                if message.startswith("STATUS=") and all(words in message for words in wanted):
                    return message
        raise beds.Failure(f"the service manager was not told {wanted} within {timeout_s} s")


def a_hung_optimizer_is_not_available_wherever_one_asks(bed):
    manager = ServiceManager(bed.folder / "notify.sock")
    status = bed.subscribe("--topic", "status")
    daemon = bed.start_daemon(prefix=("env", f"NOTIFY_SOCKET={manager.path}"))
    status.wait_for(lambda s: s["validity_name"] == "VALID", "VALID status", 10)
    time.sleep(1)
    for _ in range(3):
        with hung_thread(daemon.process.pid, "optimizer") as hung_ns:
            told = status.wait_for(lambda s: s["validity_name"] == "NOT_AVAILABLE", "NOT_AVAILABLE", 2, hung_ns)
            took_ms = milliseconds(told.read_ns - hung_ns)
            say(f"NOT_AVAILABLE after {took_ms:.0f} ms, {told.json['reason_names']}, age {milliseconds(told.json['estimate_age_ns']):.0f} ms")
            # 250 ms after the newest estimate, and what it takes to be read here.
            check_timing(took_ms <= TOLD_MS + 50, f"told after {took_ms:.0f} ms")
            failed = status.wait_for(lambda s: state_of(s, "optimizer") == (5, "no sign of life for 0.25 s"), "failed optimizer", 1, hung_ns)
            check_timing(milliseconds(failed.read_ns - hung_ns) <= TOLD_MS + 50, "the optimizer's silence was told late")
            say(manager.wait_for_status(("cath-1 NOT_AVAILABLE", "optimizer is failed: no sign of life for"), 1))
            metrics = exported(bed)
            for line in ('tubed_up{instrument="cath-1"} 1', 'tubed_validity{instrument="cath-1",validity="NOT_AVAILABLE"} 1',
                         'tubed_stage_state{instrument="cath-1",stage="optimizer",state="failed"} 1'):
                check(line in metrics, f"{line} is not in:\n{metrics}")
            time.sleep(max(0, 2 - milliseconds(time.monotonic_ns() - hung_ns) / 1e3))
            going_on_ns = time.monotonic_ns()
        again = status.wait_for(lambda s: s["validity_name"] == "VALID" and state_of(s, "optimizer")[0] == 1, "VALID again", 2, going_on_ns)
        say(f"VALID again after {milliseconds(again.read_ns - going_on_ns):.0f} ms")
        manager.wait_for_status(("cath-1 VALID",), 2)
        time.sleep(1)
    check('tubed_validity{instrument="cath-1",validity="VALID"} 1' in exported(bed), "the exporter does not recover")
    lines = [line for line in daemon.words().splitlines() if "optimizer is" in line]
    say("\n".join(lines))
    check(len(lines) <= 3 * 8, f"{len(lines)} lines of the optimizer in the log")


def state_of(status, stage):
    return next((one["state"], one["why"]) for one in status["stages"] if one["name"] == stage)


def exported(bed):
    """What tubed-exporter says."""
    return subprocess.run([bed.program("tubed-exporter"), "--once"], capture_output=True, text=True, check=True, timeout=10).stdout


if __name__ == "__main__":
    beds.main(a_killed_daemon_is_missed_and_valid_again_after_its_restart,
              a_hung_daemon_is_missed_and_sends_nothing_old_afterwards, a_hung_optimizer_is_not_available_wherever_one_asks)
