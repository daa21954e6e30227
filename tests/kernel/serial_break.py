"""A serial break that is one: tubed at a serial port in user space (CUSE), which is told of breaks as a real port is.

Runs in the guest of guest.py: a kernel with cuse.
"""
import os
import time

import bed as beds
from bed import check, is_valid, say

# tcsendbreak: 0.25 to 0.5 s.
SHORTEST_MS, LONGEST_MS = 250, 500
RESET_S = 1.3


class SerialRoom:
    def __init__(self, bed, tracker_rate):
        self.log = bed.folder / "port.log"
        self.port = beds.Daemon([bed.program("cuse_aurora"), "ttyAurora", str(tracker_rate), str(self.log)], bed.folder / "tubed-port.log")
        bed.daemons.append(self.port)
        until = time.monotonic() + 10
        while not os.path.exists("/dev/ttyAurora") and time.monotonic() < until:
            time.sleep(0.02)
        text = ('[dds]\nnetwork_interface = "lo"\n'
                '[em]\ndriver = "aurora-serial"\ndevice = "/dev/ttyAurora"\nT_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n'
                '[[instrument]]\nid = "cath-1"\nmode = "em"\nlength_mm = 380.0\n')
        for sensor, offset_mm in enumerate((10.0, 90.0, 170.0, 270.0, 370.0), 1):
            text += (f"[[instrument.coil]]\nsensor = {sensor}\noffset_from_tip_mm = {offset_mm}\n"
                     f"port = {(sensor + 1) // 2}\nchannel = {(sensor + 1) % 2}\n")
        self.shapes = bed.subscribe()
        self.daemon = bed.start_daemon(text)

    def valid(self, timeout_s):
        return self.shapes.wait_for(is_valid, "VALID shape", timeout_s, time.monotonic_ns()).json

    def entries(self, *kinds):
        """(seconds, kind, number) of what the port was told, oldest first."""
        rows = [line.split() for line in self.log.read_text(encoding="ascii").splitlines()]
        return [(int(ns) * 1e-9, kind, int(number)) for ns, kind, number in rows if kind in kinds]

    def breaks(self):
        return self.entries("TCSBRK", "TCSBRKP", "TIOCSBRK")


def a_tracker_at_an_unknown_rate_is_reset_by_a_break(bed):
    room = SerialRoom(bed, 57600)
    room.valid(30)
    for when, what, number in room.entries("host", "tracker", "TCSBRK", "TCSBRKP", "TIOCSBRK"):
        say(f"{when - room.entries('open')[0][0]:7.3f} s {what} {number}")
    breaks = room.breaks()
    check(len(breaks) == 1, f"{len(breaks)} breaks, expected one")
    check(SHORTEST_MS <= breaks[0][2] <= LONGEST_MS + 100, f"a break of {breaks[0][2]} ms, expected {SHORTEST_MS} to {LONGEST_MS}")
    broken_s = breaks[0][0]
    tracker = [(when, rate) for when, _, rate in room.entries("tracker")]
    check(tracker[0][1] == 57600, f"the tracker began at {tracker[0][1]} baud")
    after = [rate for when, rate in tracker if when >= broken_s - 0.1]
    check(after == [9600, 115200], f"the tracker's rates from the break on: {after}")
    tried = [rate for when, _, rate in room.entries("host") if when < broken_s]
    check(57600 not in tried, f"the rate was found by trying ({tried}), not by a break")
    raised_s = next(when for when, rate in tracker if when >= broken_s and rate == 115200)
    check(raised_s - broken_s >= RESET_S, "the tracker was talked to before it could say RESET")
    room.valid(5)
    check(room.daemon.process.poll() is None, "the daemon has ended")


def a_tracker_at_9600_is_left_without_a_break(bed):
    room = SerialRoom(bed, 9600)
    room.valid(30)
    check(not room.breaks(), f"needless breaks, which reset a tracker: {room.breaks()}")


if __name__ == "__main__":
    beds.main(a_tracker_at_an_unknown_rate_is_reset_by_a_break, a_tracker_at_9600_is_left_without_a_break)
