"""Writes a small sequence folder (format 1): a bent catheter that moves, five coils with noise, and its X-ray images."""
import math
import random
import statistics
import struct
import zlib

WIDTH, HEIGHT, FOCAL_PX, DEPTH_MM = 240, 320, 2000.0, 1200.0
LENGTH_MM, RADIUS_MM, DIAMETER_MM = 160.0, 90.0, 2.33
COIL_OFFSETS_MM = (5.0, 40.0, 80.0, 120.0, 155.0)
COIL_NOISE_MM = 0.5
BACKGROUND, CATHETER, PIXEL_NOISE = 170, 120, 8
COIL_RATE_HZ = 30
EXPOSED_AFTER_COILS_S = 0.010  # so that what an image instant uses does not depend on which thread wakes first


def _point(s_mm, t_s):
    """World position and unit tangent toward the tip: an arc of a circle that leans out of the image and swings."""
    angle = (s_mm - LENGTH_MM / 2) / RADIUS_MM
    lean = 0.3 + 0.2 * math.sin(2 * math.pi * t_s / 3)
    x, y = RADIUS_MM * (math.cos(angle) - 0.85), RADIUS_MM * math.sin(angle)
    dx, dy = -math.sin(angle), math.cos(angle)
    shift_mm = 6 * math.sin(2 * math.pi * t_s / 2)
    point = (x * math.cos(lean), y + shift_mm, x * math.sin(lean))
    return point, tuple(-c for c in (dx * math.cos(lean), dy, dx * math.sin(lean)))


def png(pixels, width, height):
    """An 8-bit grey PNG."""
    def chunk(kind, payload):
        body = kind + payload
        return struct.pack(">I", len(payload)) + body + struct.pack(">I", zlib.crc32(body))

    rows = b"".join(b"\0" + bytes(pixels[row * width:(row + 1) * width]) for row in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b""))


def rows_of(picture):
    """The grey levels of a PNG that png() made, row by row."""
    at, packed = 8, b""
    while at < len(picture):
        size, kind = struct.unpack_from(">I", picture, at)[0], picture[at + 4:at + 8]
        body = picture[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height = struct.unpack_from(">II", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    raw = zlib.decompress(packed)
    return [raw[y * (width + 1) + 1:(y + 1) * (width + 1)] for y in range(height)]  # no row is filtered


def _image(t_s, noise, width, height):
    """Darker where the catheter is."""
    normal = statistics.NormalDist(0, PIXEL_NOISE)
    levels = [normal.inv_cdf((byte + 0.5) / 256) for byte in range(256)]
    draws = noise.randbytes(width * height)
    bright = bytes(round(BACKGROUND + level) for level in levels)
    dark = bytes(round(CATHETER + level) for level in levels)
    pixels = bytearray(draws.translate(bright))
    for place in catheter_pixels(t_s, width, height):
        pixels[place] = dark[draws[place]]
    return png(pixels, width, height)


def negative_image(t_s, noise, width, height):
    """Brighter where the catheter is: the same with its grey levels turned round."""
    return png([255 - grey for row in rows_of(_image(t_s, noise, width, height)) for grey in row], width, height)


def catheter_pixels(t_s, width, height, aside_px=0):
    """Places of the pixels that show the catheter, row by row; everything is seen so far aside."""
    places = set()
    for step in range(int(LENGTH_MM * 2) + 1):
        (x, y, z), _ = _point(step / 2, t_s)
        scale = FOCAL_PX / (DEPTH_MM + z)
        column, row, radius = width / 2 + x * scale + aside_px, height / 2 + y * scale, DIAMETER_MM / 2 * scale
        for v in range(max(0, math.ceil(row - radius)), min(height, math.floor(row + radius) + 1)):
            for u in range(max(0, math.ceil(column - radius)), min(width, math.floor(column + radius) + 1)):
                if (u - column) ** 2 + (v - row) ** 2 <= radius ** 2:
                    places.add(v * width + u)
    return places


def _coil_row(t_s, number, sensor, noise):
    point, t = _point(COIL_OFFSETS_MM[sensor - 1], t_s)
    x, y, z = (c + noise.gauss(0, COIL_NOISE_MM) for c in point)
    norm = math.sqrt(2 * (1 + t[2]))
    qw, qx, qy = (1 + t[2]) / norm, -t[1] / norm, t[0] / norm  # turns +z onto the tangent
    return (f"{t_s:.4f},{number},{sensor},OK,{x:.4f},{y:.4f},{z:.4f},{t[0]:.6f},{t[1]:.6f},{t[2]:.6f},"
            f"{qw:.6f},{qx:.6f},{qy:.6f},0,0.5\n")


def write_sequence(folder, seconds, off_frames=(), size=(WIDTH, HEIGHT), image_rate_hz=COIL_RATE_HZ,
                   image_of=None):
    """Coils at 30 Hz and images for so long; fluoroscopy is off at `off_frames`. `image_of`: (time, noise, width, height) to a PNG."""
    width, height = size
    (folder / "images").mkdir(parents=True)
    (folder / "sequence.toml").write_text(
        f'format = 1\nnote = "made by a test"\n[catheter]\nid = "cath-1"\ndiameter_mm = {DIAMETER_MM}\n'
        f'length_mm = {LENGTH_MM}\nsensor_offsets_from_tip_mm = {list(COIL_OFFSETS_MM)}\n'
        "[registration]\nT_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n"
        f'[[camera]]\nname = "A"\nwidth = {width}\nheight = {height}\nfx = {FOCAL_PX}\nfy = {FOCAL_PX}\n'
        f"cx = {width / 2}\ncy = {height / 2}\ndistortion = [0, 0, 0, 0, 0]\n"
        f"T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,{DEPTH_MM}],[0,0,0,1]]\n")
    noise = random.Random(20)
    frames, coils = "frame,t_s,camera,file\n", ("t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n")
    for number in range(int(seconds * COIL_RATE_HZ)):
        t_s = round(number / COIL_RATE_HZ, 4)
        coils += "".join(_coil_row(t_s, number, sensor, noise) for sensor in range(1, len(COIL_OFFSETS_MM) + 1))
    for number in range(int(seconds * image_rate_hz)):
        exposed_s = round(number / image_rate_hz, 4) + EXPOSED_AFTER_COILS_S
        name = "" if number in off_frames else f"images/{number:04}.png"
        frames += f"{number},{exposed_s:.4f},A,{name}\n"
        if name:
            (folder / name).write_bytes((image_of or _image)(exposed_s, noise, width, height))
    (folder / "frames.csv").write_text(frames)
    (folder / "em.csv").write_text(coils)
