#!/usr/bin/env python3
"""From a cable to a shape in an afternoon, at a running daemon: an emulated Aurora with a catheter and a probe, a simulated
C-arm with its grabber, and tubectl's verbs in the order of the page. The tracker's motion and the pictures are simulated;
lines, topics, shared memory and files are those of a real room."""
import csv
import math
import random
import re
import subprocess
import time

import bed as beds
import calm
import example_files
from afternoon import LATE_MS, SEED, WORSE_BY, inverse, matrix_of, offsets_of, rms_with, run, wrong_room
from bed import check, check_timing, reasons_of, say
from shared_memory import Grabber

PROBE_TIP_MM = 52.0  # ahead of its coil
PROBE = 6  # its sensor: the catheter has 1 to 5
RATE_HZ = 40
PLAYED_HZ = 200  # the emulated tracker takes the newest row: this is what its measurements are late by at most
HOLD_S, MOVE_S = 4.0, 1.0  # at a marker, to the next one
NOISE_MM = 0.2
START_IN_S = 6  # until then the daemon has found the tracker, and the pictures are decoded


class Tracker:
    """An emulated Aurora at the room's port that plays a folder."""

    def __init__(self, bed, folder, *options):
        self.bed, self.port = bed, bed.folder / "aurora"
        command = [bed.program("tubectl"), "aurora-emulator", "--play", str(folder), "--link", str(self.port), *options]
        self.process = beds.Daemon(command, bed.folder / f"tubed-{folder.name}.log")
        bed.daemons.append(self.process)
        until = time.monotonic() + 5 * beds.TIME_FACTOR
        while not self.port.exists() and time.monotonic() < until:
            time.sleep(0.005)

    def unplugged(self):
        self.process.stop()
        self.bed.daemons.remove(self.process)


def row_of(t_s, frame, sensor, p_mm, along, drawn):
    noisy = [x + drawn.gauss(0, NOISE_MM) for x in p_mm]
    return example_files.em_row(t_s, frame, sensor, noisy, example_files.unit([a + drawn.gauss(0, 0.003) for a in along]))


def write_played(folder, description, rows):
    """A folder of coils alone; the probe is one coil more of the catheter that it describes."""
    folder.mkdir()
    text = re.sub(r"sensor_offsets_from_tip_mm = \[(.*?)\]", r"sensor_offsets_from_tip_mm = [\1, 375.0]", description, count=1)
    check(text != description, "sequence.toml has no arc lengths")
    (folder / "sequence.toml").write_text(text)
    (folder / "frames.csv").write_text("frame,t_s,camera,file\n1,0.0,A,\n")
    (folder / "em.csv").write_text("\n".join([example_files.EM_HEAD, *rows]) + "\n")


def leaning(turn_deg, lean_deg):
    turn, lean = math.radians(turn_deg), math.radians(lean_deg)
    return [math.sin(lean) * math.cos(turn), math.sin(lean) * math.sin(turn), math.cos(lean)]


def before(tip_mm, along):
    return [tip - PROBE_TIP_MM * a for tip, a in zip(tip_mm, along)]


def still_rows(offsets_mm, drawn):
    """The catheter in a groove, the probe beside it, for 20 s."""
    away, rows = (0.6, 0.0, -0.8), []
    for k in range(20 * RATE_HZ):
        for sensor, s_mm in enumerate(offsets_mm, start=1):
            rows.append(row_of(k / RATE_HZ, k, sensor, [tip + s_mm * a for tip, a in zip((20, -10, -150), away)], [-a for a in away], drawn))
        rows.append(row_of(k / RATE_HZ, k, PROBE, (60, 40, -160), (0, 0, 1), drawn))
    return rows


def pivot_rows(drawn):
    """The probe goes round about its resting tip, 20 s."""
    rows = []
    for k in range(20 * RATE_HZ):
        along = leaning(360 * k / 160, 35 * (0.4 + 0.6 * k / 800))
        rows.append(row_of(k / RATE_HZ, k, PROBE, before((20, -10, -150), along), along, drawn))
    return rows


def touch_rows(touched_mm, drawn):
    """The probe's tip rests on one place after the other, and goes straight to the next."""
    leans = [leaning(drawn.uniform(0, 360), drawn.uniform(5, 30)) for _ in touched_mm]
    rows, k = [], 0
    for i, here in enumerate(touched_mm):
        following = touched_mm[(i + 1) % len(touched_mm)]
        for j in range(round((HOLD_S + MOVE_S) * RATE_HZ)):
            there = max(0.0, (j / RATE_HZ - HOLD_S) / MOVE_S)
            tip_mm = [a + there * (b - a) for a, b in zip(here, following)]
            along = example_files.unit([a + there * (b - a) for a, b in zip(leans[i], leans[(i + 1) % len(leans)])])
            rows.append(row_of(k / RATE_HZ, k, PROBE, before(tip_mm, along), along, drawn))
            k += 1
    return rows


def moving_rows(em_file):
    """The coils of a run, five times as dense by straight lines between measurements, as a tracker would have taken them at
    any time."""
    columns = ("x", "y", "z", "tx", "ty", "tz")
    with open(em_file, encoding="utf-8", newline="") as file:
        measured = list(csv.DictReader(file))
    by_sensor = {}
    for row in measured:
        by_sensor.setdefault(int(row["sensor"]), []).append((float(row["t_s"]), row["status"], [float(row[c]) for c in columns]))
    rows = []
    for sensor, places in by_sensor.items():
        for (t_s, status, here), (next_s, next_status, following) in zip(places, places[1:]):
            if status != "OK" or next_status != "OK":
                continue
            for j in range(PLAYED_HZ // RATE_HZ):
                share = j * RATE_HZ / PLAYED_HZ
                at = [a + share * (b - a) for a, b in zip(here, following)]
                rows.append((t_s + share * (next_s - t_s), sensor, at[:3], example_files.unit(at[3:])))
    rows.sort(key=lambda row: row[:2])
    frames = {t_s: number for number, t_s in enumerate(dict.fromkeys(row[0] for row in rows))}
    return [example_files.em_row(t_s, frames[t_s], sensor, p_mm, along) for t_s, sensor, p_mm, along in rows]


def live_room(bed, text):
    """The room of a recording as the daemon reads it from devices; the probe is an instrument of its own."""
    ports = "".join(f"    [[instrument.coil]]\n    sensor = {sensor}\n    offset_from_tip_mm = {offset_mm}\n    port = {(sensor + 1) // 2}\n"
                    f"    channel = {(sensor + 1) % 2}\n\n" for sensor, offset_mm in enumerate(offsets_of(text), 1))
    text = text.split("    [[instrument.coil]]")[0] + ports
    text = re.sub(r"\[replay\].*?\n\n", "", text, flags=re.DOTALL)
    head, camera = text.split("[[camera]]")
    head = head.replace("driver = 'replay'", f"driver = 'aurora-serial'\ndevice = '{bed.folder}/aurora'")
    camera = camera.replace("driver = 'replay'", f"driver = 'image_shm'\ndevice = '{bed.folder}/image-A.sock'")
    head = head.replace("[dds]\n", "[dds]\nnetwork_interface = 'lo'\n")
    return (head + "[[camera]]" + camera + "[[instrument]]\nid = 'probe'\nmode = 'em'\nlength_mm = 60.0\n\n    [[instrument.coil]]\n"
            f"    sensor = {PROBE}\n    offset_from_tip_mm = {PROBE_TIP_MM}\n    port = 3\n    channel = 1\n")


class Room:
    """The daemon's configuration, which the verbs write into, and the daemon that reads it."""

    def __init__(self, bed, text):
        self.bed = bed
        self.file = bed.write("room.toml", text)
        self.accept = ("--config", str(self.file), "--yes")
        self.daemon = None

    def number(self, key):
        return float(re.search(key + r" = (-?[\d.]+)", self.file.read_text()).group(1))

    def daemon_starts(self):
        if self.daemon:
            check(self.daemon.stop() == 0, "the daemon did not end well")
            self.bed.daemons.remove(self.daemon)
        self.daemon = beds.Daemon([self.bed.program("tubed"), "--config", str(self.file)], self.bed.folder / "tubed-room.log")
        self.bed.daemons.append(self.daemon)

    def tracked(self, instrument="cath-1"):
        """Waits until measurements of the instrument come."""
        subscriber = self.bed.subscribe("--instrument", instrument)
        subscriber.wait_for(lambda line: "reason_names" in line and "EM_STALE" not in reasons_of(line), f"coils of {instrument}", 40)
        subscriber.stop()


def touch_markers(bed, room, names, begins_ns):
    """A person names each marker while the probe's tip is on it."""
    command = [bed.program("tubectl"), "register", "--markers", str(bed.folder / "markers.csv"), "--live", "--instrument", "probe", "--tip-offset-file",
               str(bed.folder / "tip.toml"), "--out-touched", str(bed.folder / "touched.csv"), "--report", str(bed.folder / "registration.svg"), *room.accept]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          preexec_fn=calm.die_with_parent) as process:
        first = math.ceil((time.monotonic_ns() - begins_ns) * 1e-9 / (HOLD_S + MOVE_S)) + 1
        for i in range(len(names)):
            at_ns = begins_ns + int((first + i) * (HOLD_S + MOVE_S) * 1e9)
            time.sleep(max(0.0, (at_ns - time.monotonic_ns()) * 1e-9) + 0.2)
            process.stdin.write(names[(first + i) % len(names)] + "\n")
            process.stdin.flush()
        time.sleep(HOLD_S)
        process.stdin.write("q\n")
        words = process.communicate(timeout=30)[0]
    check(process.returncode == 0, f"register exits {process.returncode}: {words}")
    return words


def pictures_and_coils_come(bed, folder, moving):
    """Tracker and grabber begin the run together; when that is, CLOCK_MONOTONIC in ns."""
    start_ns = time.monotonic_ns() + START_IN_S * 1_000_000_000
    # Before its first row the emulated tracker shows that row.
    Tracker(bed, moving, "--epoch-ns", str(start_ns))
    Grabber(bed, folder, "--start-monotonic-ns", str(start_ns))
    return start_ns


def in_the_groove(bed, room, description, true_offsets, drawn):
    still = bed.folder / "still"
    write_played(still, description, still_rows(true_offsets, drawn))
    tracker = Tracker(bed, still)
    said = bed.tubectl("doctor", "--tracker", "--config", str(room.file)).stdout  # it may find fault with this machine
    check(all(word in said for word in ("port 1", "port 3")), f"doctor does not name the plugs: {said}")
    room.daemon_starts()
    room.tracked()
    run(bed, "calibrate", "noise", "--seconds", "10", "--field-mm", "1.0", "--instrument", "cath-1", *room.accept)
    run(bed, "calibrate", "coils", "--seconds", "10", "--instrument", "cath-1", "--tip-beyond", true_offsets[0], *room.accept)
    found_offsets = offsets_of(room.file.read_text())[:5]
    say(f"arc lengths {found_offsets}, true {true_offsets}")
    check(all(abs(a - b) < 1 for a, b in zip(found_offsets, true_offsets)), "arc lengths are off by more than 1 mm")
    tracker.unplugged()


def with_the_probe(bed, room, description, T_world_em, drawn):
    pivot = bed.folder / "pivot"
    write_played(pivot, description, pivot_rows(drawn))
    tracker = Tracker(bed, pivot)
    room.tracked("probe")
    run(bed, "pivot", "--live", "--instrument", "probe", "--seconds", "20", "--out", bed.folder / "tip.toml")
    tracker.unplugged()

    markers_mm = [[drawn.uniform(-90, 90), drawn.uniform(-60, 60), drawn.uniform(-200, 40)] for _ in range(7)]
    names = [f"M{i}" for i in range(len(markers_mm))]
    (bed.folder / "markers.csv").write_text("name,x,y,z\n" + "".join(f"{name},{x:.4f},{y:.4f},{z:.4f}\n" for name, (x, y, z) in zip(names, markers_mm)))
    touch = bed.folder / "touch"
    write_played(touch, description, touch_rows([[x + drawn.gauss(0, 0.2) for x in inverse(T_world_em, p)] for p in markers_mm], drawn))
    begins_ns = time.monotonic_ns()
    tracker = Tracker(bed, touch, "--epoch-ns", str(begins_ns))
    room.tracked("probe")
    touch_markers(bed, room, names, begins_ns)
    tracker.unplugged()


def at_four_angles(bed, room, true_room):
    said = run(bed, "calibrate", "phantom", "--config", true_room, "--camera", "A", "--out", bed.folder / "phantom").stdout
    pitch = re.search(r"--pitch ([\d.]+)", said).group(1)
    images = sorted((bed.folder / "phantom").glob("image-*.png"))
    angles = (bed.folder / "phantom" / "angles.txt").read_text().strip()
    run(bed, "calibrate", "camera", *images, "--phantom", bed.folder / "phantom" / "phantom.toml", "--camera", "A", "--pitch", pitch, "--angles", angles, *room.accept)
    check("[camera.c_arm]" in room.file.read_text(), "the C-arm's model is not in the configuration")


def the_clock(bed, room, folder, description):
    moving = bed.folder / "moving"
    write_played(moving, description, moving_rows(folder / "em.csv"))
    room.daemon_starts()
    start_ns = pictures_and_coils_come(bed, folder, moving)
    with open(folder / "frames.csv", encoding="utf-8", newline="") as frames:
        lasts_s = max(float(row["t_s"]) for row in csv.DictReader(frames))
    time.sleep((start_ns - time.monotonic_ns()) * 1e-9)
    record = run(bed, "record", bed.folder / "to-and-fro", "--seconds", f"{lasts_s - 0.5:.1f}", "--instrument", "cath-1", "--config", room.file,
                 timeout_s=lasts_s + 60)
    say(record.stderr.strip().splitlines()[-2])
    done = run(bed, "calibrate", "time", bed.folder / "to-and-fro", *room.accept)
    found_ms, sigma_ms = room.number("time_offset_ms"), room.number("time_offset_sigma_ms")
    say(f"images are {found_ms} ms late, sigma {sigma_ms} ms; {LATE_MS} ms are true")
    check_timing(abs(found_ms - LATE_MS) < 5 + 2 * sigma_ms, f"the clock: {done.stdout}")
    run(bed, "check", bed.folder / "to-and-fro", "--config", room.file)


def an_afternoon_at_a_running_daemon(bed):
    folder = bed.folder / "run"
    run(bed, "simulate", "--preset", "to-and-fro", "--seed", SEED, "--every", "2", "--mistake", f"clock={LATE_MS}", "--out", folder, timeout_s=200)
    description = (folder / "sequence.toml").read_text()
    true_text = run(bed, "configure", folder).stdout
    true_room = bed.write("true.toml", re.sub(r"(\[\[camera\]\]\n)", rf"\1time_offset_ms = {LATE_MS}.0\n", true_text, count=1))
    room = Room(bed, live_room(bed, wrong_room(true_text)))
    drawn = random.Random(SEED + 10)

    in_the_groove(bed, room, description, offsets_of(true_text), drawn)
    with_the_probe(bed, room, description, matrix_of(true_text, "T_world_em"), drawn)
    at_four_angles(bed, room, true_room)
    the_clock(bed, room, folder, description)

    true_mm = rms_with(bed, folder, true_room, "true")
    found_mm = rms_with(bed, folder, room.file, "found")
    say(f"RMS in view, median: {true_mm:.2f} mm with the true numbers, {found_mm:.2f} mm with those that were found")
    check(found_mm < WORSE_BY * true_mm, f"{found_mm} mm with what was found, {true_mm} mm with the true numbers")


if __name__ == "__main__":
    beds.main(an_afternoon_at_a_running_daemon)
