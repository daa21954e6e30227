"""Somebody else publishes the same instrument: a second daemon that comes and goes, a forger."""
import os
import pathlib
import signal
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import bed as beds  # noqa: E402
import calm  # noqa: E402
from bed import check, check_timing, is_fused, milliseconds, say  # noqa: E402

TURNS = int(os.environ.get("TUBED_RIVALS", "20"))
DEAFENED = 5
AGAIN_MS = 250  # the contract: the real daemon is heard again after a rival's end


def start_of(line):
    return line["daemon_start"]


def resident_kb(process):
    return int(pathlib.Path(f"/proc/{process.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") // 1024


def forge(bed, *arguments):
    return subprocess.Popen([bed.program("forger"), "", *map(str, arguments)], stdout=subprocess.DEVNULL,
                            preexec_fn=calm.die_with_parent)


def end(daemon, turn):
    """In order and by SIGKILL in turn; CLOCK_MONOTONIC (ns) just before."""
    ended_ns = daemon.signal(signal.SIGTERM if turn % 2 else signal.SIGKILL)
    daemon.process.wait()
    return ended_ns


def a_rival_that_comes_second_is_told_and_never_shown(bed):
    _, subscriber = bed.tracked()
    real = start_of(subscriber.samples()[-1])
    gaps_ms = []
    for turn in range(TURNS):
        subscriber.forget()  # a reader that is busy with thousands of lines holds up the subscriber's pipe
        since_ns = time.monotonic_ns()
        rival = bed.start_daemon()
        seen = subscriber.wait_for(lambda line: line.get("event") == "rival writer", "rival", 10, since_ns=since_ns)
        check(f"process {rival.process.pid} " in seen.json["rival"], f"the rival's process is {rival.process.pid}: {seen.json}")
        subscriber.wait_for(lambda line: "RIVAL_WRITER" in line.get("reason_names", ""), "sample with RIVAL_WRITER", 2, since_ns=since_ns)
        ended_ns = end(rival, turn)
        subscriber.wait_for(lambda line: line.get("event") == "rival writer gone", "end of the rival", 3, since_ns=ended_ns)
        subscriber.wait_for(lambda line: is_fused(line) and "RIVAL_WRITER" not in line["reason_names"], "VALID shape without a rival", 3,
                            since_ns=ended_ns)
        samples = subscriber.samples()
        check({start_of(sample) for sample in samples} == {real}, "a rival's shape was shown")
        gaps_ms.append(beds.longest_gap_ms(samples))
    gap_ms = max(gaps_ms)
    say(f"{TURNS} rivals came and went; the longest gap between two shapes of the real daemon was {gap_ms:.0f} ms")
    check_timing(gap_ms < AGAIN_MS, f"the real daemon was not heard for {gap_ms:.0f} ms")
    words = bed.daemons[0].words()
    check("somebody else publishes cath-1 too: tubed, process " in words, "the daemon's log does not name its rival")
    check("nobody else publishes cath-1 any more" in words, "the daemon's log does not say that the rival is gone")


def a_real_daemon_is_heard_250_ms_after_the_end_of_a_rival_that_came_first(bed):
    subscriber = bed.subscribe()
    silent_ms = []
    for turn in range(TURNS):
        since_ns = time.monotonic_ns()
        rival = bed.start_daemon()
        first = subscriber.wait_for(lambda line: line.get("daemon_start"), "sample", 15, since_ns=since_ns)
        # The daemon of the turn before has ended, and this one is followed.
        real = bed.start_daemon()
        subscriber.wait_for(lambda line: line.get("event") == "rival writer", "second writer", 10, since_ns=since_ns)
        time.sleep(0.5)
        # A rival that is silent for 250 ms, as one with a sanitizer may be, hands over to the real daemon.
        check_timing({start_of(s) for s in subscriber.samples(since_ns=since_ns)} == {start_of(first.json)}, "not one writer at a time")
        ended_ns = end(rival, turn)
        again = subscriber.wait_for(lambda line: line.get("daemon_start") not in (None, start_of(first.json)), "shape of the real daemon",
                                    5, since_ns=ended_ns)
        silent_ms.append(milliseconds(again.json["received_monotonic_ns"] - ended_ns))
        real.signal(signal.SIGTERM)
        real.process.wait()
        subscriber.wait_for(lambda line: line.get("event") in ("writer gone", "liveliness lost"), "end of the real daemon", 5, since_ns=again.read_ns)
        subscriber.forget()
    say(f"heard again after {min(silent_ms):.0f} to {max(silent_ms):.0f} ms, {TURNS} times: "
        + " ".join(f"{ms:.0f}" for ms in silent_ms))
    late = [ms for ms in silent_ms if ms > AGAIN_MS]
    check_timing(not late, f"heard again later than {AGAIN_MS} ms: {late}")


def a_forged_sample_with_a_huge_number_makes_nobody_deaf(bed):
    _, subscriber = bed.tracked()
    start = start_of(subscriber.samples()[-1])
    since_ns = time.monotonic_ns()
    forger = forge(bed, "huge", "cath-1", start, 60)
    check(forger.wait(20) == 0, "the forger failed")
    time.sleep(0.5)
    samples = subscriber.samples(since_ns=since_ns)
    check(all(sample["sequence_number"] < 2**60 for sample in samples), "a forged sample was shown")
    check(any("RIVAL_WRITER" in sample["reason_names"] for sample in samples), "the daemon did not notice the forger")
    gap_ms = beds.longest_gap_ms(samples)
    say(f"60 forged samples: none shown, {len(samples)} of the daemon, longest gap {gap_ms:.0f} ms")
    check_timing(gap_ms < AGAIN_MS, f"the real daemon was not heard for {gap_ms:.0f} ms")


def packets_under_the_daemons_own_guid_deafen_nobody_for_good(bed):
    """After a heartbeat that says "numbers below 2^40 are gone" everything that the writer sends is old."""
    _, subscriber = bed.tracked()
    start = start_of(subscriber.samples()[-1])
    silent_ms = []
    for _ in range(DEAFENED):
        since_ns = time.monotonic_ns()
        forger = forge(bed, "deafen", 3)
        check(forger.wait(20) == 0, "the forger failed")
        time.sleep(4)  # the next attack meets a connection that has been heard for a while
        samples = subscriber.samples(since_ns=since_ns)
        check(samples and time.monotonic_ns() - samples[-1]["received_monotonic_ns"] < 5e8, "nothing is heard any more")
        silent_ms.append(beds.longest_gap_ms(samples))
        check(all(sample["sequence_number"] < 2**40 for sample in samples), "a forged packet was shown")
        check({start_of(sample) for sample in samples} == {start}, "another writer was shown")
    say(f"deafened {DEAFENED} times; silent for {min(silent_ms):.0f} to {max(silent_ms):.0f} ms: "
        + " ".join(f"{ms:.0f}" for ms in silent_ms))
    check(max(silent_ms) > 140, "the packets deafened nobody: nothing was tried")
    check_timing(max(silent_ms) <= AGAIN_MS, f"the daemon was not heard for {max(silent_ms):.0f} ms")


def twenty_thousand_invented_instruments_cost_bounded_memory(bed):
    _, subscriber = bed.tracked()
    time.sleep(2)
    before_kb = resident_kb(subscriber.process)
    since_ns = time.monotonic_ns()
    forger = forge(bed, "invented", 20000)
    check(forger.wait(120) == 0, "the forger failed")
    grown_kb = resident_kb(subscriber.process) - before_kb
    real = subscriber.samples(since_ns=since_ns, instrument="cath-1")
    gap_ms = beds.longest_gap_ms(real)
    say(f"20,000 invented instruments: the subscriber's resident memory grew from {before_kb} by {grown_kb} kB; "
        f"longest gap of the real instrument {gap_ms:.0f} ms")
    check_timing(grown_kb < 4096, f"the subscriber grew by {grown_kb} kB")
    check_timing(gap_ms < AGAIN_MS, f"the real daemon was not heard for {gap_ms:.0f} ms")


def answer(bed, words, *arguments):
    """What a verb that listens for a second or so answers; with a sanitizer, where two daemons fill both processors and
    little is heard in a second, it is asked until the words are in it."""
    until = time.monotonic() + (60 if beds.TIME_FACTOR > 1 else 0)
    while True:
        done = bed.tubectl(*arguments)
        if words in done.stdout or time.monotonic() > until:
            return done


def every_program_says_that_there_is_a_rival(bed):
    bed.tracked()
    configuration = str(bed.folder / "tubed-1.toml")
    one_writer = "writers of cath-1: cath-1 is published by one writer"
    check(one_writer in answer(bed, one_writer, "doctor", "-c", configuration).stdout, "the doctor does not see the one writer")
    rival = bed.start_daemon()
    time.sleep(2)
    doctor = answer(bed, "WRONG:  writers", "doctor", "-c", configuration)
    check("WRONG:  writers of cath-1: cath-1 is published by two writers (RIVAL_WRITER); one of them: tubed, process"
          in doctor.stdout, f"doctor: {doctor.stdout}")
    check(doctor.returncode == 1, f"doctor exits with {doctor.returncode}")
    status = answer(bed, "RIVAL_WRITER", "status")
    check(' rival="tubed, process ' in status.stdout and "RIVAL_WRITER" in status.stdout, f"status: {status.stdout}")
    check(status.returncode == 1, f"status exits with {status.returncode}")
    stat = answer(bed, "RIVAL_WRITER", "stat", "--seconds", "1").stdout
    check("samples of another writer of the same instrument were refused" in stat and "RIVAL_WRITER" in stat, f"stat: {stat}")
    top = answer(bed, "RIVAL: ", "top", "--count", "2").stdout
    check("RIVAL: somebody else publishes this instrument too" in top, f"top: {top}")
    echo = answer(bed, "RIVAL: ", "echo", "--seconds", "1").stdout
    check("cath-1 RIVAL: somebody else publishes it too: tubed, process" in echo, f"echo: {echo[:2000]}")
    topic = answer(bed, "RIVAL_WRITER", "echo", "--topic", "status", "--json", "--count", "1").stdout
    check("RIVAL_WRITER" in topic, f"TubeStatus: {topic}")
    rival.stop()
    time.sleep(1.5)
    check("RIVAL_WRITER" not in bed.tubectl("status").stdout, "the rival has gone, and status still has one")


if __name__ == "__main__":
    beds.main(a_rival_that_comes_second_is_told_and_never_shown,
              a_real_daemon_is_heard_250_ms_after_the_end_of_a_rival_that_came_first,
              a_forged_sample_with_a_huge_number_makes_nobody_deaf,
              packets_under_the_daemons_own_guid_deafen_nobody_for_good,
              twenty_thousand_invented_instruments_cost_bounded_memory, every_program_says_that_there_is_a_rival)
