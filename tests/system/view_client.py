"""As much of HTTP and WebSocket (RFC 6455) as a test of tubed-view needs, byte by byte: also what no library would send."""
import base64
import json
import os
import select
import socket
import struct
import time

import bed as beds

PORT = 8080
HOST = f"127.0.0.1:{PORT}"


def connect(timeout_s=5, port=PORT):
    connection = socket.create_connection(("127.0.0.1", port), timeout_s)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def ask(request, timeout_s=8):
    """What comes back for these bytes until the other end closes or says no more; b"" when it only closes."""
    with connect(timeout_s) as connection:
        try:
            connection.sendall(request)
        except OSError:
            pass  # closed before it had everything: the answer may be there all the same
        answer = b""
        try:
            while piece := connection.recv(65536):
                answer += piece
                head, end, body = answer.partition(b"\r\n\r\n")
                length = [line.split(b":")[1] for line in head.split(b"\r\n") if line.lower().startswith(b"content-length:")]
                if end and length and len(body) >= int(length[0]):
                    break
        except ConnectionResetError:
            pass
        return answer


def get(path="/", method="GET", host=HOST, **headers):
    """Status and the whole answer of a plain request; headers with _ for -."""
    lines = [f"{method} {path} HTTP/1.1", f"Host: {host}", *(f"{name.replace('_', '-')}: {value}" for name, value in headers.items())]
    answer = ask(("\r\n".join(lines) + "\r\n\r\n").encode())
    return status_of(answer), answer


def status_of(answer):
    return int(answer.split(b" ", 2)[1]) if answer.startswith(b"HTTP/1.1 ") else 0


def upgrade(origin=f"http://{HOST}", host=HOST, path="/stream", port=PORT):
    """A request for a WebSocket, and the socket with its answer's head read: (status, socket)."""
    connection = connect(port=port)
    key = base64.b64encode(os.urandom(16)).decode()
    lines = [f"GET {path} HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}",
             "Sec-WebSocket-Version: 13", *([f"Origin: {origin}"] if origin else [])]
    connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
    head = b""
    while not head.endswith(b"\r\n\r\n"):
        byte = connection.recv(1)
        if not byte:
            break
        head += byte
    return status_of(head), connection


def masked(payload, opcode=1):
    mask = os.urandom(4)
    length = bytes([0x80 | len(payload)]) if len(payload) < 126 else bytes([0x80 | 126]) + struct.pack(">H", len(payload))
    return bytes([0x80 | opcode]) + length + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload))


class Frames:
    """The frames that come over a WebSocket, of a sender that does not fragment."""

    def __init__(self, connection):
        self.socket = connection
        self.socket.setblocking(False)
        self.waiting = b""
        self.is_closed = False

    def fileno(self):
        return self.socket.fileno()

    def take(self):
        """(opcode, payload) of each that is there."""
        try:
            piece = self.socket.recv(1 << 20)
            self.is_closed = self.is_closed or not piece
            self.waiting += piece
        except BlockingIOError:
            pass
        except OSError:
            self.is_closed = True
        frames = []
        while (frame := self._next()) is not None:
            frames.append(frame)
        return frames

    def _next(self):
        data = self.waiting
        if len(data) < 2:
            return None
        length, at = data[1] & 127, 2
        if length > 125:
            at = 4 if length == 126 else 10
            if len(data) < at:
                return None
            length = int.from_bytes(data[2:at], "big")
        if len(data) < at + length:
            return None
        self.waiting = data[at + length:]
        return data[0] & 15, data[at:at + length]

    def send(self, data):
        try:
            self.socket.send(data)
        except OSError:
            self.is_closed = True


class Tab(Frames):
    """One stream. `acknowledges`: as a page that has shown what came."""

    def __init__(self, acknowledges=True):
        status, connection = upgrade()
        beds.check(status == 101, f"the stream is answered with {status}, expected 101")
        super().__init__(connection)
        self.acknowledges = acknowledges
        self.estimates = 0
        self.images = 0
        self.newest = None
        self.room = None

    def take(self):
        for frame in super().take():
            self._hear(*frame)

    def _hear(self, opcode, payload):
        if opcode == 9:
            self.send(masked(payload, 10))
        elif opcode == 8:
            self.is_closed = True
        elif opcode == 2:
            size = int.from_bytes(payload[:4], "little")
            self.images += 1
            self._seen(json.loads(payload[4:4 + size])["n"])
        elif opcode == 1:
            message = json.loads(payload)
            if message["type"] == "room":
                self.room = message
            else:
                self.estimates += 1
                self.newest = message
                self._seen(message["n"])

    def _seen(self, number):
        if self.acknowledges:
            self.send(masked(f"seen {number}".encode()))


def listen(tabs, seconds):
    """Takes whatever comes to these tabs within that time."""
    until = time.monotonic() + seconds
    while (left := until - time.monotonic()) > 0:
        for tab in select.select([tab for tab in tabs if not tab.is_closed], [], [], left)[0]:
            tab.take()
