#!/usr/bin/env python3
"""tubectl view: a recording in a browser, with a time line."""
import csv
import json
import shutil
import subprocess
import time

import bed as beds
import browser as browsers
import calm
import view_client as client
from bed import check

ADDRESS = f"http://{client.HOST}/"


def recorded(bed):
    """A simulated run of 12 images."""
    folder = bed.folder / "run"
    done = bed.tubectl("simulate", "--preset", "paper", "--seed", "21", "--every", "30", "--out", str(folder), timeout_s=150)
    check(done.returncode == 0, f"tubectl simulate exits {done.returncode}: {done.stderr}")
    return folder


def shown(bed, folder, *options):
    """A running `tubectl view`, ended with the bed, once it listens."""
    errors = bed.folder / "recording.err"
    with open(errors, "wb") as sink:
        process = subprocess.Popen([bed.program("tubectl"), "view", str(folder), *options], stdout=sink, stderr=sink,
                                   preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (process.kill(), process.wait()))
    until = time.monotonic() + 20 * beds.TIME_FACTOR
    while time.monotonic() < until:
        try:
            client.connect().close()
            return process, errors
        except OSError:
            check(process.poll() is None, f"tubectl view ended with {process.returncode}: {errors.read_text()}")
            time.sleep(0.05)
    raise beds.Failure("tubectl view does not listen within 20 s")


def page(bed):
    window = browsers.Browser(900, 600)
    bed.closing.callback(window.close)
    window.open(ADDRESS)
    window.wait("window.tubedView && tubedView.now().timeline?.done && tubedView.now().sample && tubedView.counts.images > 0",
                "the whole recording on the time line", 60)
    return window


def press(window, key):
    window.run("dispatchEvent(new KeyboardEvent('keydown', {key: arguments[0]}));", key)


def a_recording_is_shown_with_a_time_line(bed):
    folder = recorded(bed)
    process, _ = shown(bed, folder)
    window = page(bed)
    done = bed.tubectl("reconstruct", str(folder), "--out", str(bed.folder / "est.csv"), timeout_s=60)
    check(done.returncode == 0, f"tubectl reconstruct exits {done.returncode}: {done.stderr}")
    with open(bed.folder / "est.csv", newline="", encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    frames = sorted({int(row["frame"]) for row in rows})
    now = window.run("return tubedView.now();")
    check(now["timeline"]["validity"].count("V") > 6 and len(now["timeline"]["rows"]) == 3, f"the time line is {str(now['timeline'])[:300]}")
    check(now["sample"]["reasons"].count("REPLAY_DATA") == 1, f"reasons {now['sample']['reasons']}")
    check(window.run("return [...document.querySelectorAll('.watermark')].every((e) => e.textContent === 'REPLAY');"), "REPLAY does not stand across")
    # Every instant, from the last to the first: the shape is that of the reconstruction, the image its own.
    press(window, "End")
    for frame in reversed(frames):
        window.wait(f"tubedView.now().position.frame === {frame} && tubedView.now().image?.frame === {frame}", f"frame {frame} and its image", 10)
        sample = window.run("return tubedView.now().sample;")
        tip = next(row for row in rows if int(row["frame"]) == frame)
        for axis, name in enumerate(("x", "y", "z")):
            check(abs(sample["points"][axis] - float(tip[name])) < 2e-3, f"frame {frame}: tip {name} {sample['points'][axis]}, reconstructed {tip[name]}")
        check(sample["validity"] == tip["validity"], f"frame {frame}: {sample['validity']}, reconstructed {tip['validity']}")
        check(len(sample["truth"]) > 200, "the truth is not there")
        press(window, ",")
    # It stands still, and is still shown; then it goes on.
    time.sleep(1)
    still = window.run("return tubedView.now();")
    check(not still["is_silent"] and not still["position"]["playing"], f"standing still the page says {still['word']}: {still['why']}")
    press(window, "]")
    press(window, "]")
    window.wait("tubedView.now().position.speed === 4", "four times as quick")
    press(window, " ")
    window.wait(f"tubedView.now().position.frame === {frames[-1]} && !tubedView.now().position.playing", "the end of the recording", 60)
    # A click on the line: the place that was clicked.
    window.run("""const line = document.getElementById("strips"), box = line.getBoundingClientRect();
        line.setPointerCapture = () => {};
        line.dispatchEvent(new PointerEvent("pointerdown", {clientX: box.left + 250 + (box.width - 342) / 2, clientY: box.top + 40}));""")
    middle = (now["timeline"]["begin"] + now["timeline"]["end"]) / 2
    window.wait(f"Math.abs(tubedView.now().position.at - {middle}) < {0.02 * middle}", "the middle of the recording")
    check(not window.errors(), f"the console has errors: {window.errors()}")
    process.terminate()
    check(process.wait(10) == 0, f"tubectl view ends with {process.returncode}")
    window.wait("document.body.classList.contains('none') && document.querySelector('#why').textContent.includes('tubectl view')",
                "NO SHAPE after the program has ended")


def a_recording_that_breaks_off_is_shown_until_there(bed):
    folder = recorded(bed)
    with open(folder / "frames.csv", newline="", encoding="ascii") as file:
        broken = list(csv.DictReader(file))[6]["file"]
    (folder / broken).write_bytes((folder / broken).read_bytes()[:100])
    _, errors = shown(bed, folder)
    window = browsers.Browser(900, 600)
    bed.closing.callback(window.close)
    window.open(ADDRESS)
    window.wait("window.tubedView && tubedView.now().timeline?.trouble", "trouble on the time line", 60)
    now = window.run("return tubedView.now();")
    check(broken in now["timeline"]["trouble"], f"the page says {now['timeline']['trouble']}")
    until = time.monotonic() + 5 * beds.TIME_FACTOR  # the terminal is told a moment later than the page
    while broken not in errors.read_text() and time.monotonic() < until:
        time.sleep(0.05)
    check(broken in errors.read_text(), f"the terminal says {errors.read_text()}")
    press(window, "End")
    window.wait("tubedView.now().sample?.points.length > 0 && tubedView.now().position.instant === 5", "the last instant before", 10)


def a_recording_that_cannot_be_shown_is_refused_in_words(bed):
    folder = recorded(bed)
    other = bed.folder / "other.toml"
    other.write_text('[em]\ndriver = "simulation"\n')
    empty = bed.folder / "empty"
    shutil.copytree(folder, empty)
    (empty / "frames.csv").write_text("frame,t_s,camera,file\n")
    for words, (arguments, code) in {"frames.csv": ([str(empty)], (1, 65)), "nowhere": ([str(bed.folder / "nowhere")], (1, 65)),
                                     "other.toml": ([str(folder), "--config", str(other)], (1, 65, 78)),
                                     "--token-file": ([str(folder), "--listen", "0.0.0.0:8080"], (64,))}.items():
        done = bed.tubectl("view", *arguments, timeout_s=30)
        check(done.returncode in code and words in done.stderr, f"tubectl view {arguments} exits {done.returncode}: {done.stderr}")
    shown(bed, folder)
    done = bed.tubectl("view", str(folder), timeout_s=30)
    check(done.returncode != 0 and client.HOST in done.stderr and "--listen" in done.stderr, f"a second one exits {done.returncode}: {done.stderr}")


def wait_for(stream, is_wanted):
    """Until a message in words comes that is."""
    until, last = time.monotonic() + 30 * beds.TIME_FACTOR, None
    while time.monotonic() < until:
        for opcode, payload in stream.take():
            message = json.loads(payload) if opcode == 1 else None
            if message and is_wanted(message):
                return
            last = message if message and message["type"] == "position" else last
        time.sleep(0.01)
    raise beds.Failure(f"it does not come; the last position is {last}")


def words_of_strangers_move_nothing(bed):
    folder = recorded(bed)
    shown(bed, folder)
    status, connection = client.upgrade()
    check(status == 101, f"the stream answers with {status}")
    stream = client.Frames(connection)
    wait_for(stream, lambda message: message["type"] == "timeline" and message["done"])
    stream.send(client.masked(b'{"seek": 0}'))
    for words in (b"{", b'{"seek": "1"}', b'{"seek": 1e400}', b'{"step": 1e99}', b'{"play": 1}', b'{"faster": null}', b'{"faster": 1e300}', b'[{"seek": 3}]'):
        stream.send(client.masked(words))
    stream.send(client.masked(b"\xff" * 900, opcode=2))
    stream.send(client.masked(b'{"step": 2}'))
    wait_for(stream, lambda message: message["type"] == "position" and not message["playing"] and message["instant"] == 2)
    connection.close()


if __name__ == "__main__":
    beds.main(a_recording_is_shown_with_a_time_line, a_recording_that_breaks_off_is_shown_until_there,
              a_recording_that_cannot_be_shown_is_refused_in_words, words_of_strangers_move_nothing)
