#!/usr/bin/env python3
"""From a bare Debian 12 to the first picture, as README.md says it: how long each step takes, and whether the picture is one.

  first_picture.py SOURCES FOLDER     FOLDER keeps the bare root as a tarball; 77 when this machine cannot make one
"""
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import time
import xml.etree.ElementTree as xml

from bare_root import BareRoot, Skip, first_inside, need
from phases import Missing, Phases, Table

SKIP = 77
TREE = "root/tubed"
FIRST = "./run demo --headless 5 --picture first.svg --json out.json"
WEB = "./run demo --web"
PAGE = ("127.0.0.1", 8080)
# Of processor for configuring and compiling, where a run of today takes 290 (README.md): this is how a demonstration that
# compiles what it does not need is noticed on a machine that others use as well.
MAX_PROCESSOR_S = 400
WEB_TIMEOUT_S = 1800


class Failure(Exception):
    """What was expected and what came instead."""


def check(condition, message):
    if not condition:
        raise Failure(message)


def say(message):
    print(message, flush=True)


def clone(sources, root):
    """The committed state, as `git clone` gives it."""
    need("git", "git")
    git = ["git", "-c", "safe.directory=*"]
    revision = subprocess.run([*git, "-C", sources, "rev-parse", "HEAD"], capture_output=True, text=True, check=False)
    if revision.returncode != 0:
        raise Skip(f"{sources} is no clone of a repository: {revision.stderr.strip()}")
    changed = subprocess.run([*git, "-C", sources, "status", "--porcelain"], capture_output=True, text=True, check=True).stdout
    if changed:
        say(f"not part of this test, because it is not committed:\n{changed.rstrip()}")
    subprocess.run([*git, "clone", "-q", "--no-hardlinks", sources, str(root / TREE)], check=True)
    subprocess.run([*git, "-C", str(root / TREE), "checkout", "-q", revision.stdout.strip()], check=True)
    return revision.stdout.strip()[:7]


def follow(root, command, until=None):
    """Runs it inside and prints what it says; its phases, when it has ended or when `until` (asked four times a second) says so."""
    phases = Phases()
    process = root.start(command, f"/{TREE}", stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    os.set_blocking(process.stdout.fileno(), False)
    began = time.monotonic()
    while True:
        piece = process.stdout.read()
        if piece:
            phases.hear(piece, first_inside(process))
        if piece == b"" or (until and until()):
            break
        check(not until or time.monotonic() < began + WEB_TIMEOUT_S, f"no answer of the page within {WEB_TIMEOUT_S} s:\n{phases.tail()}")
        time.sleep(0.02 if not until else 0.25)
    return phases, process


def tube_in(picture):
    """The lines of the tubes in this SVG: how many points each has."""
    drawing = xml.parse(picture).getroot()
    check(drawing.tag.endswith("}svg"), f"{picture} is a {drawing.tag}")
    lines = [element.get("points") or element.get("d") or "" for element in drawing.iter() if re.search(r"\}(polyline|path)$", element.tag)]
    return sorted(len(re.findall(r"-?[\d.]+[ ,]-?[\d.]+", line)) for line in lines)


def judge_picture(tree):
    picture = tree / "first.svg"
    check(picture.exists(), "there is no first.svg")
    points = tube_in(picture)
    # A tube is a curve: each of truth, coils and fused shape in the view and from the side.
    check(sum(count >= 30 for count in points) >= 2, f"no tube in first.svg; its lines have {points} points")
    words = " ".join(element.text or "" for element in xml.parse(picture).getroot().iter())
    report = json.loads((tree / "out.json").read_text(encoding="utf-8"))
    valid = report["validity"].get("VALID", 0)
    check(valid > 0, f"validity {report['validity']}")
    check(report["rms_mm"]["fused"] is not None, f"no image was fused: {report['rms_mm']}")
    say(f"picture: {picture.stat().st_size // 1024} KB, lines of up to {points[-1]} points; {valid} VALID shapes at "
        f"{report['rate_hz']:.1f} Hz, RMS error {report['rms_mm']['fused']:.2f} mm\n{words.strip()[:200]}")


def first_picture(root, table):
    before = root.packages()
    phases, process = follow(root, FIRST)
    code = process.wait()
    phases.end("picture")
    check(code == 0, f"`{FIRST}` exits {code}:\n{phases.tail()}")
    phases.need("installing", "configuring", "compiling", "starting", "first VALID", "picture")
    judge_picture(root.root / TREE)
    table.add(f"`{FIRST}`", phases, root.packages() - before, "picture")
    return phases


def ask(request):
    """The first 64 KB of the page's answer, or what came within two seconds; nothing when nobody listens."""
    answer = b""
    try:
        with socket.create_connection(PAGE, 2) as connection:
            connection.sendall(request.replace("\n", "\r\n").encode())
            while len(answer) < 65536 and (piece := connection.recv(65536)):
                answer += piece
    except OSError:
        pass  # nobody listens, or no more came
    return answer


def page():
    return ask(f"GET / HTTP/1.1\nHost: {PAGE[0]}:{PAGE[1]}\nConnection: close\n\n")


def stream():
    return ask(f"GET /stream HTTP/1.1\nHost: {PAGE[0]}:{PAGE[1]}\nUpgrade: websocket\nConnection: Upgrade\n"
               f"Origin: http://{PAGE[0]}:{PAGE[1]}\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\nSec-WebSocket-Version: 13\n\n")


def in_a_browser(root, table):
    check(page() == b"", f"somebody listens at {PAGE[0]}:{PAGE[1]} before the demonstration does")
    before = root.packages()
    phases, process = follow(root, WEB, until=lambda: page().startswith(b"HTTP/1.1 200"))
    phases.end("page")
    try:
        check(process.poll() is None, f"`{WEB}` has ended:\n{phases.tail()}")
        check(b"<title>" in page(), f"no page: {page()[:300]}")
        answer = stream()
        # RFC 6455, section 1.3: what this key has to be answered with.
        check(answer.startswith(b"HTTP/1.1 101") and b"s3pPLMBiTxaQ9kYGzzhZRbK+xOo=" in answer, f"no stream: {answer[:300]}")
        check(len(answer) > 1000, f"the stream brings nothing: {len(answer)} bytes in 2 s")
        os.kill(first_inside(process), signal.SIGINT)
        check(process.wait(20) == 0, f"after Ctrl-C it exits {process.returncode}:\n{phases.tail()}")
    finally:
        process.kill()
        process.wait()
    table.add(f"`{WEB}` after it", phases, root.packages() - before, "page")
    return phases


def main(sources, folder):
    with BareRoot(folder) as root:
        revision = clone(sources, root.root)
        table = Table(root.packages())
        try:
            first = first_picture(root, table)
            in_a_browser(root, table)
        finally:
            say(f"\n{table.text()}\nrevision {revision}")
    used = first.processor_s("configuring") + first.processor_s("compiling")
    check(used < MAX_PROCESSOR_S, f"configuring and compiling took {used:.0f} s of processor, at most {MAX_PROCESSOR_S} s")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    try:
        main(str(pathlib.Path(sys.argv[1]).resolve()), sys.argv[2])
    except Skip as missing:
        say(f"SKIPPED: {missing}")
        sys.exit(SKIP)
    except (Failure, Missing) as failure:
        say(f"FAILED: {failure}")
        sys.exit(1)
    say("passed")
