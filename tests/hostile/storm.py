"""A storm of packets that Cyclone cannot read.

    TUBED_PACKETS=1000000 tests/hostile/storm.py build/release/bin a_storm_of_malformed_packets_fills_neither_log_nor_memory
"""
import os
import pathlib
import random
import socket
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import bed as beds  # noqa: E402
from bed import Skip, check, check_timing, is_valid, rate_hz, say  # noqa: E402
from harsh_world import Packets, resident_mb  # noqa: E402

PACKETS = int(os.environ.get("TUBED_PACKETS", "60000"))
LINES_A_PERIOD, PERIOD_S = 5, 10  # idl/cyclone_log.cpp
OTHER_LINES = 12  # changes of state that the daemon may tell meanwhile
GROWTH_MB = 8


def malformed(payload, dice):
    """A packet that is addressed right, and whose submessages are not: the header of 20 bytes stays."""
    octets = bytearray(payload)
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(20, len(octets)) if len(octets) > 20 else 0
        octets[at] ^= 1 << dice.randrange(8)
    if dice.random() < 0.7 and len(octets) > 24:
        octets[22:24] = dice.randbytes(2)  # the length of the first submessage
    return bytes(octets)


def udp_ports_of(daemon):
    """Where it listens: the ports of DDS, not those it only sends from."""
    held = {os.readlink(link) for link in pathlib.Path(f"/proc/{daemon.process.pid}/fd").iterdir()}
    rows = [line.split() for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]]
    return {int(row[1].split(":")[1], 16) for row in rows if f"socket:[{row[9]}]" in held}


def unreadable_packets(bed):
    text = bed.tubectl("echo", "--topic", "health", "--json", "--count", "1", "--seconds", "5").stdout
    return next((stage["refused"] for stage in beds.json.loads(text.splitlines()[0])["stages"] if stage["name"] == "dds"), None)


def a_storm_of_malformed_packets_fills_neither_log_nor_memory(bed):
    if os.geteuid() != 0:
        raise Skip("a raw socket needs root")
    daemon = bed.start_daemon()
    subscriber = bed.subscribe()
    packets = Packets(4)
    subscriber.wait_for(is_valid, "VALID shape", 10)
    ports = udp_ports_of(daemon)
    at_the_daemon = [(destination, payload) for destination, payload in packets.seen if destination[1] in ports]
    check(len(at_the_daemon) > 10, f"only {len(at_the_daemon)} packets went to the daemon's ports {ports}")
    dice = random.Random(1)
    time.sleep(2)
    lines_before, mb_before = len(daemon.words().splitlines()), []
    from_ns = time.monotonic_ns()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for count in range(PACKETS):
            destination, payload = dice.choice(at_the_daemon)
            try:
                sender.sendto(malformed(payload, dice), destination)
            except OSError:  # its queue is full
                pass
            if count % 200 == 0:
                time.sleep(0.01)
            if count % max(1, PACKETS // 10) == 0:
                mb_before.append(resident_mb(daemon))
                check(daemon.process.poll() is None, f"the daemon ended with {daemon.process.poll()}")
    took_s = (time.monotonic_ns() - from_ns) / 1e9
    samples = subscriber.samples(from_ns)
    words = daemon.words()
    lines = words.splitlines()[lines_before:]
    cyclone = [line for line in lines if "Cyclone DDS" in line]
    most = LINES_A_PERIOD * (int(took_s / PERIOD_S) + 1)
    refused = unreadable_packets(bed)
    say(f"{PACKETS} malformed packets to {len(ports)} ports in {took_s:.1f} s: {len(cyclone)} lines of Cyclone's, {len(lines)} in all "
        f"({sum(map(len, lines))} bytes); {refused} packets counted as unreadable; {rate_hz(samples):.2f} Hz; resident "
        f"{mb_before[1]:.1f} MB after a tenth, {resident_mb(daemon):.1f} MB at the end")
    check(len(lines) <= most + OTHER_LINES, f"{len(lines)} lines in {took_s:.0f} s, expected {most + OTHER_LINES} at most, such as\n"
          + "\n".join(lines[:3]))
    check(0 < len(cyclone) <= most, f"{len(cyclone)} lines of Cyclone's in {took_s:.0f} s, expected 1 to {most}")
    check(refused and refused > PACKETS / 100, f"TubeHealth says that {refused} packets were unreadable")
    check_timing(rate_hz(samples) >= 29.5, f"only {rate_hz(samples):.2f} Hz meanwhile")
    check_timing(resident_mb(daemon) - mb_before[1] < GROWTH_MB, "memory grows with the storm")


if __name__ == "__main__":
    beds.main(a_storm_of_malformed_packets_fills_neither_log_nor_memory)
