#!/usr/bin/env python3
"""Writes the first corpus of the fuzz targets: what the protocols, the formats and the repository's own examples describe.

  make_corpus.py FOLDER    writes FOLDER/TARGET/*
"""
import base64
import re
import struct
import sys
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


def crc16(data):
    value = 0
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value >> 1) ^ (0xA001 if value & 1 else 0)
    return value


def crc8(data):
    value = 0xFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = (value << 1 ^ 0x1D) & 0xFF if value & 0x80 else value << 1
    return value ^ 0xFF


def line(payload):
    return payload.encode() + b"%04X\r" % crc16(payload.encode())


def bx(*handles, status=0):
    body = bytes([len(handles)]) + b"".join(handles) + struct.pack("<H", status)
    header = b"\xc4\xa5" + struct.pack("<H", len(body))
    return header + struct.pack("<H", crc16(header)) + body + struct.pack("<H", crc16(body))


def valid(handle, frame, port=0x3F):
    return bytes([handle, 1]) + struct.pack("<8fII", 0.8157, -0.0068, 0.5783, 0, -49.31, 57.13, -159.05, 0.0123, port, frame)


def missing(handle, frame):
    return bytes([handle, 2]) + struct.pack("<II", 0x7F, frame)


def disabled(handle):
    return bytes([handle, 4])


POSE = "+08157-00068+05783+00000-004931+005713-015905+00123"
TX = f"040A{POSE}0000003F00000018\n0BMISSING0000007F00000018\n0CDISABLED\n0DUNOCCUPIED\n0080"
TOOL = "021000" + "05" + "NDI         " + "001" + "3A1B2C00" + "3F"
LOCATION = "A1-00123" + "00" + "0201"

REPLIES = {
    "start_up": b"\x00" + line("RESET") + line("OKAY") + line("020A01F0B01F") + line("D.001.007"),
    "binary": bx(valid(10, 8), missing(11, 8), disabled(12)) + bx(valid(10, 16), valid(11, 16), status=0x80),
    "error_for_binary": bx(valid(10, 8)) + line("ERROR0C") + bx(valid(10, 16)),
    "cut": bx(valid(10, 8), valid(11, 8))[:50] + bx(valid(10, 16)),
    "text": line(TX) + line("WARNING"),
    "noise": b"\xff\xc4\xc4\xa5\x00" + bx(valid(10, 8)) + b"?!" + line("OKAY"),
}

TEXTS = {
    "tx": TX.encode(), "handles": b"020A01F0B01F", "tool": TOOL.encode(), "location": LOCATION.encode(),
    "tool_part_location": (TOOL + "610058              " + LOCATION).encode(), "unoccupied": b"UNOCCUPIED",
    "api": b"D.001.007", "firmware": b"Freeze Tag: AURORA Rev 008\n", "user_parameter": b"Info.Timeout.PINIT=5\n",
    "word": line("ERROR13")[:-1], "command": b"PHINF:0A002164EC", "command_plain": b"INIT ", "link": b"50000",
    "bx_body": bx(valid(10, 8), missing(11, 8), disabled(12))[6:-2],
}


def can_record(identifier, data, pause=1, seal=0, extended=0):
    return (struct.pack("<HBB", identifier & 0xFFFF, len(data), pause) + data.ljust(64, b"\0") +
            struct.pack("<BBH", seal, extended, identifier >> 16))


def classic(identifier, seven):
    return can_record(identifier, seven + bytes([crc8(struct.pack("<H", identifier) + seven)]))


def extended(identifier, seven):
    return can_record(identifier, seven + bytes([crc8(struct.pack("<I", identifier) + seven)]), extended=1)


SYNC = can_record(0x300, bytes.fromhex("18000000F8240100"))
FD = can_record(0x320, bytes.fromhex("1000010318000000F8240100623FFFFF2ADF0000B692FDFF686821FF054A0000"
                                     "3F0000000000000010FC18330D35F981"))
CLASSIC = [classic(0x340, bytes.fromhex("623FFF2ADF0013")), classic(0x341, bytes.fromhex("B692FD00007013")),
           classic(0x342, bytes.fromhex("C2786C015F2A13"))]
STATUS = classic(0x301, bytes.fromhex("10010000010000"))

EXTENDED = [can_record(0x18FF5000, bytes.fromhex("18000000F8240100"), extended=1),
            extended(0x18FF5001, bytes.fromhex("10010000010000")), extended(0x18FF5040, bytes.fromhex("623FFF2ADF0013")),
            extended(0x18FF5041, bytes.fromhex("B692FD00007013")), extended(0x18FF5042, bytes.fromhex("C2786C015F2A13"))]

CAN = {
    "fd": b"\0" + SYNC + FD + STATUS,
    "classic": b"\0" + SYNC + b"".join(CLASSIC),
    "part_lost": b"\x01" + SYNC + CLASSIC[0] + CLASSIC[2] + SYNC,
    "extended": b"\x20" + b"".join(EXTENDED),
    "extended_elsewhere": b"\x30" + b"".join(EXTENDED) + SYNC + FD,
    "late": b"\0" + SYNC + can_record(0x123, b"", 250) + FD,
}


def unescaped(text):
    return re.sub(rb"\\(x[0-9a-f]{2}|.)", lambda found: {b"r": b"\r", b"n": b"\n", b"\\": b"\\"}.get(found[1]) or
                  bytes.fromhex(found[1][1:].decode()), text.encode())


def answers_of(log):
    """A wire log as the target session reads it: what the tracker answered to each command, as bytes."""
    answers = []
    for line in log.splitlines():
        entry = re.match(r"\s*[\d.]+ (>|<|break)(?: (.*))?$", line)
        if entry and entry[1] != "<":
            answers.append(b"")
        elif entry and answers:
            answers[-1] += unescaped(entry[2])
    return b"".join(b"\x04" + bytes([min(len(answer), 255)]) + answer[:255] for answer in answers)


LOGS = {log.stem: log.read_text() for log in sorted((ROOT / "tests/drivers/logs").glob("*.log"))}
SESSION = {name: (b"\x03\x02" + answers_of(log))[:4096] for name, log in LOGS.items()}
SESSION["a_tool_file"] = b"\x0b\x20" + bytes(range(32)) + b"\x02" + answers_of(LOGS["a_tool_without_description"])[:3000]
WIRE_LOGS = {name: log[:log.rfind("\n", 0, 4096) + 1].encode() for name, log in LOGS.items()}

BASE = (ROOT / "tests/daemon/config/base.toml").read_text()
CONFIGURATIONS = {
    "base": BASE, "two_cameras": BASE + BASE[BASE.find("[[camera]]"):BASE.find("[[", BASE.find("[[camera]]") + 2)],
    "c_arm": BASE.replace("[[instrument]]", "[camera.c_arm]\nsource_detector_mm = 1200\nsource_isocentre_mm = 785\n"
                          "pixel_pitch_mm = 0.6\nprimary_angle_deg = 30\ntable_mm = [0, 0, 40]\n[[instrument]]", 1),
    "syntax": "[em\n", "nested": "a" + ".a" * 400 + " = 1\n", "array": "a = " + "[" * 300 + "]" * 300 + "\n",
    "values": "a = 1979-05-27T07:32:00Z\nb = 0x7f\nc = inf\nd = 'x'\ne = \"\\u00e9\"\nf = [1, {g = 2}]\n",
}


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, depth, interlaced=0):
    rows = b"".join(b"\0" + bytes(range(width * depth // 8)) for _ in range(height))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, 0, 0, 0, interlaced)) +
            chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


DESCRIPTION = """format = 1
note = "n"
[catheter]
id = "c"
diameter_mm = 2.0
length_mm = 100.0
sensor_offsets_from_tip_mm = [1.0, 20.0]
[registration]
T_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
[[camera]]
name = "A"
width = 8
height = 4
fx = 100.0
fy = 100.0
cx = 4.0
cy = 2.0
distortion = [0,0,0,0,0]
T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,500],[0,0,0,1]]
"""
EM = ("t_s,frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n0,1,1,OK,1,2,3,0,0,1,1,0,0,0,0.1\n"
      "0,1,2,MISSING,,,,,,,,,,,\n0.025,2,1,OUT_OF_VOLUME,1,2,3,0,0,1,1,0,0,0,0.1\n")
GEOMETRY = ("frame,fx,fy,cx,cy,qw,qx,qy,qz,x,y,z,sigma_rx,sigma_ry,sigma_rz,sigma_x,sigma_y,sigma_z,pivot_depth\n"
            "0,100,100,4,2,0.6,0,0.8,0,5,6,510,0.001,0.001,0.001,1,1,1,500\n1,120,120,4,2,1,0,0,0,0,0,500,0,0,0,0,0,0,0\n")
SEQUENCES = {
    "description": "=== sequence.toml\n" + DESCRIPTION, "em": "=== em.csv\n" + EM,
    "frames": "=== frames.csv\nframe,t_s,camera,file\n0,0.0,A,0.png\n1,0.1,A,\n",
    "geometry": "=== geometry.csv\n" + GEOMETRY,
    "truth": "=== truth.csv\nframe,s_mm,x,y,z\n0,0,1,2,3\n0,1,1,2,4\n0,2,1,2,5\n1,0,1,2,3\n1,1,1,2,4\n",
    "grey8": b"=== 0.png\n" + png(8, 4, 8), "grey16": b"=== 0.png\n" + png(8, 4, 16),
    "interlaced": b"=== 0.png\n" + png(8, 4, 8, 1), "large": b"=== 0.png\n" + png(64, 64, 16)[:200],
}


def tetrahedron(size):
    corners = [(0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, size)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    return [[corners[i] for i in face] for face in faces]


def stl(triangles):
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *[x for corner in triangle for x in corner], 0) for triangle in triangles)


def ascii_stl(triangles):
    facets = "".join("facet normal 0 0 0\nouter loop\n" + "".join("vertex %g %g %g\n" % corner for corner in triangle) +
                     "endloop\nendfacet\n" for triangle in triangles)
    return "solid v\n" + facets + "endsolid v\n"


VESSELS = {
    "binary": b"\0" + stl(tetrahedron(60)), "text": b"\0" + ascii_stl(tetrahedron(60)).encode(),
    "table": b"\1x,y,z,radius\n" + "".join(f"{i},0,{8 * i},5\n" for i in range(8)).encode(),
}


def element(group, number, kind, value):
    value += b" " if len(value) % 2 else b""
    length = struct.pack("<HI", 0, len(value)) if kind in (b"OW", b"OB") else struct.pack("<H", len(value))
    return struct.pack("<HH", group, number) + kind + length + value


def dicom(bits=16, meaning=b"MONOCHROME2", times=(0x18, 0x1063, b"DS", b"66.7"), more=b"", syntax=b"1.2.840.10008.1.2.1\0",
          pixels=None):
    short = lambda value: struct.pack("<H", value)
    meta = element(2, 0x10, b"UI", syntax)
    pixels = element(0x7FE0, 0x10, b"OW", bytes(range(3 * 4 * 2 * bits // 8))) if pixels is None else pixels
    return (bytes(128) + b"DICM" + element(2, 0, b"UL", struct.pack("<I", len(meta))) + meta + element(8, 0x60, b"CS", b"XA")
            + element(*times) + more + element(0x28, 2, b"US", short(1)) + element(0x28, 4, b"CS", meaning)
            + element(0x28, 8, b"IS", b"2") + element(0x28, 0x10, b"US", short(3)) + element(0x28, 0x11, b"US", short(4))
            + element(0x28, 0x100, b"US", short(bits)) + element(0x28, 0x101, b"US", short(bits - 4 if bits == 16 else 8))
            + element(0x28, 0x102, b"US", short(bits - 5 if bits == 16 else 7)) + element(0x28, 0x103, b"US", short(0)) + pixels)


def fragments(*parts):
    """Pixels of a compressed run: an empty table of offsets, and a fragment a frame (PS3.5 A.4)."""
    item = lambda body: b"\xfe\xff\x00\xe0" + struct.pack("<I", len(body)) + body
    return (b"\xe0\x7f\x10\x00OB\0\0\xff\xff\xff\xff" + item(b"") + b"".join(map(item, parts)) + b"\xfe\xff\xdd\xe0\0\0\0\0")


# RLE (PS3.5 G): a header of 64 bytes, and one segment of literal bytes.
RLE_FRAME = struct.pack("<16I", 1, 64, *[0] * 14) + b"\x0b" + bytes(range(12)) + b"\0"
DICOM = {
    "plain16": dicom(), "plain8": dicom(8), "inverted": dicom(meaning=b"MONOCHROME1"),
    "vector": dicom(times=(0x18, 0x1065, b"DS", b"0\\40")), "cine": dicom(times=(0x18, 0x40, b"IS", b"15")),
    "turning": dicom(more=element(0x18, 0x1520, b"DS", b"0\\0.5")),
    "rle": dicom(8, syntax=b"1.2.840.10008.1.2.5\0", pixels=fragments(RLE_FRAME, RLE_FRAME)),
    "jpeg": dicom(8, syntax=b"1.2.840.10008.1.2.4.50", pixels=fragments(b"\xff\xd8\xff\xd9", b"\xff\xd8\xff\xd9")),
}


# A picture of 16 x 16 grey pixels, JPEG baseline, as Python's base85 has it.
JPEG = base64.b85decode(
    '|JeWF01!$>Nk#wx0RR9200961|JwjV01XKW3knDg3knMk4h;_zAQcl55)&sJ9v2`kDKRiEDJ?8BI!Zn>HbyrrEkIX6ModmpQ&KWMT47pHU`kO^PyfIG3kU!Z'
    '01yEI5di<h03QGV0R;g80RaI400000000000RjUA1qKHQ2?`7U!~nGr00IF60|EpC1qB2I0004f0RjU61Q7)iAu&M)6H#FYB5@QlfsvsIBSNvk6;jdgBr{@i'
    'f(Z&17Z@2DB_<~*DJnEIHa9pqIzvQ7Mn_0VN>fx-R##YAT4Q8oW@l(=YIAgTc6WGrdV_?8hKGoWijtF*m6n&7nVO=bq@|{(sHv*5v$VCgx45~w!o$SH#>dFX'
    '%F@%+)z;V8+1laa<K*S$=jiF`@$&QZ_4fDp`TGCb00;pA002J#<aFCkoL5<<+H~TmX||m>uCq<F>BWEl*#')


def picture(kind, size, content, coding=0, shape=(0, 0, 0, 0), crop=(0, 0, 0, 0), stride=16):
    """Levels, shape, crop, format and size of a card's picture, then its bytes."""
    return bytes([coding, *shape]) + struct.pack("<bbBB", *crop) + bytes([kind, *size]) + struct.pack("<H", stride) + content


PICTURES = {
    **{f"format{kind}": picture(kind, (16, 16), bytes(range(256)) * 3, stride=48) for kind in range(10)},
    "jpeg": picture(9, (16, 16), JPEG),
    "turned": picture(0, (16, 16), bytes(range(256)) * 3, 1, (1, 2, 3, 1), (2, 3, 9, 10), 32), "cut": picture(0, (16, 16), bytes(40)),
    "jpeg_of_a_field": picture(9, (16, 16), JPEG, 2, (2, 1, 1, 3), (1, 1, 12, 12)), "jpeg_cut": picture(9, (16, 16), JPEG[:-40]),
}


def image_step(*changes, size=0, geometry=0):
    return (b"\x01" + bytes([len(changes) | geometry << 7]) + b"".join(bytes([offset]) + value for offset, value in changes) +
            bytes([size]))


def poke(offset, value):
    return b"\0" + struct.pack("<HQ", offset, value)


IMAGES = {
    "proper": b"\0" + image_step() + b"\2" + image_step() + b"\2",
    "grey8_off": b"\0" + image_step((28, struct.pack("<II", 8, 8))) + b"\2" + image_step((24, bytes(8))) + b"\2",
    "larger": b"\0" + image_step((32, struct.pack("<II", 32768, 32768))) + b"\2",
    "short": b"\0" + image_step(size=130) + b"\2", "greeting": b"\1" + bytes(16), "nothing_handed_out": b"\2",
    "slots": b"\4" + struct.pack("<HQ", 20, 0xFFFFFFFF) + b"\2", "newest": b"\0" + poke(192, 2**63) + b"\2" + image_step() + b"\2",
    "sequence": b"\0" + image_step() + poke(4096, 7) + b"\2", "ended": b"\0" + image_step() + poke(264, 2) + b"\2",
    "geometry": b"\0" + image_step(geometry=1) + b"\2" + image_step((76, struct.pack("<ff", 5, -6)), geometry=1) + b"\2",
    "inverted": b"\0" + image_step((84, struct.pack("<ff", -1000, 0.1)), geometry=1) + b"\2" + image_step((40, bytes([9]) + bytes(7))) + b"\2",
    "heartbeat": b"\0" + poke(256, 2**63 - 1) + b"\2", "length": b"\0" + image_step() + poke(4104, 2**64 - 1) + b"\2",
}


def estimate_step(*changes):
    return b"\x01" + bytes([len(changes)]) + b"".join(struct.pack("<HQ", offset, value) for offset, value in changes)


ESTIMATES = {
    "proper": b"\0" + estimate_step() + b"\2" + estimate_step() + b"\2", "every": b"\2" + estimate_step() * 3 + b"\2\2",
    "counts": b"\0" + estimate_step((172, 129)) + b"\2" + estimate_step((8368, 65)) + b"\2" + estimate_step((9912, 17)) + b"\2" + estimate_step((10172, 5)) + b"\2",
    "booleans": b"\0" + estimate_step((120, 0x0202)) + b"\2" + estimate_step((10180, 2)) + b"\2", "newest": b"\0" + estimate_step() + poke(192, 2**64 - 1) + b"\2\2",
    "ended": b"\0" + estimate_step() + poke(264, 2) + b"\2\2", "identity": b"\0" + estimate_step((0, 0x4141414141414141)) + b"\2",
}


def sample(writer, *changes, pause=33, place=5.0, prints=True):
    return (bytes([len(changes) | writer << 3 | (128 if prints else 0)]) +
            b"".join(struct.pack("<HQ", offset, value) for offset, value in changes) + bytes([pause]) + struct.pack("<f", place))


# Offsets of tubed_TubeEstimate: those of tubed_shm_estimate, which has the same fields in the same order.
NUMBER, START, LENGTH, POINTS, SPACING, PUBLISHED = 72, 80, 156, 172, 8372, 11040
SAMPLES = {
    "in_order": b"".join(sample(0, (NUMBER, n), (START, 1), (PUBLISHED, n * 33_000_000)) for n in range(1, 12)),
    "another_writer": b"".join(sample(n % 2, (NUMBER, n), (START, 1 + n % 2), (PUBLISHED, n * 33_000_000)) for n in range(1, 12)),
    "backward": b"".join(sample(0, (NUMBER, n), (PUBLISHED, n * 33_000_000)) for n in (5, 4, 6, 5)),
    "outruns": b"".join(sample(0, (NUMBER, n << 40), (PUBLISHED, n)) for n in range(4)),
    "past_and_future": sample(0, (PUBLISHED, 2**63)) + sample(0, (NUMBER, 1), (PUBLISHED, 2**63 - 1)),
    "infinite_length": sample(0, (LENGTH, 0x7F800000), (SPACING, 0x7F800000), place=float("inf")),
    "counts": sample(0, (POINTS, 2**32 - 1)) + sample(0, (SPACING - 4, 2**32 - 1)), "nan": sample(0, place=float("nan")),
}
REPORTS = {
    "samples": b"\0\1" + struct.pack("<HQ", 120, 16), "identity": b"\1\1" + struct.pack("<HQ", 0, 0x41),
    "reports": b"\2" + bytes([0]) + bytes([0]) + struct.pack("<qq", 10**12 - 10**8, 10**12 - 10**8),
}

CORPORA = {
    "replies": (REPLIES, b"\x1f"), "text": (TEXTS, b""), "can": (CAN, b""), "session": (SESSION, b""), "wire_log": (WIRE_LOGS, b""),
    "configuration": (CONFIGURATIONS, b""), "sequence": (SEQUENCES, b""), "dicom": (DICOM, b""), "picture": (PICTURES, b""), "vessel": (VESSELS, b""), "shm_image": (IMAGES, b""),
    "shm_estimate": (ESTIMATES, b""), "estimate": (SAMPLES, b""), "reports": (REPORTS, b""),
}


def main(arguments):
    folder = Path(arguments[0])
    for name, (files, before) in CORPORA.items():
        (folder / name).mkdir(parents=True, exist_ok=True)
        for file, content in files.items():
            (folder / name / file).write_bytes(before + (content.encode() if isinstance(content, str) else content))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
