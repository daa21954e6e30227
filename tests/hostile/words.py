"""Words from outside: names, ids and reasons that begin a line, speak to the terminal, or are no UTF-8."""
import ctypes
import json
import pathlib
import re
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import bed as beds  # noqa: E402
import calm  # noqa: E402
from bed import Skip, check, need_preloading, say  # noqa: E402

HARM = b"A\n2026-01-01T00:00:00.000 error FORGED\r\x1b[2J\xff\xc3"
# What no terminal and no reader of lines may get: controls of seven and eight bits, overrides, separators.
FORBIDDEN = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff]")


def judged(name, octets, as_json=False):
    """Checks what a program printed, and hands it back as text."""
    try:
        text = octets.decode()
    except UnicodeDecodeError as error:
        raise beds.Failure(f"{name}: no UTF-8: {error}") from None
    found = FORBIDDEN.search(text)
    check(found is None, f"{name}: {found.group()!r} in {text[max(0, found.start() - 60):found.end() + 20]!r}" if found else "")
    check(not re.search("(?m)^FORGED", text), f"{name}: a line was forged:\n{text[:1000]}")
    if as_json:
        for line in text.splitlines():
            json.loads(line)
    return text


def programs(bed):
    """(name, command, whether each line is a JSON object, whether it says who the instrument is)"""
    tubectl, configuration = bed.program("tubectl"), str(bed.folder / "tubed-1.toml")
    for topic in ("estimate", "status", "identity", "health"):
        for json_flag in ((), ("--json",)):
            yield (f"echo --topic {topic} {' '.join(json_flag)}", [tubectl, "echo", "--topic", topic, "--seconds", "2", *json_flag],
                   bool(json_flag), True)
    yield "status", [tubectl, "status"], False, True
    yield "status --json", [tubectl, "status", "--json"], True, True
    yield "stat", [tubectl, "stat", "--seconds", "2"], False, True
    yield "stat --json", [tubectl, "stat", "--seconds", "2", "--json"], False, True
    yield "top", [tubectl, "top", "--count", "4"], False, True
    yield "latency", [tubectl, "latency", "--seconds", "2"], False, False
    yield "doctor", [tubectl, "doctor", "-c", configuration], False, False
    yield "tubed-exporter", [bed.program("tubed-exporter"), "--once"], False, True


def no_text_of_an_invented_instrument_forges_a_line_or_breaks_a_program(bed):
    bed.tracked()
    forger = subprocess.Popen([bed.program("forger"), "", "words", "120"], stdout=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(forger.kill)
    time.sleep(1)
    count = 0
    for name, command, is_json, says_who in programs(bed):
        done = subprocess.run(command, capture_output=True, check=False, timeout=60 * beds.TIME_FACTOR)
        check(done.returncode in (0, 1), f"{name} ends with {done.returncode}: {done.stderr[-1000:]!r}")
        text = judged(name, done.stdout, is_json)
        judged(f"{name}, standard error", done.stderr)
        check(not says_who or "evil\ufffdFORGED" in text, f"{name} does not show the instrument: {text[:1000]!r}")
        count += 1
    check(forger.poll() is None, "the forger has ended too early")
    judged("the daemon's log", bed.daemons[0].log.read_bytes())
    say(f"{count} programs shown an instrument whose every text is harm; none forged a line or broke")


class WriterSettings(ctypes.Structure):
    _fields_ = [("socket", ctypes.c_char_p), ("camera", ctypes.c_char_p), ("max_width", ctypes.c_uint32),
                ("max_height", ctypes.c_uint32), ("max_depth_bits", ctypes.c_uint32), ("group", ctypes.c_int64)]


def a_grabbers_name_forges_no_line_of_the_log(bed):
    need_preloading()
    found = list(bed.programs.parent.rglob("libtubed_shm.so*"))
    if not found:
        raise Skip("no libtubed_shm.so: build it first")
    library = ctypes.CDLL(str(found[0]))
    library.tubed_image_writer_open.restype = ctypes.c_void_p
    why = ctypes.create_string_buffer(300)
    settings = WriterSettings(str(bed.folder / "A.sock").encode(), HARM, 400, 600, 8, -1)
    writer = library.tubed_image_writer_open(ctypes.byref(settings), why, 300)
    check(writer, f"no writer: {why.value!r}")
    subscriber = bed.subscribe("--topic", "status")
    configuration = bed.simulation().replace("[0,0,0,1]]\ndriver = \"simulation\"\n\n[[instrument",
                                             f"[0,0,0,1]]\ndriver = \"image_shm\"\ndevice = \"{bed.folder}/A.sock\"\n\n[[instrument")
    check("image_shm" in configuration, "the bed's configuration is another than this scenario knows")
    daemon = bed.start_daemon(configuration)
    ends = time.monotonic() + 5 * beds.TIME_FACTOR
    while time.monotonic() < ends:
        library.tubed_image_writer_beat(ctypes.c_void_p(writer))
        time.sleep(0.05)
    log = judged("the log", daemon.log.read_bytes())
    check(not re.search("(?m)^2026-01-01T00:00:00.000 error FORGED", log), f"a line was forged:\n{log}")
    line = next((line for line in log.splitlines() if "grabs camera" in line), "")
    check("grabs camera 'A\ufffd2026-01-01T00:00:00.000 error FORGED\ufffd\ufffd[2J\ufffd\ufffd'" in line, f"the log does not say who grabs: {log}")
    whys = [stage["why"] for stage in subscriber.samples()[-1]["stages"]]
    check(any("grabs camera" in why for why in whys), f"TubeStatus does not say who grabs: {whys}")
    say(line)


if __name__ == "__main__":
    beds.main(no_text_of_an_invented_instrument_forges_a_line_or_breaks_a_program, a_grabbers_name_forges_no_line_of_the_log)
