#!/usr/bin/env python3
"""tubectl check: what a recording and the room that is described for it have to say of each other."""
import json
import re
import time

import bed as beds
import sequences
from bed import check, say

SECONDS = 8


def findings_of(bed, folder):
    done = bed.tubectl("check", str(folder), "--json", "-")
    check(done.returncode in (0, 1), f"tubectl check exits {done.returncode}: {done.stderr}")
    findings = {finding["what"]: finding for finding in json.loads(done.stdout)}
    wrong = sorted(what for what, finding in findings.items() if finding["verdict"] == "WRONG")
    check((done.returncode == 1) == bool(wrong), f"exit {done.returncode} with {wrong}")
    return findings, wrong


def with_mistake(bed, name, pattern, replacement):
    """The same recording with another description."""
    folder = bed.folder / name
    folder.mkdir()
    original = bed.folder / "right"
    for path in original.iterdir():
        (folder / path.name).symlink_to(path)
    (folder / "sequence.toml").unlink()
    text, count = re.subn(pattern, replacement, (original / "sequence.toml").read_text())
    check(count > 0, f"nothing was replaced for {name}")
    (folder / "sequence.toml").write_text(text)
    return folder


def with_a_coil_turned_round(bed, sensor):
    folder = with_mistake(bed, "turned", r"note = .*", 'note = "a coil is mounted backward"')
    (folder / "em.csv").unlink()
    rows = [row.split(",") for row in (bed.folder / "right" / "em.csv").read_text().splitlines()]
    for row in rows[1:]:
        if row[2] == str(sensor):
            row[7:10] = [str(-float(number)) for number in row[7:10]]
    (folder / "em.csv").write_text("".join(",".join(row) + "\n" for row in rows))
    return folder


def operators_mistakes_are_named(bed):
    sequences.write_sequence(bed.folder / "right", SECONDS)
    findings, wrong = findings_of(bed, bed.folder / "right")
    check(not wrong, f"a recording without a mistake: {findings}")
    check(findings["polarity"]["verdict"] == "fine", f"{findings['polarity']}")
    for name, pattern, replacement, what, words in (
            ("registration", r"T_world_em = .*", "T_world_em = [[1,0,0,12],[0,1,0,-9],[0,0,1,0],[0,0,0,1]]", "tube in images", "registration"),
            ("magnification", r"(f[xy]) = 2000.0", r"\1 = 2300.0", "coils and images", "focal length of camera A"),
            ("inverse", r"T_camera_world = .*", "T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,-1200],[0,0,0,1]]", "poses", "T_camera_world takes the world"),
            ("metres", r"T_camera_world = .*", "T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,1.2],[0,0,0,1]]", "poses", "multiply it by 1000")):
        findings, wrong = findings_of(bed, with_mistake(bed, name, pattern, replacement))
        say(f"{name}: {wrong}, {findings[what]['evidence']}: {findings[what]['advice']}")
        check(what in wrong and words in findings[what]["advice"], f"{name} is not named: {findings}")
    findings, wrong = findings_of(bed, with_a_coil_turned_round(bed, 3))
    say(f"coil 3 turned round: {findings['coil directions']}")
    check("coil directions" in wrong and "coil 3 (sensor 3)" in findings["coil directions"]["evidence"], f"it is not named: {findings}")


def findings_while_replayed(bed, folder, more=""):
    """Of a daemon that replays the folder, over its last seconds."""
    done = bed.tubectl("configure", str(folder), "--mode", "filter")
    check(done.returncode == 0, f"tubectl configure exits {done.returncode}: {done.stderr}")
    start_ns = time.monotonic_ns() + int(4 * beds.TIME_FACTOR * 1e9)
    daemon = bed.start_daemon(done.stdout.replace("[replay]", f"[replay]\nstart_monotonic_ns = {start_ns}") + more)
    time.sleep((start_ns - time.monotonic_ns()) * 1e-9 + 1)
    done = bed.tubectl("check", "--for", str(SECONDS - 2), "--json", "-", timeout_s=60)
    check(done.returncode in (0, 1), f"tubectl check exits {done.returncode}: {done.stderr}")
    top = bed.tubectl("top", "--count", "2")
    daemon.stop()
    (findings,) = json.loads(done.stdout).values()
    findings = {finding["what"]: finding for finding in findings}
    wrong = sorted(what for what, finding in findings.items() if finding["verdict"] == "WRONG")
    check((done.returncode == 1) == bool(wrong), f"exit {done.returncode} with {wrong}")
    return findings, wrong, top.stdout


def a_running_room_is_checked_as_a_recording_is(bed):
    done = bed.tubectl("check", "--for", "1")
    check(done.returncode == 69 and done.stderr, f"without a daemon: exit {done.returncode}, {done.stderr!r}")
    sequences.write_sequence(bed.folder / "right", SECONDS)
    findings, wrong, top = findings_while_replayed(bed, bed.folder / "right")
    say(f"as described: {findings['registration']['evidence']}; {findings['clock']['evidence']}")
    check(not wrong, f"a room without a mistake: {findings}")
    check(findings["focal length"]["verdict"] == "fine" and "coils and images agree" in top, f"not compared: {findings}\n{top}")
    large = with_mistake(bed, "magnification", r"(f[xy]) = 2000.0", r"\1 = 2300.0")
    findings, wrong, top = findings_while_replayed(bed, large)
    say(f"focal length 15 % too large: {wrong}: {findings['focal length']}")
    check("focal length" in wrong and "camera A" in findings["focal length"]["advice"], f"it is not named: {findings}")
    check("coils and images disagree" in top and "focal length of camera A" in top, f"tubectl top does not say so:\n{top}")


def a_bright_tube_is_found_by_itself_and_named_where_a_dark_one_is_stated(bed):
    sequences.write_sequence(bed.folder / "negative", SECONDS, image_of=sequences.negative_image)
    findings, wrong = findings_of(bed, bed.folder / "negative")
    say(f"a recording of negatives: {findings['polarity']['evidence']}")
    check(not wrong and "for a bright tube" in findings["polarity"]["evidence"], f"its polarity is not found: {findings}")
    findings, wrong, top = findings_while_replayed(bed, bed.folder / "negative")
    say(f"replayed: {findings['tube in images']}")
    check(not wrong and findings["tube in images"]["verdict"] == "fine", f"images do not show the tube: {findings}")
    check("tubes are bright on its images" in top, f"tubectl top does not say so:\n{top}")
    findings, wrong, _ = findings_while_replayed(bed, bed.folder / "negative", '\n[frangi]\npolarity = "dark"\n')
    say(f"with a dark tube stated: {wrong}: {findings['polarity']['advice']}")
    check("polarity" in wrong, f"it is not named: {findings}")


if __name__ == "__main__":
    beds.main(operators_mistakes_are_named, a_running_room_is_checked_as_a_recording_is,
              a_bright_tube_is_found_by_itself_and_named_where_a_dark_one_is_stated)
