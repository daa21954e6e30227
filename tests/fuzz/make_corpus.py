#!/usr/bin/env python3
"""Writes the first corpus of the fuzz targets: one file a conversation that the protocol describes.

  make_corpus.py FOLDER    writes FOLDER/{replies,text,can}/*
"""
import struct
import sys
from pathlib import Path


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


def main(arguments):
    folder = Path(arguments[0])
    for name, files, before in (("replies", REPLIES, b"\x1f"), ("text", TEXTS, b""), ("can", CAN, b"")):
        (folder / name).mkdir(parents=True, exist_ok=True)
        for file, content in files.items():
            (folder / name / file).write_bytes(before + content)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
