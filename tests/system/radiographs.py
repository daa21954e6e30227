"""Sequence folders whose images look like radiographs: a breathing chest behind the catheter, which table or C-arm may move."""
import statistics
import struct
import zlib

import sequences
from bed import check

PHASES, PHASES_A_SECOND = 16, 4  # of the chest, which are shown again and again; noise never is
BRIGHTEST, NOISE_RANGE, NOISE, CATHETER = 225, 25, 5, 50  # grey levels; the noise is 0 .. NOISE_RANGE
MM_PER_PX = sequences.DEPTH_MM / sequences.FOCAL_PX


def _unfiltered(rows, width):
    """The rows of an 8-bit grey PNG, without what each is predicted from."""
    above, lines = bytearray(width), []
    for start in range(0, len(rows), width + 1):
        kind, row = rows[start], bytearray(rows[start + 1:start + 1 + width])
        for x in range(width) if kind else ():
            left, corner = (row[x - 1], above[x - 1]) if x else (0, 0)
            if kind == 4:
                guess = left + above[x] - corner
                near = min((abs(guess - left), 0, left), (abs(guess - above[x]), 1, above[x]), (abs(guess - corner), 2, corner))[2]
            else:
                near = (left, above[x], (left + above[x]) // 2)[kind - 1]
            row[x] = (row[x] + near) & 255
        lines.append(bytes(row))
        above = row
    return lines


def _read_png(path):
    text = path.read_bytes()
    width, _, depth, colour = struct.unpack(">IIBB", text[16:26])
    check((depth, colour) == (8, 0), f"{path} is not grey of 8 bits")
    at, packed = 8, b""
    while at < len(text):
        length, = struct.unpack(">I", text[at:at + 4])
        if text[at + 4:at + 8] == b"IDAT":
            packed += text[at + 8:at + 8 + length]
        at += 12 + length
    return _unfiltered(zlib.decompress(packed), width)


class Chest:
    """Pictures of a chest that breathes, larger than those of a sequence, so that they can be looked at from elsewhere."""

    def __init__(self, bed):
        done = bed.tubectl("radiograph", "--lao", "60", "--no-catheter", "--dose", "0", "--clutter", "heart", "breathing", "--frames",
                           str(PHASES), "--rate", str(PHASES_A_SECOND), "--out", str(bed.folder / "chest.png"), timeout_s=150)
        check(done.returncode == 0, f"tubectl radiograph exits {done.returncode}: {done.stderr}")
        darker = bytes(grey * BRIGHTEST // 255 for grey in range(256))
        self._phases = [[row.translate(darker) for row in _read_png(path)] for path in sorted(bed.folder.glob("chest*.png"))]
        normal = statistics.NormalDist(NOISE_RANGE / 2, NOISE)
        self._levels = bytes(round(min(max(normal.inv_cdf((byte + 0.5) / 256), 0), NOISE_RANGE)) for byte in range(256))

    def image(self, t_s, noise, width, height, aside_px):
        """A PNG: chest and catheter, `aside_px` to the right of where they are at rest."""
        phase = self._phases[int(t_s * PHASES_A_SECOND) % len(self._phases)]
        left, top = (len(phase[0]) - width) // 2 - aside_px, (len(phase) - height) // 2
        grey = b"".join(row[left:left + width] for row in phase[top:top + height])
        # No sum of a pixel exceeds 255: all of them are added as one number.
        total = int.from_bytes(grey, "big") + int.from_bytes(noise.randbytes(width * height).translate(self._levels), "big")
        pixels = bytearray(total.to_bytes(width * height, "big"))
        for place in sequences.catheter_pixels(t_s, width, height, aside_px):
            pixels[place] = max(0, pixels[place] - CATHETER)
        return sequences.png(pixels, width, height)


def write_panned_sequence(bed, seconds, aside_px_at, image_rate_hz=15):
    """A folder in which the picture lies `aside_px_at(t_s)` to the right of where its pose says."""
    chest = Chest(bed)
    folder = bed.folder / "panned"
    sequences.write_sequence(folder, seconds, image_rate_hz=image_rate_hz,
                             image_of=lambda t_s, noise, width, height: chest.image(t_s, noise, width, height, aside_px_at(t_s)))
    return folder
