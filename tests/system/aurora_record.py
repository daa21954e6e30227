"""tubectl aurora-record on an emulated Aurora at a pseudo-terminal: what is recorded can be checked again."""
import json
import signal
import subprocess
import time

import bed as beds
from bed import check, say


class Tracker:
    """The emulated Aurora; its port is there when this is."""

    def __init__(self, bed):
        self.port = bed.folder / "aurora"
        command = [bed.program("tubectl"), "aurora-emulator", "--link", str(self.port)]
        bed.daemons.append(beds.Daemon(command, bed.folder / "tubed-tracker.log"))
        until = time.monotonic() + 5 * beds.TIME_FACTOR
        while not self.port.exists() and time.monotonic() < until:
            time.sleep(0.005)


def lines_with(log, words):
    return [line for line in log.read_text(encoding="ascii").splitlines() if words in line]


def received(log):
    return "".join(line.split(" < ", 1)[1] for line in lines_with(log, " < "))


def a_recorded_aurora_is_judged_the_same_again(bed):
    tracker = Tracker(bed)
    log = bed.folder / "new.log"
    recorded = bed.tubectl("aurora-record", "--serial", str(tracker.port), "--output", str(log), "--seconds", "3",
                           "--anonymous", timeout_s=100)
    say(recorded.stderr)
    check(recorded.returncode == 0, f"exit code {recorded.returncode}")
    say(recorded.stdout)
    checked = bed.tubectl("aurora-record", "--check", str(log))
    check(checked.returncode == 0 and checked.stdout == recorded.stdout, f"another table:\n{checked.stdout}")
    check("A38" in checked.stdout and " not tried" in checked.stdout, "the table is not whole")
    check(log.read_text(encoding="ascii").startswith("tubed wire log 1\n"), "no wire log")
    check(len(lines_with(log, " note step: ")) >= 12, "steps are not noted")
    check("3C4B000" not in received(log), "a serial number is in an anonymous log")
    report = json.loads(bed.tubectl("aurora-record", "--check", str(log), "--json").stdout)
    verdicts = {one["id"]: one["verdict"] for one in report["assumptions"]}
    check(verdicts["A1"] == "holds" and verdicts["A37"] == "not tried", verdicts)
    # Left stopped, at 9600 baud: the next recording finds it there at once.
    again = bed.folder / "again.log"
    bed.tubectl("aurora-record", "--serial", str(tracker.port), "--output", str(again), "--seconds", "0",
                timeout_s=100)
    check("3C4B000" in received(again), "serial numbers are not kept by default")
    sent = lines_with(again, " > ")
    check("INIT:" in sent[0], sent[0])
    check(received(again).startswith("OKAYA896"), "the first INIT was not answered by OKAY")


def an_interrupted_recording_is_written_and_leaves_the_tracker_stopped(bed):
    tracker = Tracker(bed)
    log = bed.folder / "cut-short.log"
    with subprocess.Popen([bed.program("tubectl"), "aurora-record", "--serial", str(tracker.port), "--output",
                           str(log), "--seconds", "600"], stderr=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as recording:
        for line in recording.stderr:
            say(line.rstrip())
            if "measuring for" in line:
                time.sleep(2)
                recording.send_signal(signal.SIGINT)
                break
        table, words = recording.communicate(timeout=60 * beds.TIME_FACTOR)
    say(words)
    check(recording.returncode == 0, f"exit code {recording.returncode}")
    check("interrupted" in words, "it does not say that it was interrupted")
    check("A38" in table, "no table")
    sent = lines_with(log, " > ")
    check(any("TSTOP:" in line for line in sent[-4:]), sent[-4:])
    check(any("COMM:00000" in line for line in sent[-3:]), sent[-3:])
    check(bed.tubectl("aurora-record", "--check", str(log)).stdout == table, "another table")


def what_is_no_wire_log_or_no_port_is_refused_with_words(bed):
    Tracker(bed)
    whole = "tubed wire log 1\n0.000000 baud 9600\n0.100000 > INIT:E3A5\\r\n0.150000 < OKAYA896\\r\n"
    for text, code, words in ((whole, 0, "hold"), (whole[:-10], 0, "hold"), (whole[:60], 65, ":4: "),
                              ("garbage\n", 65, ":1: "), ("", 65, ":1: "),
                              (whole + "0.2 < \\xZZ\n", 65, ":5: ")):
        log = bed.folder / "some.log"
        log.write_text(text, encoding="ascii")
        done = bed.tubectl("aurora-record", "--check", str(log))
        say(f"{done.returncode}: {done.stderr.strip()}")
        check(done.returncode == code, f"{text!r}: exit code {done.returncode}")
        check(words in done.stdout + done.stderr, f"{text!r}: {done.stdout} {done.stderr}")
    missing = bed.folder / "nothing-here"
    for arguments, code, words in ((("--check", str(missing)), 69, "cannot be read"),
                                   (("--check", str(bed.folder)), 69, "cannot be read"),
                                   (("--serial", str(missing)), 69, "is not there"),
                                   (("--serial", str(bed.folder / "aurora"), "--output", str(missing / "x.log")), 69,
                                    "cannot be written"),
                                   ((), 64, "--serial"), (("--serial", "a", "--check", "b"), 64, "excludes")):
        done = bed.tubectl("aurora-record", *arguments)
        say(f"{done.returncode}: {done.stderr.strip()}")
        check(done.returncode == code, f"{arguments}: exit code {done.returncode}")
        check(words in done.stderr, f"{arguments}: {done.stderr}")


if __name__ == "__main__":
    beds.main(a_recorded_aurora_is_judged_the_same_again,
              an_interrupted_recording_is_written_and_leaves_the_tracker_stopped,
              what_is_no_wire_log_or_no_port_is_refused_with_words)
