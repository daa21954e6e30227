#!/usr/bin/env python3
"""Makes the pictures of this README: screenshots.py FOLDER_OF_PROGRAMS [FOLDER_OF_PICTURES]; ./run screenshots calls it.

Each state is made as it comes about: `tubectl demo --web` runs, and its buttons are pressed. A picture is one that the browser's compositor put together. In namespaces of its own, as root.
"""
import base64
import math
import os
import pathlib
import shutil
import signal
import struct
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests/system"))
import bed as beds  # noqa: E402
import browser as browsers  # noqa: E402
import calm  # noqa: E402
import view_client as client  # noqa: E402

WIDTH, HEIGHT = 1280, 760
NOTHING = "nothing contradicts this shape"  # what the page writes where there is no reason


def wait_for_server():
    until = time.monotonic() + 30
    while time.monotonic() < until:
        try:
            return client.connect().close()
        except OSError:
            time.sleep(0.1)
    raise beds.Failure("nobody listens at the page's address")


def opened(bed, state="valid"):
    wait_for_server()
    window = browsers.Browser(WIDTH, HEIGHT)
    bed.closing.callback(window.close)
    window.open(f"http://{client.HOST}/")
    window.wait(f"window.tubedView && document.body.classList.contains('{state}')", state, 60)
    return window


# When a picture lacked something because the browser had no time for it: an image that came long ago, a room without the shape.
WATCH_CAPTIONS = """
if (!window.lacks) {
  window.lacks = [];
  const [image, room] = ["#image-caption", "#room-caption"].map((id) => document.querySelector(id));
  const note = () => lacks.push({ wall: Date.now(), is: image.classList.contains("warn") || room.textContent.includes("unknown") });
  const watcher = new MutationObserver(note);
  for (const each of [image, room]) watcher.observe(each, { attributes: true, childList: true, characterData: true, subtree: true });
  note();
}"""


def shoot(window, folder, name, state, words="", is_whole=True):
    """When the page is in that state; another picture where it has left it meanwhile (a busy machine), or, of a whole one, where it lacks something."""
    # Taking pictures holds a busy page up, which its watchdog would show.
    window.run("document.querySelector('#watchdog')?.remove();" + WATCH_CAPTIONS)
    for _ in range(20):
        window.wait(f"document.body.classList.contains('{state}') && document.querySelector('#why').textContent.includes('{words}')",
                    f"{name}: {state}, {words}", 20)
        for at, png in reversed(window.frames(1.5)):
            if was(window, "none" if state == "silent" else state, words, at) and not (is_whole and lacked(window, at)):
                save(folder / f"{name}.png", base64.b64decode(png))
                return beds.say(f"{name}.png")
    raise beds.Failure(f"{name}: the page does not stay {state}, or has no time for its images")


def save(path, png):
    """With 64 colours where pngquant is there."""
    path.write_bytes(png)
    if shutil.which("pngquant"):
        subprocess.run(["pngquant", "--force", "--strip", "--ext", ".png", "64", str(path)], check=True)


def lacked(window, at, late_s=0.6, for_s=0.08):
    """Whether something lacked shortly before that instant, at which the picture arrived: a busy browser hands it over late."""
    notes = window.run("return lacks;")
    before = [each for each in notes if each["wall"] / 1000 <= at - late_s]
    about = [each for each in notes if at - late_s < each["wall"] / 1000 < at + for_s]
    return any(each["is"] for each in before[-1:] + about)


def was(window, state, words, at, for_s=0.08):
    """Whether the page had been in that state for a while at that instant, and stayed so."""
    states = window.run("return tubedView.counts.states;")
    before = [each for each in states if each["wall"] / 1000 <= at]
    stays = not [each for each in states if at < each["wall"] / 1000 < at + for_s]
    return bool(before) and before[-1]["class"] == state and words in (before[-1]["why"] or NOTHING) and before[-1]["wall"] / 1000 < at - for_s and stays


def demo(bed, folder):
    process = subprocess.Popen([bed.program("tubectl"), "demo", "--web"], stderr=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (process.kill(), process.wait()))
    window = opened(bed)
    press = lambda name: window.run("[...document.querySelectorAll('#demo button')].find((e) => e.textContent === arguments[0]).click();", name)
    time.sleep(20)
    shoot(window, folder, "valid", "valid", NOTHING)
    press("Coil 3 off by 12 mm")
    time.sleep(3)
    shoot(window, folder, "questionable", "questionable", "a coil")
    press("Repair all")
    time.sleep(4)
    press("Fluoroscopy off")
    time.sleep(3)
    shoot(window, folder, "fluoroscopy-off", "valid", "fluoroscopy is off", is_whole=False)
    press("Repair all")
    time.sleep(4)
    press("Pan table by 5 mm")
    time.sleep(3)
    shoot(window, folder, "geometry-suspect", "questionable", "table or C-arm moved")
    press("Pan it back")
    time.sleep(6)
    press("Tracker stalls")
    time.sleep(0.7)
    shoot(window, folder, "invalid", "none", "tracker sends nothing new", is_whole=False)
    time.sleep(4)
    window.run("document.querySelector('#help').showModal();")
    window.picture(folder / "help.png")
    save(folder / "help.png", (folder / "help.png").read_bytes())
    window.run("document.querySelector('#help').close();")
    daemon = next(pid for pid in children(process.pid) if pathlib.Path(f"/proc/{pid}/comm").read_text().strip() == "tubed")
    os.kill(daemon, signal.SIGSTOP)
    time.sleep(1)
    shoot(window, folder, "nothing", "silent", is_whole=False)
    os.kill(daemon, signal.SIGCONT)
    window.close()
    process.terminate()
    process.wait()


def children(pid):
    return [int(child) for child in pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def two_of_each(bed, folder):
    """Two instruments in two views."""
    text = bed.simulation((beds.Instrument(), beds.Instrument("cath-2", 6), beds.Instrument("cath-1-em", 1, "em")),
                          head=f'[shm]\npreview_folder = "{bed.folder}"\n')
    side = ('[[camera]]\nname = "B"\nwidth = 400\nheight = 600\nfx = 2000.0\nfy = 2000.0\ncx = 200.0\ncy = 300.0\n'
            'T_camera_world = [[0,0,1,0],[0,1,0,0],[-1,0,0,1200],[0,0,0,1]]\ndriver = "simulation"\n\n')
    bed.start_daemon(text.replace("[[instrument]]", side + "[[instrument]]", 1))
    viewer = subprocess.Popen([bed.program("tubed-view"), "--images", str(bed.folder)], stderr=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (viewer.kill(), viewer.wait()))
    window = opened(bed)
    time.sleep(8)
    shoot(window, folder, "two-instruments-two-views", "valid")
    points = window.run("return tubedView.now().sample.points;")
    window.close()
    viewer.kill()
    viewer.wait()
    line = [points[i:i + 3] for i in range(0, len(points), 12)]
    (bed.folder / "vessel.stl").write_bytes(tube_stl(line, 11))
    markers = markers_around(line)
    for name, shift in (("points", 0), ("touched", 1)):
        (bed.folder / f"{name}.csv").write_text("name,x,y,z\n" + "".join(
            f"M{i + 1},{x + shift * (i % 3)},{y - shift * (i % 2)},{z + shift * 0.7}\n" for i, (x, y, z) in enumerate(markers)))
    viewer = subprocess.Popen([bed.program("tubed-view"), "--images", str(bed.folder), "--vessel", str(bed.folder / "vessel.stl"),
                               "--points", str(bed.folder / "points.csv"), "--touched", str(bed.folder / "touched.csv")],
                              stderr=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (viewer.kill(), viewer.wait()))
    window = opened(bed)
    time.sleep(4)
    shoot(window, folder, "vessel", "valid")


def recording(bed, folder):
    """A recording of a disturbed run, where the catheter is in the arch."""
    run = bed.folder / "clinical-7"
    done = bed.tubectl("simulate", "--preset", "clinical", "--seed", "7", "--out", str(run), timeout_s=200)
    beds.check(done.returncode == 0, done.stderr)
    process = subprocess.Popen([bed.program("tubectl"), "view", str(run)], stderr=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (process.kill(), process.wait()))
    wait_for_server()
    window = browsers.Browser(WIDTH, HEIGHT)
    bed.closing.callback(window.close)
    window.open(f"http://{client.HOST}/")
    window.wait("window.tubedView?.now().timeline?.done && tubedView.counts.images > 0", "the whole recording", 90)
    window.run("dispatchEvent(new KeyboardEvent('keydown', {key: ' '})); document.querySelector('#watchdog')?.remove();")
    window.run("""const line = document.getElementById("strips"), box = line.getBoundingClientRect();
        line.setPointerCapture = () => {};
        line.dispatchEvent(new PointerEvent("pointerdown", {clientX: box.left + 250 + (box.width - 342) * 0.8, clientY: box.top + 40}));""")
    time.sleep(3)
    window.picture(folder / "recording.png")
    save(folder / "recording.png", (folder / "recording.png").read_bytes())
    beds.say("recording.png")


def markers_around(line):
    """Ten, as on the skin around the vessel: the tracker's frame is the world's in this room."""
    low, high = ([pick(p[axis] for p in line) for axis in range(3)] for pick in (min, max))
    middle, half = [(a + b) / 2 for a, b in zip(low, high)], [max((b - a) / 2, 30) for a, b in zip(low, high)]
    ring = [(math.cos(2 * math.pi * k / 10), math.sin(2 * math.pi * k / 10), (-1) ** k) for k in range(10)]
    return [[m + h * share for m, h, share in zip(middle, half, place)] for place in ring]


def tube_stl(points, radius, sides=24):
    """A tube around a line as binary STL: in place of a segmented vessel."""
    rings = []
    for i, p in enumerate(points):
        a, b = points[max(i - 1, 0)], points[min(i + 1, len(points) - 1)]
        t = unit([y - x for x, y in zip(a, b)])
        u = unit(cross(t, [0, 0, 1] if abs(t[2]) < 0.9 else [1, 0, 0]))
        v = cross(t, u)
        rings.append([[c + radius * (math.cos(2 * math.pi * k / sides) * x + math.sin(2 * math.pi * k / sides) * y) for c, x, y in zip(p, u, v)]
                      for k in range(sides)])
    triangles = []
    for ring, other in zip(rings, rings[1:]):
        for k in range(sides):
            a, b, c, d = ring[k], ring[(k + 1) % sides], other[k], other[(k + 1) % sides]
            triangles += [(a, b, c), (b, d, c)]
    return b"tube".ljust(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *(x for corner in triangle for x in corner), 0) for triangle in triangles)


def unit(v):
    length = math.hypot(*v)
    return [x / length for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def scenario(run, folder):
    def made(bed):
        run(bed, folder)
    made.__name__ = run.__name__
    return made


def main():
    programs = sys.argv[1]
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else HERE / "pictures"
    folder.mkdir(exist_ok=True)
    if shutil.which("pngquant") is None:
        beds.say("no pngquant: the pictures stay five times as large")
    if os.environ.get("TUBED_PICTURES") is None:  # one process each: namespaces are entered once
        for run in (demo, two_of_each, recording):
            subprocess.run([sys.executable, __file__, programs, str(folder)], env={**os.environ, "TUBED_PICTURES": run.__name__}, check=True)
        return 0
    return beds.run_scenario([scenario(run, folder) for run in (demo, two_of_each, recording)], programs, os.environ["TUBED_PICTURES"], visible=[folder])


if __name__ == "__main__":
    sys.exit(main())
