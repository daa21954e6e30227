#!/usr/bin/env python3
"""Checks the layers of the source tree: who may include what, and where threads, atomics, clocks and logs may live.

  check_layers.py [ROOT]       prints one line a violation (file:line: [rule] what) and exits 1, or 0 when there is none
  check_layers.py --self-test  makes a small tree with one violation of every rule and demands that each is reported
"""
import re
import sys
import tempfile
from pathlib import Path

SOURCE_FOLDERS = ("daemon", "drivers", "idl", "clients")
SUFFIXES = {".cpp", ".hpp", ".c", ".h"}

# A file includes its own folder and lower rows only. The longest name that fits is a file's folder; a folder of drivers/ that is
# not named is a device.
ROWS = {
    # What a key of the configuration is: below everything that has settings.
    "idl/settings": -1,
    "idl": 0, "idl/geometry": 0, "idl/command_line": 0,
    "clients/cpp": 1, "clients/svg": 1, "clients/pictures": 1,
    "daemon/model": 1, "drivers/interface": 1,
    # Files of pictures: devices that replay them include it, and whoever draws.
    "drivers/png": 1,
    # Tables as text: sequence folders are such, and what people write by hand.
    "drivers/csv": 1,
    # The Aurora's protocol is no device: the devices that speak it (serial, CAN, emulator) include it, so that it
    # stands below them, and above the interface whose structs it fills.
    "drivers/aurora": 1.2,
    # The laboratory: what a simulated room is made of. A device (drivers/simulation) and whoever wants a true run stand above it.
    "drivers/laboratory/random": 1.2,
    "drivers/laboratory/vessel": 1.4, "drivers/laboratory/tracker": 1.4, "drivers/laboratory/fluoroscope": 1.4,
    "drivers/laboratory/aurora_emulator": 1.4,
    "drivers/laboratory/instrument": 1.6,
    "drivers/laboratory": 1.8,
    # Files of named points: tubectl registers by them, the viewer shows them.
    "clients/markers": 1.5,
    "daemon/image": 2,
    # Of the estimator's folders these two know nothing of a tube.
    "daemon/estimator/algebra": 2.5, "daemon/estimator/reference": 2.5,
    "daemon/estimator": 3,
    "daemon/pipeline": 4, "daemon/publishing": 4, "drivers/driver_registry": 4,
    "daemon/config": 5,
    "daemon": 6,
    "clients/exporter": 6, "clients/view": 6, "clients/evaluation": 6,
    "clients/calibration": 6.5, "clients/playback": 6.5,
    "clients/dicom": 6,
    "clients/tubectl": 7,
}
DEVICE_ROW = 2

ATOMIC_FILES = (r"daemon/pipeline/(triple_buffer\.hpp|spsc_ring\.hpp|doorbell\.\w+|allocation_counter\.\w+)$|idl/shm")
THREAD_FILE = r"daemon/pipeline/stage_thread\.\w+$"
CLOCK_FILES = r"drivers/|clients/|daemon/pipeline/stage_thread\.\w+$|daemon/publishing/|daemon/\w+\.\w+$"

OPENCV = r"opencv2?/"
CYCLONE = r"dds/|ddsc?/"
LOGGING = r"spdlog/"
CLOCK = r"(?:\w*[Cc]lock\w*\s*::\s*now\s*\()|\bclock_gettime\b|\bgettimeofday\b|\btime\s*\(\s*(?:nullptr|NULL|0|&\w+)\s*\)"

# (rule, files it holds for, files it does not hold for, pattern of a forbidden include, why)
INCLUDE_RULES = (
    ("model-headers", r"daemon/model/", None, rf"{OPENCV}|ceres/|{LOGGING}|chrono$|ctime$|time\.h$",
     "the model knows no OpenCV, Ceres, clock or log"),
    ("estimator-drivers", r"daemon/estimator/", None, r"drivers/(?!interface/)",
     "the estimator sees drivers/interface only"),
    ("estimator-headers", r"daemon/estimator/", None,
     rf"{CYCLONE}|{LOGGING}|(?:thread|mutex|shared_mutex|condition_variable|future)$",
     "the estimator knows no DDS, log, thread or lock"),
    ("pipeline-drivers", r"daemon/pipeline/", None, r"drivers/(?!interface/)", "the pipeline sees no concrete driver"),
    ("pipeline-headers", r"daemon/pipeline/", None, rf"{CYCLONE}|ceres/|{OPENCV}",
     "the pipeline sees no Cyclone, Ceres or OpenCV"),
    ("publishing-rooms", r"daemon/publishing/", None, r"daemon/pipeline/|drivers/",
     "publishing sees neither pipeline nor drivers"),
    ("image-drivers", r"daemon/image/", None, r"drivers/(?!interface/)", "image analysis sees drivers/interface only"),
    ("protocol-rooms", r"drivers/aurora/", None, r"(?:daemon|idl|clients)/|drivers/(?!aurora/|interface/)",
     "the protocol sees drivers/interface only"),
    ("protocol-headers", r"drivers/aurora/", None,
     r"(?:termios|unistd|fcntl|poll|time|ctime|fstream|iostream|cstdio|stdio|thread|mutex)(?:\.h)?$|sys/|linux/|net/",
     "the protocol is bytes to structs and back: no device, file, clock or thread"),
    ("below-clients", r"(?:daemon|drivers|idl)/", None, r"clients/", "nothing below the clients includes them"),
    ("client-rooms", r"clients/(?:cpp|exporter|pictures|view)/", None, r"daemon/|drivers/|idl/(?:geometry|settings)/|clients/(?!cpp/|exporter/|markers/|pictures/|view/)",
     "clients live on the public contract: idl and clients/cpp"),
    ("driver-daemon", r"drivers/", None, r"daemon/", "a driver never includes the daemon"),
    ("fluoroscope-rooms", r"drivers/laboratory/fluoroscope/", None,
     r"(?:idl/(?!geometry/)|daemon|clients)/|drivers/(?!laboratory/fluoroscope/)",
     "the simulated fluoroscope sees idl/geometry only"),
    ("emulator-rooms", r"drivers/laboratory/aurora_emulator/", None,
     r"(?:daemon|idl|clients)/|drivers/(?!laboratory/aurora_emulator/|aurora/|interface/)",
     "the emulated Aurora sees drivers/aurora and drivers/interface only"),
    ("fluoroscope-headers", r"drivers/laboratory/fluoroscope/", None, rf"{OPENCV}|(?:chrono|ctime|thread|mutex)$",
     "radiographs are cast without OpenCV, clock or thread"),
    ("logging", r"daemon/|drivers/|idl/", r"daemon/\w+\.\w+$|daemon/publishing/", LOGGING,
     "only daemon/main.cpp and daemon/publishing log"),
)

# (rule, files it holds for, files it does not hold for, pattern of forbidden code, why)
CODE_RULES = (
    ("threads", r"daemon/|drivers/", THREAD_FILE, r"\bstd\s*::\s*(?:jthread|thread|async)\b|\bpthread_create\b",
     "threads are created in daemon/pipeline/stage_thread only"),
    ("protocol-clock", r"drivers/aurora/", None, rf"{CLOCK}|\bmonotonic_now\b", "the protocol is given the time as a value"),
    ("atomics", r"daemon/|drivers/|idl/", ATOMIC_FILES, r"\bstd\s*::\s*atomic|\b__atomic_\w+|\b__sync_\w+",
     "atomics live in the hand-over primitives and the shared memory only"),
    ("clocks", r"daemon/|idl/", CLOCK_FILES, CLOCK, "time comes as a value: the clock is read elsewhere"),
)

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def without_comments(text):
    """The text with comments and the insides of string literals of code lines blanked; line numbers stay."""
    token = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.S)

    def blank(match):
        word = match.group(0)
        if word.startswith("/"):
            return "\n" * word.count("\n") or " "
        line_start = text.rfind("\n", 0, match.start()) + 1
        return word if text[line_start:match.start()].lstrip().startswith("#") else word[0] * 2
    # An apostrophe between digits separates them (1'000): no character literal begins there.
    text = re.sub(r"(?<=[0-9a-fA-F])'(?=[0-9a-fA-F])", "", text)
    return token.sub(blank, text)


def folder_of(path):
    """daemon/model/x.hpp -> daemon/model; daemon/main.cpp -> daemon; drivers/laboratory/vessel/x.hpp -> drivers/laboratory/vessel."""
    folder = path.rsplit("/", 1)[0]
    fitting = [room for room in ROWS if (folder + "/").startswith(room + "/") and (room.count("/") or folder == room)]
    return max(fitting, key=len) if fitting else "/".join(path.split("/")[:2])


def row_of(folder):
    return ROWS.get(folder, DEVICE_ROW if folder.startswith("drivers/") else None)


def layer_fault(path, included):
    """(rule, why) when `path` may not include the project's file `included`, else None."""
    own, other = folder_of(path), folder_of(included)
    if own == other:
        return None
    own_row, other_row = row_of(own), row_of(other)
    if own_row is None or other_row is None:
        return ("rows", f"{own if own_row is None else other} stands in no row: add it to ROWS")
    if other_row >= own_row:
        return ("rows", f"row {own_row} ({own}) includes row {other_row} ({other}): own folder and lower rows only")
    return None


def check_file(root, path, generated):
    """Violations of one file as (path, line, rule, why)."""
    faults = []

    def holds_for(scope, exempt):
        return re.match(scope, path) and not (exempt and re.match(exempt, path))

    text = without_comments((root / path).read_text(encoding="utf-8", errors="replace"))
    for number, line in enumerate(text.splitlines(), 1):
        include = INCLUDE.match(line)
        if include:
            quote, included = include.groups()
            for rule, scope, exempt, pattern, why in INCLUDE_RULES:
                if holds_for(scope, exempt) and re.match(pattern, included):
                    faults.append((path, number, rule, f"{why}: {included}"))
            if included.split("/")[0] in SOURCE_FOLDERS and "/" in included:
                fault = layer_fault(path, included)
                if fault:
                    faults.append((path, number, fault[0], f"{fault[1]}: {included}"))
            elif quote == '"' and included not in generated:
                faults.append((path, number, "from-root", f"write includes from the project root: {included}"))
            continue
        for rule, scope, exempt, pattern, why in CODE_RULES:
            if holds_for(scope, exempt) and re.search(pattern, line):
                faults.append((path, number, rule, f"{why}: {line.strip()}"))
    return faults


DEFINED_TYPE = re.compile(r"^(?:struct|class|enum class|enum|union) (?:\[\[\w+\]\] )?(?:alignas\([^)]*\) )?(\w+)(?: final)?(?: : [^;]*)?(?:\s*\{|$)", re.M)
NAMESPACE = re.compile(r"^namespace ([\w:]+)", re.M)


def defined_twice(root, headers):
    """Types of one name and one namespace in two headers. A program that links both is undefined and no tool need say so."""
    places, faults = {}, []
    for path in headers:
        text = without_comments((root / path).read_text(encoding="utf-8", errors="replace"))
        spaces = [(match.start(), match.group(1)) for match in NAMESPACE.finditer(text)]
        for match in DEFINED_TYPE.finditer(text):
            space = next((name for start, name in reversed(spaces) if start < match.start()), "")
            line = text.count("\n", 0, match.start()) + 1
            first = places.setdefault((space, match.group(1)), path)
            if first != path:
                faults.append((path, line, "one-definition", f"{space}::{match.group(1)} is defined in {first} too: name one of them otherwise"))
    return faults


def check_tree(root):
    """(number of files looked at, violations)."""
    files = sorted(str(file.relative_to(root)) for folder in SOURCE_FOLDERS for file in (root / folder).rglob("*")
                   if file.suffix in SUFFIXES)
    generated = {f"{idl.stem}.h" for idl in (root / "idl").glob("*.idl")}   # by idlc, in the build directory
    faults = [fault for file in files for fault in check_file(root, file, generated)]
    return len(files), faults + defined_twice(root, [file for file in files if file.endswith(".hpp")])


# One violation each: (rule, path, code). The same path may not be used twice.
VIOLATIONS = (
    ("rows", "idl/geometry/a.hpp", '#include "daemon/model/b.hpp"'),
    ("rows", "idl/geometry/same_row.hpp", '#include "idl/estimate.hpp"'),
    ("rows", "idl/settings/a.hpp", '#include "idl/estimate.hpp"'),
    ("rows", "daemon/attic/a.hpp", '#include "daemon/model/b.hpp"'),
    ("below-clients", "daemon/config/a.hpp", '#include "clients/cpp/subscriber.hpp"'),
    ("from-root", "daemon/image/a.cpp", '#include "frangi.hpp"'),
    ("model-headers", "daemon/model/a.cpp", "#include <opencv2/core.hpp>"),
    ("model-headers", "daemon/model/b.cpp", "#include <ceres/ceres.h>"),
    ("model-headers", "daemon/model/c.cpp", "#include <chrono>"),
    ("estimator-drivers", "daemon/estimator/a.cpp", '#include "drivers/replay/sequence.hpp"'),
    ("estimator-headers", "daemon/estimator/b.cpp", "#include <dds/dds.h>"),
    ("estimator-headers", "daemon/estimator/c.cpp", "#include <thread>"),
    ("estimator-headers", "daemon/estimator/d.cpp", "#include <mutex>"),
    ("clocks", "daemon/estimator/e.cpp", "auto t = std::chrono::steady_clock::now();"),
    ("clocks", "daemon/pipeline/a.cpp", "clock_gettime(CLOCK_MONOTONIC, &t);"),
    ("clocks", "daemon/pipeline/clock_alias.cpp", "auto t = Clock::now();"),
    ("pipeline-drivers", "daemon/pipeline/b.cpp", '#include "drivers/aurora/protocol.hpp"'),
    ("pipeline-headers", "daemon/pipeline/c.cpp", '#include "dds/dds.h"'),
    ("pipeline-headers", "daemon/pipeline/d.cpp", "#  include <opencv2/imgproc.hpp>"),
    ("publishing-rooms", "daemon/publishing/a.cpp", '#include "daemon/pipeline/stages.hpp"'),
    ("publishing-rooms", "daemon/publishing/b.cpp", '#include "drivers/interface/em_source.hpp"'),
    ("logging", "daemon/pipeline/e.cpp", "#include <spdlog/spdlog.h>"),
    ("logging", "drivers/aurora_serial/log.cpp", "#include <spdlog/spdlog.h>"),
    ("rows", "drivers/aurora_serial/a.cpp", '#include "drivers/replay/sequence.hpp"'),
    ("driver-daemon", "drivers/simulation/a.cpp", '#include "daemon/model/uniform_cubic_bspline.hpp"'),
    ("driver-daemon", "drivers/driver_registry/a.cpp", '#include "daemon/image/frangi.hpp"'),
    ("rows", "drivers/laboratory/vessel/a.cpp", '#include "drivers/laboratory/instrument/catheter.hpp"'),
    ("rows", "clients/evaluation/a.cpp", '#include "clients/tubectl/verbs.hpp"'),
    ("rows", "drivers/png/a.cpp", '#include "drivers/interface/image_source.hpp"'),
    ("rows", "drivers/laboratory/b.cpp", '#include "drivers/simulation/simulation_driver.hpp"'),
    ("below-clients", "idl/a.hpp", '#include "clients/cpp/tube_subscriber.hpp"'),
    ("client-rooms", "clients/exporter/a.cpp", '#include "daemon/model/b.hpp"'),
    ("client-rooms", "clients/view/a.cpp", '#include "drivers/interface/room.hpp"'),
    ("rows", "clients/markers/a.cpp", '#include "drivers/replay/sequence_folder.hpp"'),
    ("client-rooms", "clients/view/b.cpp", '#include "clients/calibration/marker_pairs.hpp"'),
    ("image-drivers", "daemon/image/b.cpp", '#include "drivers/aurora/bx_reply.hpp"'),
    ("rows", "daemon/model/d.cpp", '#include "drivers/aurora/bx_reply.hpp"'),
    ("protocol-rooms", "drivers/aurora/a.cpp", '#include "drivers/aurora_serial/serial_port.hpp"'),
    ("protocol-rooms", "drivers/aurora/b.cpp", '#include "idl/geometry/camera.hpp"'),
    ("protocol-headers", "drivers/aurora/c.cpp", "#include <termios.h>"),
    ("protocol-headers", "drivers/aurora/d.cpp", "#include <sys/socket.h>"),
    ("protocol-clock", "drivers/aurora/e.cpp", "const auto now = monotonic_now();"),
    ("fluoroscope-rooms", "drivers/laboratory/fluoroscope/a.cpp", '#include "drivers/interface/image_source.hpp"'),
    ("fluoroscope-rooms", "drivers/laboratory/fluoroscope/b.cpp", '#include "drivers/laboratory/vessel/vessel.hpp"'),
    ("fluoroscope-headers", "drivers/laboratory/fluoroscope/c.cpp", "#include <opencv2/core.hpp>"),
    ("emulator-rooms", "drivers/laboratory/aurora_emulator/a.cpp", '#include "drivers/laboratory/vessel/vessel.hpp"'),
    ("client-rooms", "clients/cpp/a.cpp", '#include "idl/geometry/camera.hpp"'),
    ("threads", "drivers/replay/a.cpp", "std::jthread reader([] {});"),
    ("threads", "daemon/pipeline/f.cpp", "std::thread t(run);"),
    ("threads", "daemon/pipeline/g.cpp", "pthread_create(&t, nullptr, run, nullptr);"),
    ("atomics", "daemon/pipeline/h.hpp", "std::atomic<int> count;"),
    ("atomics", "idl/flag.hpp", "std::atomic_flag flag;"),
    ("one-definition", "clients/view/verdict.hpp", "namespace tubed {\nenum class Verdict { kGood };\n}"),
)

# What must not be reported.
ALLOWED = (
    ("daemon/estimator/fine.cpp", '#include "drivers/interface/em_source.hpp"\n#include "daemon/model/b.hpp"\n'
                                  "// std::thread, steady_clock::now() and <mutex> are none of ours\n"
                                  "/* #include <thread>\n   std::atomic */ int n = 1'000;\n"),
    ("daemon/pipeline/triple_buffer.hpp", "std::atomic<int> newest;"),
    ("daemon/pipeline/doorbell.cpp", "std::atomic_ref<int> word(w);"),
    ("daemon/pipeline/stage_thread.cpp", "std::jthread t; auto now = std::chrono::steady_clock::now();"),
    ("daemon/publishing/fine.cpp", '#include <dds/dds.h>\n#include <spdlog/spdlog.h>\n#include "TubeEstimate.h"\n'),
    ("daemon/main.cpp", '#include <spdlog/spdlog.h>\n#include "daemon/config/config.hpp"\n'),
    ("drivers/simulation/fine.cpp", '#include "idl/geometry/camera.hpp"\n#include "drivers/interface/room.hpp"\n'),
    ("drivers/simulation/sees_rays.cpp", '#include "drivers/laboratory/fluoroscope/radiograph.hpp"'),
    ("drivers/laboratory/fluoroscope/fine.cpp", '#include "idl/geometry/camera.hpp"'),
    ("drivers/laboratory/aurora_emulator/fine.cpp", '#include "drivers/aurora/bx_reply.hpp"'),
    ("drivers/replay/fine.cpp", "auto t = std::chrono::steady_clock::now(); std::this_thread::yield();"),
    ("drivers/aurora/fine.cpp", '#include "drivers/interface/em_source.hpp"\n#include "drivers/aurora/bytes.hpp"\n'),
    ("drivers/aurora_serial/fine.cpp", '#include "drivers/aurora/bytes.hpp"\n#include <termios.h>\n'),
    ("drivers/driver_registry/fine.cpp", '#include "drivers/replay/sequence.hpp"'),
    ("clients/tubectl/judge/fine.cpp", '#include "clients/evaluation/evaluation.hpp"\n#include "clients/tubectl/verbs.hpp"\n'),
    ("clients/tubectl/fine.cpp", '#include "daemon/config/config.hpp"\n#include "clients/cpp/subscriber.hpp"\n'),
    ("clients/view/fine.cpp", '#include "clients/markers/marker_file.hpp"'),
    ("clients/markers/fine.cpp", '#include "drivers/csv/csv_reader.hpp"\n#include "idl/printable_text.hpp"\n'),
    ("clients/exporter/fine.cpp", '#include "idl/estimate.hpp"\n#include "clients/cpp/subscriber.hpp"\n'),
    ("idl/shm_layout.hpp", "std::atomic<int> sequence;"),
    ("clients/tubectl/verdict.hpp", "namespace tubed {\nstruct Verdict\n{\n};\nstruct Named;\n}"),
    ("clients/view/named.hpp", "namespace tubed::view {\nstruct Verdict {};\n}\nnamespace tubed {\nstruct Named {\n  struct Verdict {};\n};\n}"),
    ("idl/TubeEstimate.idl", ""),
)


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for path, code in [(path, code) for _, path, code in VIOLATIONS] + list(ALLOWED):
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(code + "\n", encoding="utf-8")
        faults = check_tree(root)[1]
    reported = {(rule, path) for path, _, rule, _ in faults}
    wanted = {(rule, path) for rule, path, _ in VIOLATIONS}
    missed = [f"missed {rule} in {path}" for rule, path in sorted(wanted - reported)]
    # A violation may break two rules (a row and a room's own); what is allowed may break none.
    wrong = [f"wrongly reported {rule} in {path}" for rule, path in sorted(reported)
             if path in dict(ALLOWED)]
    rules = {rule for rule, *_ in INCLUDE_RULES + CODE_RULES} | {"rows", "from-root", "one-definition"}
    untested = [f"no violation of {rule} in the self-test" for rule in sorted(rules - {rule for rule, _ in wanted})]
    for line in missed + wrong + untested:
        print(line)
    if missed or wrong or untested:
        return 1
    print(f"{len(wanted)} violations of {len(rules)} rules reported, {len(ALLOWED)} good files left alone")
    return 0


def main(arguments):
    if arguments == ["--self-test"]:
        return self_test()
    root = Path(arguments[0]) if arguments else Path(__file__).resolve().parents[2]
    count, faults = check_tree(root)
    for path, line, rule, why in faults:
        print(f"{path}:{line}: [{rule}] {why}")
    print(f"{count} files, {len(faults)} violations")
    if count == 0:
        print(f"no source files under {root}: is it the project's root?")
    return 1 if faults or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
