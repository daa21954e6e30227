"""Daemons that die or hang: what the subscriber is told, when, and that nothing old reaches it afterwards."""
import signal
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
    check_timing(len(first_second) <= 32, f"a burst: {len(first_second)} samples in the first second after the stop")
    check_timing(len(first_second) >= 25, f"only {len(first_second)} samples in the first second after the stop")
    return stopped_ns, continued_ns


if __name__ == "__main__":
    beds.main(a_killed_daemon_is_missed_and_valid_again_after_its_restart,
              a_hung_daemon_is_missed_and_sends_nothing_old_afterwards)
