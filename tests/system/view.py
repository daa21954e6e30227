#!/usr/bin/env python3
"""tubed-view: what a person sees in a browser, and what it costs the room."""
import base64
import math
import os
import signal
import statistics
import subprocess
import time
import zlib

import bed as beds
import browser as browsers
import calm
import view_client as client
from bed import check, check_timing, need_real_time, say

ADDRESS = f"http://{client.HOST}/"
# As clients/view/page draws a VALID tube; lines are a mixture of it and black.
TEAL = (0x19, 0xe0, 0xcc)
CAMERA = {"f": 2000.0, "c": (200.0, 300.0), "depth": 1200.0}  # of bed.simulation(), without distortion


def with_previews(bed, instruments=(beds.Instrument(), beds.Instrument("cath-1-em", 1, "em")), **more):
    return bed.simulation(instruments, head=f'[shm]\npreview_folder = "{bed.folder}"\n', **more)


def view(bed, *arguments):
    """A running tubed-view, ended with the bed."""
    with open(bed.folder / "echo-view.err", "ab") as sink:
        process = subprocess.Popen([bed.program("tubed-view"), "--images", str(bed.folder), *arguments], stderr=sink, stdout=sink,
                                   preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (process.kill(), process.wait()))
    until = time.monotonic() + 5 * beds.TIME_FACTOR
    while time.monotonic() < until:
        try:
            client.connect().close()
            return process
        except OSError:
            check(process.poll() is None, f"tubed-view ended with {process.returncode}")
            time.sleep(0.05)
    raise beds.Failure("tubed-view does not listen within 5 s")


def page(bed, width=640, height=480):
    """A browser that has just shown a VALID shape with an image."""
    window = browsers.Browser(width, height)
    bed.closing.callback(window.close)
    window.open(ADDRESS)
    window.wait("window.tubedView && document.body.classList.contains('valid') && tubedView.counts.images > 0", "a VALID shape in the page", 20)
    return window


def quantile(values, share):
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


class Watched:
    """Six seconds of a page."""

    def __init__(self, window):
        look = "const {seq} = tubedView.now().sample; return {...tubedView.counts, states: [], seq, at: performance.now()};"
        before = window.run(look)
        time.sleep(6)
        after = window.run(look)
        seconds = (after["at"] - before["at"]) / 1000
        instants = after["seq"] - before["seq"]  # by the daemon's own count
        self.published, self.shown = 2 * instants, after["estimates"] - before["estimates"]  # of two instruments
        self.published_hz = instants / seconds
        self.paints_hz = (after["paints"] - before["paints"]) / seconds
        self.images_hz = (after["images"] - before["images"]) / seconds
        self.ages_ms = after["ages"][-300:]
        say(f"the page has {self.shown} of {self.published} samples (two instruments), {self.paints_hz:.1f} paints and "
            f"{self.images_hz:.1f} images a second; publishing to paint p50 {statistics.median(self.ages_ms):.1f} ms, p99 "
            f"{quantile(self.ages_ms, 0.99):.1f} ms")

    def wanted_images_hz(self):
        """The next image goes out when the page has said that it has shown the one before: on a machine that paints late, fewer."""
        return min(10, 1000 / (3 * statistics.median(self.ages_ms)))

    def keeps_up(self):
        return (self.shown >= 0.95 * self.published and self.paints_hz >= 0.9 * self.published_hz
                and self.images_hz >= self.wanted_images_hz())


def the_page_shows_what_the_daemon_publishes(bed):
    bed.tracked(with_previews(bed))
    view(bed)
    window = page(bed)
    watched = [Watched(window)]
    while not watched[-1].keeps_up() and len(watched) < 3:  # a browser and a filter on two processors: one bad period is no fault
        watched.append(Watched(window))
    last = watched[-1]
    check(not window.errors(), f"the console has errors: {window.errors()}")
    check(all(one.images_hz <= 16.5 for one in watched), f"{[one.images_hz for one in watched]} images a second, expected 15 at most")
    check_timing(last.keeps_up(), f"{last.shown} of {last.published} samples, {last.paints_hz:.1f} paints of {last.published_hz:.1f} samples a "
                 f"second, {last.images_hz:.1f} images of {last.wanted_images_hz():.1f} and more, three times")


def projected(p):
    return tuple(CAMERA["f"] * p[axis] / (p[2] + CAMERA["depth"]) + CAMERA["c"][axis] for axis in (0, 1))


def edges_of(sample):
    """Both edges of the tube in the image, whether each place of them is held, both its ends, and the tip, px, closely spaced: of the
    sample's own numbers."""
    points = [tuple(sample["points"][i:i + 3]) for i in range(0, len(sample["points"]), 3)]
    line = [projected(p) for p in points]
    radii = [sample["radius"] * CAMERA["f"] / (p[2] + CAMERA["depth"]) for p in points]
    edges, is_held, ends = [], [], []
    for (a, b), r, held in zip(zip(line, line[1:]), radii, zip(sample["held"], sample["held"][1:])):
        d = math.dist(a, b) or 1
        n = (-(b[1] - a[1]) / d, (b[0] - a[0]) / d)
        for t in (k / 8 for k in range(8)):
            edges += [(a[0] + t * (b[0] - a[0]) + k * r * n[0], a[1] + t * (b[1] - a[1]) + k * r * n[1]) for k in (-1, 1)]
            is_held += [0 not in held] * 2
        across = [(k / 4 * r * n[0], k / 4 * r * n[1]) for k in range(-4, 5)]
        ends = ends or [(a[0] + x, a[1] + y) for x, y in across]  # of the first piece, and of the last so far
        ends[9:] = [(b[0] + x, b[1] + y) for x, y in across]
    return edges, is_held, ends, line[0]


def pixels_of(png):
    """Rows of (r, g, b) of a PNG as a canvas gives it: 8 bit, colour with or without alpha."""
    data, at, packed = base64.b64decode(png), 8, b""
    while at < len(data):
        size, kind = int.from_bytes(data[at:at + 4], "big"), data[at + 4:at + 8]
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, channels = int.from_bytes(body[:4], "big"), int.from_bytes(body[4:8], "big"), {2: 3, 6: 4}[body[9]]
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    raw, stride, rows = zlib.decompress(packed), width * channels, []
    before = bytearray(stride)
    for y in range(height):
        method, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        unfilter(method, line, before, channels)
        rows.append([tuple(line[x:x + 3]) for x in range(0, stride, channels)])
        before = line
    return rows


def unfilter(method, line, before, channels):
    for x in range(len(line)):
        left, up, corner = (line[x - channels], before[x], before[x - channels]) if x >= channels else (0, before[x], 0)
        if method == 4:
            distances = [(abs(up - corner), left), (abs(left - corner), up), (abs(left + up - 2 * corner), corner)]
            line[x] = line[x] + min(distances, key=lambda pair: pair[0])[1] & 255
        else:
            line[x] = line[x] + (0, left, up, (left + up) // 2)[method] & 255


def bright(rows, share=0.5):
    """Places of pixels that have at least this share of the tube's colour, and nothing else."""
    return [(x, y) for y, row in enumerate(rows) for x, (r, g, b) in enumerate(row)
            if g > share * TEAL[1] and b > share * TEAL[2] and r < 0.35 * g]


TUBE_ALONE = """
  for (const key of arguments[0]) dispatchEvent(new KeyboardEvent("keydown", {key}));
  const now = tubedView.now();
  return {sample: now.drawn.sample, place: now.drawn.place, png: document.getElementById("fluoroscopy").toDataURL("image/png").split(",")[1]};
"""


def the_tube_is_drawn_where_the_sample_projects(bed):
    need_real_time()  # a shape that comes late is drawn over a newer image
    bed.tracked(with_previews(bed))
    view(bed)
    window = page(bed, 1000, 900)
    shot = window.run(TUBE_ALONE, ["i", "u", "c", "e"])  # neither image, band, coils nor coils alone
    place, rows = shot["place"], pixels_of(shot["png"])
    edges, is_held, ends, tip = edges_of(shot["sample"])
    shown = lambda u, v: (place["x"] + (u + 0.5) * place["k"] - 0.5, place["y"] + (v + 0.5) * place["k"] - 0.5)
    in_image = [(shown(u, v), held) for (u, v), held in zip(edges, is_held) if -0.5 < u < 399.5 and -0.5 < v < 599.5]
    on_canvas = [place_px for place_px, held in in_image if held]  # the others are dotted
    marks = bright(rows)
    check(len(on_canvas) > 200 and len(marks) > 200, f"{len(on_canvas)} places of the edges, {len(marks)} pixels: too few to judge")
    tip = (place["x"] + (tip[0] + 0.5) * place["k"], place["y"] + (tip[1] + 0.5) * place["k"])
    off = [mark for mark in marks if math.dist(mark, tip) > 7]  # its dot has a radius of 3.5 px
    astray = farthest(off, [shown(u, v) for u, v in edges + ends])
    missing = farthest(on_canvas, marks)
    say(f"image shown {place['k']:.2f} times as large; pixels of the tube at most {astray:.2f} px from the projected edges, edges at most "
        f"{missing:.2f} px from a pixel ({len(marks)} pixels, {len(on_canvas)} places)")
    check(astray <= 2 and missing <= 2, f"the drawn tube is up to {max(astray, missing):.2f} px off, expected at most 2")


def farthest(points, others):
    """The greatest distance of one of `points` from its nearest of `others`, px."""
    cells = {}
    for other in others:
        cells.setdefault((int(other[0] // 8), int(other[1] // 8)), []).append(other)
    def nearest(p):
        x, y = int(p[0] // 8), int(p[1] // 8)
        near = [other for i in (-1, 0, 1) for j in (-1, 0, 1) for other in cells.get((x + i, y + j), [])]
        return min((math.dist(p, other) for other in near), default=8.0)
    return max(nearest(p) for p in points)


NOTHING_DRAWN = """
  const canvas = document.getElementById("fluoroscopy"), context = canvas.getContext("2d");
  const data = context.getImageData(0, 0, canvas.width, canvas.height).data;
  let teal = 0;
  for (let i = 0; i < data.length; i += 4) teal += data[i + 1] > 112 && data[i + 2] > 102 && data[i] < 0.35 * data[i + 1] ? 1 : 0;
  return {teal, veil: getComputedStyle(document.querySelector(".veil")).visibility};
"""


def red_after(window, interrupt, what):
    """How long after `interrupt()` the page says by its own clock that there is no shape, ms; and that none is drawn."""
    check(window.run("return document.body.classList.contains('valid');"), f"before: the page says {window.said()}")
    wall_ms = time.time() * 1000
    interrupt()
    window.wait("document.body.classList.contains('silent')", f"red after {what}", 5)
    states = window.run("return tubedView.counts.states;")
    red_ms = next(state["wall"] for state in states if state["wall"] >= wall_ms - 1 and state["class"] == "none") - wall_ms
    drawn = window.run(NOTHING_DRAWN)
    check(drawn == {"teal": 0, "veil": "visible"}, f"after {what} the page still shows a tube: {drawn}")
    words = window.said()
    say(f"{what}: red after {red_ms:.0f} ms, \"{words[2]}\"")
    return red_ms


def a_daemon_or_viewer_that_dies_or_hangs_is_red_within_300_ms(bed):
    daemon, _ = bed.tracked(with_previews(bed))
    process = view(bed)
    window = page(bed)
    valid = "document.body.classList.contains('valid')"
    delays = {}
    for who, pid in (("daemon", daemon.process.pid), ("viewer", process.pid)):
        delays[f"SIGSTOP of the {who}"] = red_after(window, lambda pid=pid: os.kill(pid, signal.SIGSTOP), f"SIGSTOP of the {who}")
        os.kill(pid, signal.SIGCONT)
        window.wait(valid, f"VALID after the {who} goes on", 10)
        time.sleep(1)
    delays["SIGKILL of the viewer"] = red_after(window, lambda: os.kill(process.pid, signal.SIGKILL), "SIGKILL of the viewer")
    process.wait()
    view(bed)
    window.wait(valid, "VALID after the viewer's next start", 10)
    time.sleep(1)
    delays["SIGKILL of the daemon"] = red_after(window, lambda: os.kill(daemon.process.pid, signal.SIGKILL), "SIGKILL of the daemon")
    daemon.process.wait()
    daemon.stop = lambda: 0  # it was killed on purpose
    bed.start_daemon(with_previews(bed))
    window.wait(valid, "VALID after the daemon's next start", 15)
    for what, delay_ms in delays.items():
        check_timing(delay_ms <= 300, f"{what}: red after {delay_ms:.0f} ms, expected at most 300")


def a_page_whose_script_hangs_is_covered(bed):
    """By the browser's compositor, for which no script has to be awake."""
    bed.tracked(with_previews(bed))
    view(bed)
    window = page(bed)
    window.run("setTimeout(() => { window.asleep_at = Date.now(); const until = performance.now() + 4000; while (performance.now() < until); "
               "window.awake_at = Date.now(); }, 1000);")
    frames = window.frames(7)
    asleep, awake = (window.run(f"return window.{name};") / 1000 for name in ("asleep_at", "awake_at"))
    # What stays on the screen while the script stands still. On a slow machine the cover may begin before the script is said to sleep.
    at, png = next(frame for frame in reversed(frames) if frame[0] < awake)
    say(f"the last of {len(frames)} pictures before the script went on came {1000 * (at - asleep):.0f} ms after it had stopped")
    rows = pixels_of(png)
    words = sum(r > 200 and 100 < g < 160 and 100 < b < 160 for row in rows for r, g, b in row)
    check(not bright(rows) and words > 500, f"without a script the page still shows its pictures, or says nothing ({words} pixels of words)")
    window.wait("[...document.querySelectorAll('.cover')].every((cover) => getComputedStyle(cover).opacity === '0')", "the cover goes again", 10)


def resident_kb(process):
    with open(f"/proc/{process.pid}/statm", encoding="ascii") as statm:
        return int(statm.read().split()[1]) * 4


def twenty_tabs_and_a_stalled_one_slow_nobody(bed):
    _, subscriber = bed.tracked(with_previews(bed))
    process = view(bed)
    begin = time.monotonic_ns()
    time.sleep(4)
    alone = beds.longest_gap_ms(subscriber.samples(begin, "cath-1"))
    stalled, tabs = client.Tab(acknowledges=False), [client.Tab() for _ in range(20)]
    client.listen(tabs, 2)
    before_kb = resident_kb(process)
    counts = [(tab.estimates, tab.images) for tab in tabs]
    begin = time.monotonic_ns()
    client.listen(tabs, 6)
    samples = subscriber.samples(begin, "cath-1")
    published = len(subscriber.samples(begin))
    got = [tab.estimates - before for tab, (before, _) in zip(tabs, counts)]
    images = [tab.images - before for tab, (_, before) in zip(tabs, counts)]
    grown_kb = resident_kb(process) - before_kb
    stalled.take()
    say(f"20 tabs got {min(got)} to {max(got)} of {published} samples and {min(images)} to {max(images)} images in 6 s; the stalled one "
        f"{stalled.estimates} samples, {stalled.images} images at all; subscriber {beds.rate_hz(samples):.2f} Hz, longest gap "
        f"{beds.longest_gap_ms(samples):.0f} ms ({alone:.0f} alone); viewer {grown_kb} kB more")
    check(not any(tab.is_closed for tab in tabs), "a tab that takes everything was closed")
    check(stalled.estimates <= 2 * 5 and stalled.images <= 1, "a tab that acknowledges nothing is sent more and more")
    check_timing(min(got) >= 0.9 * published, f"a tab got {min(got)} of {published} samples")
    check_timing(beds.rate_hz(samples) > 28, f"the subscriber has {beds.rate_hz(samples):.1f} Hz beside 20 tabs")
    check_timing(beds.longest_gap_ms(samples) < alone + 70, "the subscriber's gaps grew with the tabs")
    check_timing(grown_kb < 4096, f"the viewer grew by {grown_kb} kB in 6 s beside a stalled tab")


def the_demonstration_in_a_browser_has_buttons_that_break_things(bed):
    need_real_time()
    demo = subprocess.Popen([bed.program("tubectl"), "demo", "--web"], stderr=subprocess.PIPE, text=True, preexec_fn=calm.die_with_parent)
    bed.closing.callback(lambda: (demo.kill(), demo.wait()))
    check(f"open {ADDRESS[:-1]} in a browser" in demo.stderr.readline(), "the demonstration does not say where to look")
    until = time.monotonic() + 10
    while time.monotonic() < until:
        try:
            client.connect().close()
            break
        except OSError:
            time.sleep(0.1)
    window = page(bed)
    check(window.run("return document.querySelector('.watermark').textContent;") == "DEMO", "DEMO does not stand across the picture")
    press = "[...document.querySelectorAll('#demo button')].find((e) => e.textContent === '{}').click();"
    has = "document.body.classList.contains('{}') && document.querySelector('#why').textContent.includes('{}')"
    for button, state, words in (("Break coil 2", "questionable", "a coil is missing"), ("Repair all", "valid", ""),
                                 ("Black images", "questionable", "refused"), ("Repair all", "valid", ""),
                                 ("Fluoroscopy off", "valid", "fluoroscopy is off"), ("Repair all", "valid", ""),
                                 ("Tracker stalls", "none", "tracker sends nothing new")):
        window.run(press.format(button))
        window.wait(has.format(state, words), f"after \"{button}\": {state}, {words}", 12)
    demo.terminate()
    check(demo.wait(10) == 0, f"the demonstration ends with {demo.returncode}")
    check(client_is_gone(), "the page is served although the demonstration has ended")


def client_is_gone():
    try:
        client.connect().close()
        return False
    except OSError:
        return True


if __name__ == "__main__":
    beds.main(the_page_shows_what_the_daemon_publishes, the_tube_is_drawn_where_the_sample_projects,
              a_daemon_or_viewer_that_dies_or_hangs_is_red_within_300_ms, a_page_whose_script_hangs_is_covered,
              twenty_tabs_and_a_stalled_one_slow_nobody, the_demonstration_in_a_browser_has_buttons_that_break_things)
