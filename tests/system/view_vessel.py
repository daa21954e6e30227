#!/usr/bin/env python3
"""tubed-view: a vessel's surface and registration points in the page."""
import base64
import math
import random
import re
import subprocess
import time

import bed as beds
import browser as browsers
import recording_view as recordings
import view
import view_client as client
import vtp_files as vtp
from bed import check, check_timing, say

POINT = (0x7c, 0xc0, 0xff)  # as clients/view/page draws registration points; lit, so darker, not of another hue

READ_ALL = """
  const {read_vessel} = await import("/vessel.js");
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const answers = [];
  for (const [kind, text] of arguments[0]) {
    const begin = performance.now();
    try {
      const {positions, normals, axes} = await read_vessel(bytes(text), kind);
      answers.push({corners: [...positions], normals: normals.length, axes});
    } catch (error) {
      answers.push({words: error.message, kind: error.constructor.name});
    }
    answers.at(-1).ms = performance.now() - begin;
  }
  return answers;
"""


def read_in(window, files):
    """What the page's reader makes of these (kind, bytes)."""
    return window.run(READ_ALL, [(kind, base64.b64encode(data).decode()) for kind, data in files])


def triangles_in(answer):
    check("corners" in answer, f"it is refused: {answer.get('words')}")
    corners = answer["corners"]
    points = [tuple(corners[i:i + 3]) for i in range(0, len(corners), 3)]
    return vtp.turned([tuple(points[i:i + 3]) for i in range(0, len(points), 3)])


def lone_page(bed, *arguments):
    """A viewer without a daemon, and a browser at its page."""
    process = view.view(bed, *arguments)
    window = browsers.Browser(1000, 700)
    bed.closing.callback(window.close)
    window.open(view.ADDRESS)
    window.wait("window.tubedView", "the page", 20)
    return process, window


def in_file(bed, name, data):
    (bed.folder / name).write_bytes(data)
    return str(bed.folder / name)


def every_encoding_of_a_vessel_is_read_as_the_same_triangles(bed):
    _, window = lone_page(bed)
    whole, strips = vtp.prism(), vtp.prism_of_strips()
    wanted = vtp.triangles_of(whole)
    check(wanted == vtp.triangles_of(strips) and len(wanted) == 24, "the test's own two surfaces differ")
    halves = (whole._replace(polys=whole.polys[:4]), vtp.Surface([], [], []), whole._replace(polys=whole.polys[4:]))
    cases = [(encoding, name, surfaces) for encoding in vtp.encodings() for name, surfaces in (("polygons", [whole]), ("a strip", [strips]), ("three pieces", halves))]
    answers = read_in(window, [("vtp", vtp.Writer(encoding).write(*surfaces)) for encoding, _, surfaces in cases])
    for (encoding, name, _), answer in zip(cases, answers):
        try:
            check(triangles_in(answer) == wanted, "the triangles differ")
        except beds.Failure as failure:
            raise beds.Failure(f"{name}, {encoding}: {failure}") from None
    for name, data in (("binary", vtp.stl(wanted)), ("text", vtp.text_stl(wanted))):
        check(triangles_in(read_in(window, [("stl", data)])[0]) == wanted, f"{name} STL: the triangles differ")
    say(f"{len(cases)} files of {len(wanted)} triangles are the same")
    errors = window.errors()
    check(not errors, f"the console has errors: {errors}")


def a_vessel_is_shown_and_turned_to_the_axes_of_the_world(bed):
    """What the viewer serves is what the page draws; of 3D Slicer's files the axes are known."""
    data = vtp.Writer(vtp.Encoding("appended raw", True), axes="LPS").write(vtp.prism())
    process, window = lone_page(bed, "--vessel", in_file(bed, "aorta.vtp", data))
    shown = window.wait("tubedView.now().room.vessel", "the vessel", 10)
    wanted = vtp.triangles_of(vtp.prism())
    low, high = ([pick(corner[axis] for triangle in wanted for corner in triangle) for axis in range(3)] for pick in (min, max))
    check(shown["triangles"] == 24 and shown["low"] == low and shown["high"] == high and not shown["is_turned"], f"shown is {shown}, expected {low} to {high}")
    check(triangles_in({"corners": window.run("return tubedView.vessel_corners();")}) == wanted, "other triangles are drawn than the file has")
    turned = window.run("""
      const {Surroundings} = await import("/surroundings.js");
      const drawn = {set_points() {}, set_vessel(mesh) { this.mesh = mesh; }}, words = document.createElement("p");
      const room = new Surroundings(drawn, words, () => {});
      room.take({vessel: {name: "aorta.vtp", kind: "vtp"}, points: [], axes: ""});
      while (!room.shown) await new Promise((go_on) => setTimeout(go_on, 10));
      room.take({vessel: {name: "aorta.vtp", kind: "vtp"}, points: [], axes: "RAS"});
      return {...room.now().vessel, normal: [...drawn.mesh.normals.slice(0, 3)], position: [...drawn.mesh.positions.slice(0, 3)]};""")
    check(turned["is_turned"] and turned["low"] == [-high[0], -high[1], low[2]], f"in a world of RAS it lies at {turned['low']}")
    outward = (turned["position"][0] + 3.25) * turned["normal"][0] + (turned["position"][1] - 41.5) * turned["normal"][1]
    check(outward > 0, "its normals are not turned with it")
    process.terminate()
    check(process.wait(10) == 0, f"the viewer ends with {process.returncode}")
    # Another file, another start: the open page takes it without being loaded again.
    small = vtp.prism()._replace(points=[[x / 1000 for x in point] for point in vtp.prism().points])
    view.view(bed, "--vessel", in_file(bed, "metres.vtp", vtp.Writer(vtp.Encoding("binary")).write(small)))
    window.wait("tubedView.now().room.trouble.includes('metres')", "a vessel in metres is told", 15)


def broken_files():
    """(name, kind, bytes, words that are told)."""
    whole, points = vtp.prism(), vtp.prism().points
    made = lambda encoding, surface=whole, axes="": vtp.Writer(encoding, axes).write(surface)
    text, inline, coded, raw = (vtp.Encoding(form) for form in ("ascii", "binary", "appended base64", "appended raw"))
    packed, compressed = raw._replace(compressed=True), made(raw._replace(compressed=True))
    with_polys = lambda polys: whole._replace(polys=polys)
    replaced = lambda data, old, new: data.replace(old, new, 1) if old in data else check(False, f"nothing to replace: {old}")
    yield "cut off in the document", "vtp", made(text)[:900], "no complete XML"
    yield "cut off in raw data", "vtp", made(raw)[:-200], "end too early"
    yield "cut off in packed raw data", "vtp", compressed[:-200], "end too early"
    yield "without appended data", "vtp", made(coded).partition(b"<AppendedData")[0] + b"</VTKFile>", "has no AppendedData"
    yield "without an underscore", "vtp", replaced(made(coded), b"   _", b"    "), "no underscore"
    yield "a letter that is no base64", "vtp", re.sub(rb'(Name="Points"[^>]*>\s*..)', rb"\1!", made(inline)), "end too early"
    offset = lambda change: re.sub(rb'(Name="Points"[^>]* offset=")(\d+)', lambda found: found[1] + change(int(found[2])), made(raw))
    yield "an offset beyond the end", "vtp", offset(lambda at: b"999999"), "end too early"
    yield "an offset four bytes off", "vtp", offset(lambda at: b"%d" % (at + 4)), "expected 168"
    yield "an offset that is no number", "vtp", offset(lambda at: b"-%d" % at), "whole number"
    yield "the other header", "vtp", replaced(made(raw), b'"UInt32"', b'"UInt64"'), "expected 168"
    yield "the other byte order", "vtp", replaced(made(raw), b"LittleEndian", b"BigEndian"), "expected 168"
    for form in (text, inline, coded, raw, packed):
        yield f"an index too large, {form.format}", "vtp", made(form, with_polys([[0, 1, 14]])), "names point 14, and there are 14"
        yield f"an index below zero, {form.format}", "vtp", made(form, with_polys([[0, -1, 2]])), "names point -1"
        yield f"a point that is no number, {form.format}", "vtp", made(form, whole._replace(points=[*points[:3], (1, math.nan, 2), *points[4:]])), "point 3 has"
    yield "a point too far for single precision", "vtp", made(raw._replace(points="Float64"), whole._replace(points=[(1e300, 0, 0), *points[1:]])), "point 0 has"
    yield "half an index", "vtp", replaced(made(text), b"6 5 4", b"6 5.5 4"), "names point 5.5"
    yield "offsets that fall", "vtp", replaced(made(text), b"7 14 18", b"7 3 18"), "cannot be: number 1 is 3"
    yield "offsets that are no numbers", "vtp", replaced(made(text), b"7 14 18", b"7 x 18"), "cannot be: number 1 is NaN"
    yield "offsets beyond all bounds", "vtp", replaced(made(text), b"7 14 18", b"7 9999999999999 18"), "cannot be"
    for name in ("Points", "Polys", "Strips"):
        data = made(raw)
        begin = data.index(f'NumberOf{name}="'.encode()) + len(f'NumberOf{name}="')
        yield f"a trillion {name}", "vtp", data[:begin] + b"1000000000000" + data[data.index(b'"', begin):], "coarser surface"
    yield "a number too few", "vtp", replaced(made(text), b"7 14 18", b"7 14"), "expected 9"
    yield "no connectivity", "vtp", made(text).replace(b'Name="connectivity"', b'Name="other"'), "are missing"
    yield "a word of a megabyte", "vtp", replaced(made(text), b"7 14 18", b"7 " + b"1" * (1 << 23)), "expected 9"
    yield "a type that there is not", "vtp", made(text).replace(b'type="Float32" Name="Points"', b'type="Float16" Name="Points"'), "Float16, which is not read"
    yield "points of two coordinates", "vtp", replaced(made(text), b'NumberOfComponents="3"', b'NumberOfComponents="2"'), "expected 3"
    yield "a format that there is not", "vtp", made(text).replace(b'format="ascii"', b'format="hdf"'), "expected ascii, binary or appended"
    yield "another compressor", "vtp", replaced(compressed, b"vtkZLibDataCompressor", b"vtkLZ4DataCompressor"), "LZ4, which is not read: save it with zlib or without compression"
    yield "one more compressor", "vtp", replaced(compressed, b"vtkZLibDataCompressor", b"vtkLZMADataCompressor"), "LZMA, which is not read"
    yield "a grid", "vtp", replaced(made(text), b'"PolyData"', b'"UnstructuredGrid"'), "expected PolyData: extract its surface"
    yield "lines alone", "vtp", made(text, with_polys([])), "no triangle"
    yield "no piece", "vtp", vtp.Writer(text).write(), "no Piece"
    triangles = vtp.triangles_of(whole)
    yield "STL cut off", "stl", vtp.stl(triangles)[:-30], "ends too early"
    yield "STL of a billion triangles", "stl", vtp.stl(triangles)[:80] + b"\xff\xff\xff\x3f" + vtp.stl(triangles)[84:], "ends too early"
    yield "STL with what is no number", "stl", vtp.stl([((1, 2, math.nan), (0, 0, 0), (1, 1, 1))]), "triangle 1 has"
    yield "STL of text cut off", "stl", vtp.text_stl(triangles)[:-200], "endsolid"
    yield "STL of text with a word", "stl", re.sub(rb"vertex \S+", b"vertex x", vtp.text_stl(triangles), count=1), "no finite number"
    yield "STL of nothing", "stl", b"solid \nendsolid\n", "no triangle"


def damaged_blocks():
    """Packed data whose blocks are wrong, and say so only when they are unpacked."""
    def with_blocks(change):
        class Broken(vtp.Writer):
            def array(self, kind, name, numbers, components=1, written=None):
                self.is_points = name == "Points"
                return super().array(kind, name, numbers, components, written)

            def packed(self, data):
                head, blocks = super().packed(data)
                return change(head, blocks, data) if self.is_points else (head, blocks)
        return Broken(vtp.Encoding("appended raw", True, block_bytes=1 << 20)).write(vtp.prism())
    size = lambda head, count: head[:12] + count.to_bytes(4, "little")
    zlib = vtp.zlib
    yield "a damaged block", "vtp", with_blocks(lambda head, blocks, data: (head, blocks[:20] + bytes([blocks[20] ^ 255]) + blocks[21:])), "cannot be unpacked"
    for name, other in (("a block that unpacks to a gigabyte", lambda data: zlib.compress(bytes(1 << 27), 9)), ("a block that unpacks to less", lambda data: zlib.compress(data[:-8]))):
        yield name, "vtp", with_blocks(lambda head, blocks, data, other=other: (size(head, len(other(data))), other(data))), "cannot be unpacked"
    yield "four billion blocks", "vtp", with_blocks(lambda head, blocks, data: (b"\xff\xff\xff\xff" + head[4:], blocks)), "say that they have"
    yield "a block longer than the file", "vtp", with_blocks(lambda head, blocks, data: (size(head, 0xfffffff0), blocks)), "end too early"


def what_is_wrong_with_a_vessel_is_told_in_words(bed):
    _, window = lone_page(bed)
    cases = [*broken_files(), *damaged_blocks()]
    for (name, _, _, words), answer in zip(cases, read_in(window, [(kind, data) for _, kind, data, _ in cases])):
        check(words in answer.get("words", "no words, it is read") and answer["kind"] == "Error", f"{name}: {answer.get('kind')}: {answer.get('words')}, expected: {words}")
        check_timing(answer["ms"] < 2000, f"{name}: told after {answer['ms']:.0f} ms")
    say(f"{len(cases)} broken files are told in words")
    rng = random.Random(7)
    whole = [vtp.Writer(encoding).write(vtp.prism_of_strips()) for encoding in vtp.encodings()]
    answers = read_in(window, [("vtp", damaged(rng.choice(whole), rng)) for _ in range(600)])
    wrong = {answer["words"] for answer in answers if answer.get("kind", "Error") != "Error"}
    check(not wrong, f"damaged files end in errors of the reader itself: {wrong}")
    refused = sum("words" in answer for answer in answers)
    say(f"of {len(answers)} files with damaged bytes {refused} are refused")
    check(200 < refused < 600, "the damage does nothing, or everything")
    # What Chromium puts into a document that is no XML has a style, which the page's policy refuses.
    errors = [words for words in window.errors() if "inline style" not in words]
    check(not errors, f"the console has errors: {errors}")


def damaged(data, rng):
    """Some bytes changed, or a stretch taken out."""
    data = bytearray(data)
    if rng.random() < 0.3:
        at = rng.randrange(len(data))
        del data[at:at + rng.randrange(1, 200)]
    for _ in range(rng.randrange(1, 4)):
        data[rng.randrange(len(data))] = rng.randrange(256)
    return bytes(data)


def what_is_no_vessel_and_no_points_is_refused_at_the_start(bed):
    whole = vtp.Writer(vtp.Encoding("appended raw", True)).write(vtp.prism())
    for option, name, data, words in (("--vessel", "a.vtp", whole[:-30], "does not end with </VTKFile>"),
                                      ("--vessel", "a.vtp", whole.replace(b"vtkZLib", b"vtkLZ4"), "save it with zlib or without compression"),
                                      ("--vessel", "a.vtk", b"# vtk DataFile Version 3.0\nx\nASCII\n", "save it as VTK XML PolyData"),
                                      ("--vessel", "a.stl", vtp.stl(vtp.triangles_of(vtp.prism()))[:-1], "was it cut off"),
                                      ("--vessel", "a.ply", b"ply\nformat ascii 1.0\n", "neither STL nor VTK XML PolyData"),
                                      ("--points", "a.csv", b"name,x,y,z\nM1,1,2\n", "3 fields, the header 4"),
                                      ("--points", "a.csv", b"name,x,y,z\n" + b"".join(b"M%d,1,2,3\n" % i for i in range(501)), "500 are shown at most")):
        done = subprocess.run([bed.program("tubed-view"), option, in_file(bed, name, data)], capture_output=True, text=True, timeout=20, check=False)
        check(done.returncode == 64 and words in done.stderr and name in done.stderr, f"{name}: {done.returncode}, {done.stderr}; expected 64 and: {words}")
    done = subprocess.run([bed.program("tubed-view"), "--vessel", str(bed.folder / "none.vtp")], capture_output=True, text=True, timeout=20, check=False)
    check(done.returncode == 64 and "cannot read" in done.stderr, f"a vessel that is not there: {done.returncode}, {done.stderr}")


def large_sphere(rings=400, sides=500):
    """400000 triangles less the poles': as many as are shown, nearly."""
    points = [(60 * math.sin(math.pi * i / rings) * math.cos(2 * math.pi * k / sides), 60 * math.sin(math.pi * i / rings) * math.sin(2 * math.pi * k / sides),
               60 * math.cos(math.pi * i / rings)) for i in range(rings) for k in range(sides)]
    at = lambda i, k: i * sides + k % sides
    return vtp.Surface(points, [[at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)] for i in range(rings - 1) for k in range(sides)], [])


def a_vessel_that_cannot_be_read_stops_nothing_and_a_large_one_neither(bed):
    bed.tracked(view.with_previews(bed))
    broken = vtp.Writer(vtp.Encoding("appended raw", True)).write(vtp.prism()._replace(polys=[[0, 1, 77]]))
    process = view.view(bed, "--vessel", in_file(bed, "broken.vtp", broken))
    window = view.page(bed)
    said = window.wait("tubedView.now().room.trouble", "what is wrong with the vessel", 10)
    check(said.startswith("vessel broken.vtp: ") and "names point 77" in said, f"the page says: {said}")
    box = window.run("const b = document.querySelector('#room-trouble').getBoundingClientRect(); return [b.width, b.height];")
    check(min(box) > 10, f"what is wrong is not to be seen: {box}")
    look = "const {paints, estimates} = tubedView.counts; return {paints, estimates};"
    before = window.run(look)
    time.sleep(2)
    after = window.run(look)
    check(all(after[what] - before[what] > 10 for what in after), f"in 2 s the counts go from {before} to {after}")
    window.wait("document.body.classList.contains('valid')", "a VALID shape beside what is told", 20)
    process.terminate()
    process.wait(10)
    data = vtp.Writer(vtp.Encoding("appended base64", True, block_bytes=32768)).write(large_sphere())
    view.view(bed, "--vessel", in_file(bed, "large.vtp", data))
    shown = window.wait("tubedView.now().room.vessel", "the large vessel", 60)
    check(shown["triangles"] == 2 * 399 * 500 and not window.run("return tubedView.now().room.trouble;"), f"shown is {shown}")


HELD_UP = """
  let before = performance.now(), held_up = 0;
  const timer = setInterval(() => { const now = performance.now(); held_up = Math.max(held_up, now - before); before = now; }, 1);
  const {read_vessel} = await import("/vessel.js");
  const begin = performance.now(), {positions} = await read_vessel(await (await fetch("/vessel.vtp")).arrayBuffer(), "vtp");
  clearInterval(timer);
  return {held_up, ms: performance.now() - begin, triangles: positions.length / 9};
"""


def reading_a_large_vessel_does_not_hold_the_page_up(bed):
    data = vtp.Writer(vtp.Encoding("appended base64", False)).write(large_sphere())
    view.view(bed, "--vessel", in_file(bed, "large.vtp", data))
    window = browsers.Browser(600, 400)
    bed.closing.callback(window.close)
    window.open(view.ADDRESS + "icon.svg")  # beside the page, which would draw it meanwhile
    read = window.run(HELD_UP)
    say(f"{read['triangles']} triangles of {len(data) / 1e6:.1f} MB are read in {read['ms']:.0f} ms, in pieces of {read['held_up']:.0f} ms at most")
    check(read["triangles"] == 2 * 399 * 500, f"{read['triangles']} triangles")
    check_timing(read["held_up"] < max(250, read["ms"] / 3), f"reading the vessel holds the page up for {read['held_up']:.0f} of {read['ms']:.0f} ms")


# Drawn and taken in one task, before the browser clears what it has shown. A busy page leaves the room out of some frames.
ROOM_PICTURE = """
  for (const key of arguments[0]) dispatchEvent(new KeyboardEvent("keydown", {key}));
  for (let i = 0; i < 3; ++i) tubedView.now();
  const {room} = tubedView.now();
  return {...room, png: document.getElementById("room").toDataURL("image/png").split(",")[1]};
"""
POINTS = {"apex": (0, 0, 0), "L-2": (38, 20, -30), "sternum": (-45, 70, 25), "far": (20, -80, 60)}


def projected(room, p):
    """Where the eye of the page's orbit sees a point, px: a pinhole 0.7 rad high."""
    orbit, (width, height) = room["orbit"], room["canvas"]
    back, up = orbit["back"], orbit["up"]
    right = [up[1] * back[2] - up[2] * back[1], up[2] * back[0] - up[0] * back[2], up[0] * back[1] - up[1] * back[0]]
    up = [back[1] * right[2] - back[2] * right[1], back[2] * right[0] - back[0] * right[2], back[0] * right[1] - back[1] * right[0]]
    d = [x - c for x, c in zip(p, orbit["centre"])]
    along = lambda axis: sum(a * b for a, b in zip(d, axis))
    scale = height / 2 / math.tan(0.35) / (orbit["distance"] - along(back))
    return width / 2 + along(right) * scale, height / 2 - along(up) * scale


def blue(rows):
    """Places of pixels of the points' hue."""
    def is_point(r, g, b):
        return b > 70 and abs(r / b - POINT[0] / POINT[2]) < 0.05 and abs(g / b - POINT[1] / POINT[2]) < 0.05
    return [(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if is_point(*pixel)]


def near(marks, place, within_px):
    return [mark for mark in marks if math.dist(mark, place) < within_px]


def registration_points_are_drawn_where_they_project(bed):
    bed.tracked(view.with_previews(bed))
    csv = "name,x,y,z\n" + "".join(f"{name},{x},{y},{z}\n" for name, (x, y, z) in POINTS.items())
    touched = "name,x,y,z\napex,0,3,16\nelsewhere,1,2,3\n"  # the tracker's frame is the world's in this room
    view.view(bed, "--points", in_file(bed, "points.csv", csv.encode()), "--touched", in_file(bed, "touched.csv", touched.encode()))
    window = view.page(bed, 1100, 800)
    window.wait("tubedView.now().room.points.length === 4", "four points", 10)
    room = window.run(ROOM_PICTURE, ["i", "u"])  # without image and hull
    marks = blue(view.pixels_of(room["png"]))
    for name, p in POINTS.items():
        place = projected(room, p)
        mine = near(marks, (place[0] - 0.5, place[1] - 0.5), 18)
        check(len(mine) > 12, f"{name}: {len(mine)} pixels of its cross around {place}")
        if name == "apex":
            continue  # whose line to where it was touched is there too
        middle = [sum(mark[axis] for mark in mine) / len(mine) + 0.5 for axis in (0, 1)]
        say(f"{name}: {len(mine)} px, {math.dist(middle, place):.2f} px from where it projects")
        check(math.dist(middle, place) < 1.5, f"{name} is drawn at {middle}, expected {place}")
    end = projected(room, (0, 3, 16))
    check(len(near(marks, end, 3)) > 6, f"nothing is drawn where the apex was touched, at {end}")
    labels = {label["name"]: label for label in room["labels"]}
    check(set(labels) == set(POINTS) and labels["apex"]["words"] == "apex, 16.3 mm" and labels["far"]["words"] == "far", f"the names are {labels}")
    check(math.dist(labels["far"]["place"], projected(room, POINTS["far"])) < 0.6, f"the name of far stands at {labels['far']['place']}")
    check("; 4 points" in window.run("return document.querySelector('#room-caption').textContent;"), "the caption does not count them")
    check("registration point" in window.run("return document.querySelector('#legend').textContent;"), "the legend does not name them")
    room = window.run(ROOM_PICTURE, ["p"])
    check(not blue(view.pixels_of(room["png"])) and not room["labels"], "key p does not hide the points")


def of_many_points_those_near_the_pointer_are_named(bed):
    csv = "name,x,y,z\n" + "".join(f"M{i},{10 * i - 60},{(i % 4) * 25 - 40},0\n" for i in range(13))
    _, window = lone_page(bed, "--points", in_file(bed, "points.csv", csv.encode()))
    window.wait("tubedView.now().room.points.length === 13", "13 points", 10)
    hover = """
      const box = document.getElementById("room").getBoundingClientRect();
      document.getElementById("room").dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + arguments[0], clientY: box.top + arguments[1]}));
      for (let i = 0; i < 4; ++i) tubedView.now();
      return tubedView.now().room.labels.map(({name}) => name);"""
    canvas = window.run("return tubedView.now().room.canvas;")
    default = {"orbit": {"centre": [0, 0, 0], "back": [0, 0, 1], "up": [0, 1, 0], "distance": 420}, "canvas": canvas}
    check(window.run(hover, 2, 2) == [], "names stand beside points that nobody points at")
    for i in (0, 6):
        place = projected(default, (10 * i - 60, (i % 4) * 25 - 40, 0))
        check(window.run(hover, *place) == [f"M{i}"], f"beside the pointer stands {window.run(hover, *place)}, expected M{i}")


def a_recording_has_its_vessel_and_points(bed):
    folder = recordings.recorded(bed)
    recordings.shown(bed, folder, "--vessel", in_file(bed, "aorta.vtp", vtp.Writer(vtp.Encoding("binary")).write(vtp.prism())),
                     "--points", in_file(bed, "points.csv", b"name,x,y,z\nM1,1,2,3\n"))
    window = recordings.page(bed)
    check(window.wait("tubedView.now().room.vessel", "the vessel", 10)["triangles"] == 24, "another vessel")
    points = window.run("return tubedView.now().room.points;")
    check(points == [{"name": "M1", "p": [1, 2, 3]}], f"the points are {points}")


if __name__ == "__main__":
    beds.main(every_encoding_of_a_vessel_is_read_as_the_same_triangles, a_vessel_is_shown_and_turned_to_the_axes_of_the_world,
              what_is_wrong_with_a_vessel_is_told_in_words, what_is_no_vessel_and_no_points_is_refused_at_the_start,
              a_vessel_that_cannot_be_read_stops_nothing_and_a_large_one_neither,
              reading_a_large_vessel_does_not_hold_the_page_up, registration_points_are_drawn_where_they_project,
              of_many_points_those_near_the_pointer_are_named, a_recording_has_its_vessel_and_points)
