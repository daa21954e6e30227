"""Files that a room has before anybody types a command, simulated: those that clients/tubectl/examples.md works with."""
import math
import random
import struct

from dicom_runs import element

SEED = 5
EM_HEAD = "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error"
COILS_MM = (10, 130, 230, 331, 431)
# sequence.toml of the straight catheter, whose coils lie 4 mm nearer the tip than it is written down there.
DESCRIPTION = """format = 1
note = "SIMULATED: a catheter in a straight groove"

[catheter]
id = "cath-1"
diameter_mm = 2.33
length_mm = 460.0
sensor_offsets_from_tip_mm = [14.0, 134.0, 234.0, 335.0, 435.0]

[registration]
T_world_em = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

[[camera]]
name = "A"
width = 400
height = 600
fx = 2000.0
fy = 2000.0
cx = 200.0
cy = 300.0
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
T_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, 1]]
"""


def em_row(t_s, frame, sensor, position, tangent):
    """A row of em.csv; the quaternion turns z onto the tangent."""
    w = math.sqrt((1 + tangent[2]) / 2)
    quaternion = (w, -tangent[1] / (2 * w), tangent[0] / (2 * w), 0)
    return (f"{t_s:.4f},{frame},{sensor},OK," + ",".join(f"{x:.6f}" for x in (*position, *tangent)) + ","
            + ",".join(f"{x:.9f}" for x in quaternion) + ",0.1")


def unit(v):
    length = math.hypot(*v)
    return [x / length for x in v]


def write_probe(path):
    """The tip stands still at (20, -10, -150) of the tracker's frame, 50 mm ahead of the coil, while the probe goes round a cone of 35 degrees; noise 0.3 mm."""
    drawn, rows = random.Random(SEED), [EM_HEAD]
    for k in range(800):
        turn, lean = 2 * math.pi * k / 200, math.radians(35) * (0.4 + 0.6 * k / 800)
        along = [math.sin(lean) * math.cos(turn), math.sin(lean) * math.sin(turn), math.cos(lean)]
        position = [tip - 50 * a + drawn.gauss(0, 0.3) for tip, a in zip((20, -10, -150), along)]
        rows.append(em_row(k / 40, k, 1, position, unit([a + drawn.gauss(0, 0.003) for a in along])))
    path.write_text("\n".join(rows) + "\n")


def write_still(folder, description=DESCRIPTION, coils_mm=COILS_MM, seed=SEED + 1):
    """Coils, so far from the tip, in a straight groove for 20 s, tip at (20, -10, -150) of the tracker's frame; noise 0.3 mm."""
    folder.mkdir()
    (folder / "sequence.toml").write_text(description)
    (folder / "frames.csv").write_text("frame,t_s,camera,file\n1,0.0,A,\n")
    drawn, rows, away = random.Random(seed), [EM_HEAD], (0.6, 0.0, -0.8)
    for k in range(800):
        for sensor, s_mm in enumerate(coils_mm, start=1):
            position = [tip + s_mm * a + drawn.gauss(0, 0.3) for tip, a in zip((20, -10, -150), away)]
            rows.append(em_row(k / 40, k, sensor, position, unit([-a + drawn.gauss(0, 0.003) for a in away])))
    (folder / "em.csv").write_text("\n".join(rows) + "\n")


def write_markers(folder):
    """Seven markers, and the tracker's frame turned by 30 degrees about z; touches err by 0.3 mm an axis."""
    drawn = random.Random(SEED + 2)
    world, touched = ["name,x,y,z"], ["name,x,y,z"]
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    for i in range(1, 8):
        x, y, z = drawn.uniform(-90, 90), drawn.uniform(-60, 60), drawn.uniform(-200, 40)
        world.append(f"M{i},{x:.3f},{y:.3f},{z:.3f}")
        there = (c * x + s * y - 40, c * y - s * x + 15, z + 120)
        touched.append(f"M{i}," + ",".join(f"{v + drawn.gauss(0, 0.3):.3f}" for v in there))
    (folder / "markers.csv").write_text("\n".join(world) + "\n")
    (folder / "touched.csv").write_text("\n".join(touched) + "\n")


def write_angiogram(path):
    """One image of an isocentric C-arm, LAO 40, cranial 10, detector of 1024 pixels of 0.2 mm."""
    short = lambda value: struct.pack("<H", value)
    meta = element(2, 0x10, b"UI", b"1.2.840.10008.1.2.1")
    body = (element(8, 0x60, b"CS", b"XA") + element(0x10, 0x10, b"PN", b"Nobody") + element(0x18, 0x1110, b"DS", b"1100")
            + element(0x18, 0x1111, b"DS", b"750") + element(0x18, 0x1162, b"DS", b"30") + element(0x18, 0x1164, b"DS", b"0.2\\0.2")
            + element(0x18, 0x1510, b"DS", b"40") + element(0x18, 0x1511, b"DS", b"10") + element(0x28, 2, b"US", short(1))
            + element(0x28, 4, b"CS", b"MONOCHROME2") + element(0x28, 0x10, b"US", short(1024)) + element(0x28, 0x11, b"US", short(1024))
            + element(0x28, 0x100, b"US", short(16)) + element(0x28, 0x101, b"US", short(12)) + element(0x28, 0x102, b"US", short(11))
            + element(0x28, 0x103, b"US", short(0)))
    path.write_bytes(bytes(128) + b"DICM" + element(2, 0, b"UL", struct.pack("<I", len(meta))) + meta + body
                     + element(0x7FE0, 0x10, b"OW", bytes(2 * 1024 * 1024)))


def write_tip(file):
    """Points every 2.5 mm along a tip of 8 mm straight, 12 mm of radius 9, 40 mm straight, 30 mm of radius 25 the other way; shaking by 0.1 mm."""
    noise = random.Random(4)
    arcs, shaft_mm, step_mm = ((8, 0), (12, 1 / 9), (40, 0), (30, -1 / 25)), 30, 2.5
    x, y, heading, rows = 0.0, 0.0, 0.4, []
    s_mm, next_mm, dense_mm = 0.0, 0.0, 0.01
    for length_mm, curvature in (*arcs, (shaft_mm, 0)):
        for _ in range(round(length_mm / dense_mm)):
            if s_mm >= next_mm - 1e-6:
                rows.append(f"{x + noise.gauss(0, 0.1):.2f},{y + noise.gauss(0, 0.1):.2f}")
                next_mm += step_mm
            x, y = x + dense_mm * math.cos(heading), y + dense_mm * math.sin(heading)
            heading += dense_mm * curvature
            s_mm += dense_mm
    file.write_text("x_mm,y_mm\n" + "\n".join(rows) + "\n")


def write_all(folder):
    write_tip(folder / "jl.csv")
    write_probe(folder / "probe.csv")
    write_still(folder / "still")
    write_markers(folder)
    write_angiogram(folder / "angiogram.dcm")
