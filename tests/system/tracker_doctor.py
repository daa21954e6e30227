"""tubectl doctor on a tracker: an emulated Aurora at a pseudo-terminal."""
import json
import pathlib
import socket
import time

import bed as beds
from aurora_faults import Room
from bed import check, say


def findings_of(room, *options):
    done = room.bed.tubectl("doctor", "--config", str(room.file), "--json", *options)
    say(done.stderr)
    return {one["check"]: one for one in json.loads(done.stdout)}


def the_doctor_says_what_an_aurora_has(bed):
    room = Room(bed)
    room.switch_on()
    traces = bed.folder / "traces"
    traces.mkdir()
    found = findings_of(room, "--tracker", "--trace", str(traces))
    for name in ("tracker port", "tracker adapter", "tracker", "tracker handles", "coils", "positions", "tracker rate", "tracker replies",
                 "tracker line", "trace", "report"):
        check(name in found, f"nothing about {name}: {sorted(found)}")
        say(f"{name}: {found[name]['verdict']}: {found[name]['found']}")
    check("AURORA Rev 008" in found["tracker"]["found"], found["tracker"])
    check("115200 baud" in found["tracker"]["found"], found["tracker"])
    check("port 3 channel 0: sensor 5" in found["coils"]["found"], found["coils"])
    check(found["coils"]["verdict"] == "good", found["coils"])
    check("5 allocated, 5 enabled, 5 in the replies" in found["tracker handles"]["found"], found["tracker handles"])
    check(found["tracker replies"]["found"] == "BX, binary", found["tracker replies"])
    report = found["report"]["found"]
    for words in ("tubed ", "Linux", "AURORA Rev 008", "API D.001.007", "handle 0C port 3 channel 0 serial number 3C4B0003 sensor 5"):
        check(words in report, f"{words} is not in: {report}")
    for secret in (socket.gethostname(), str(bed.folder)):
        check(secret not in report, f"{secret} is in: {report}")
    log = pathlib.Path(traces / "aurora-serial-request.log").read_text(encoding="ascii")
    check(log.startswith("tubed wire log 1\n") and "> TSTART:" in log, "the trace is not one")


def the_doctor_names_a_missing_coil_and_a_missing_port(bed):
    room = Room(bed)
    absent = findings_of(room, "--tracker")
    check(absent["tracker port"]["verdict"] == "WRONG" and "is not there" in absent["tracker port"]["found"], absent)
    check("tracker" not in absent, "somebody talked through a port that is not there")
    room.switch_on()
    room.tell("unplug 2")
    found = findings_of(room, "--tracker")
    say(found["coils"]["found"])
    check(found["coils"]["verdict"] == "WRONG", found["coils"])
    check(found["coils"]["found"] == "port 2: no tool; sensor 3, 4 left out", found["coils"])


def the_doctor_waits_for_tools_that_are_read_slowly(bed):
    room = Room(bed)
    room.switch_on("--slow-pinit")
    begun = time.monotonic()
    said = room.bed.tubectl("doctor", "--config", str(room.file), "--tracker")
    say(f"{time.monotonic() - begun:.1f} s\n{said.stderr}{said.stdout[said.stdout.find('tracker port'):]}")
    check("good:   tracker: firmware" in said.stdout, said.stdout)
    check("PINIT of handle 0B, 2 of 3" in said.stderr, said.stderr)
    check("Copy this when you ask for help:\n" in said.stdout, said.stdout)


def a_missing_coil_is_told_as_long_as_it_is_missing(bed):
    room = Room(bed)
    room.switch_on()
    room.start_daemon()
    status = bed.subscribe("--topic", "status")

    def why(sample):
        return " ".join(stage["why"] for stage in sample["stages"] if stage["name"] == "em")

    room.subscriber.wait_for(beds.is_valid, "VALID shape", 10)
    out_ns = room.tell("unplug 2")
    unplugged = "port 2: the tool was unplugged; sensor 3, 4 left out"
    said = status.wait_for(lambda s: unplugged in why(s), "word of sensor 3", 3, out_ns)
    say(why(said.json))
    status.wait_for(lambda s: unplugged in why(s), "word of sensor 3 two seconds later", 4, said.read_ns + 2 * 10**9)
    in_ns = room.tell("plug 2")
    status.wait_for(lambda s: why(s) == "", "end of it", 6, in_ns)


def subscribers_learn_which_tracker_and_tools_it_is(bed):
    room = Room(bed)
    room.switch_on()
    room.start_daemon()
    identity = bed.subscribe("--topic", "identity")
    tracker = identity.wait_for(lambda s: s["tracker"]["tool_count"] == 3, "identity with three tools", 10).json["tracker"]
    say(tracker)
    check(tracker["firmware"] == "AURORA Rev 008" and tracker["api_revision"] == "D.001.007", tracker)
    check(tracker["control_unit_serial"] and tracker["field_generator"], tracker)
    check([tool["port"] for tool in tracker["tools"]] == [1, 2, 3], tracker)
    check([tool["serial_number"] for tool in tracker["tools"]] == [0x3C4B0001, 0x3C4B0002, 0x3C4B0003], tracker)
    said = [line for line in room.daemon.words().splitlines() if "tools: port 1" in line]
    say("\n".join(said))
    check(len(said) == 1 and "port 3 serial 3C4B0003" in said[0], f"the log names the tools in {len(said)} lines")


if __name__ == "__main__":
    beds.main(the_doctor_says_what_an_aurora_has, the_doctor_names_a_missing_coil_and_a_missing_port,
              the_doctor_waits_for_tools_that_are_read_slowly, a_missing_coil_is_told_as_long_as_it_is_missing,
              subscribers_learn_which_tracker_and_tools_it_is)
