#!/usr/bin/env python3
"""tubed-view: what a page of somebody else sees, and what becomes of requests that are none."""
import http.server
import subprocess
import threading
import time

import bed as beds
import browser as browsers
import view_client as client
from bed import check, say
from view import ADDRESS, view, with_previews

HOSTILE_PAGE = b"""<!doctype html><title>hostile</title><script>
window.tried = (async () => {
  const read = async (what) => { try { return await what(); } catch (error) { return "refused"; } };
  const element = (name, path) => new Promise((done) => {
    const e = document.createElement(name);
    e.onload = () => done("loaded"); e.onerror = () => done("refused");
    e.src = "http://127.0.0.1:8080" + path; document.body.append(e);
  });
  const socket = () => new Promise((done) => {
    const s = new WebSocket("ws://127.0.0.1:8080/stream");
    s.onmessage = () => done("heard"); s.onerror = s.onclose = () => done("refused");
  });
  return {fetch: await read(async () => (await fetch("http://127.0.0.1:8080/index.html")).text()),
          no_cors: await read(async () => (await fetch("http://127.0.0.1:8080/view.js", {mode: "no-cors"})).type),
          image: await element("img", "/icon.svg"), script: await element("script", "/state.js"), socket: await socket()};
})();
</script><body></body>"""


class HostileHandler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(HOSTILE_PAGE)

    def log_message(self, *_):
        pass


def a_page_of_another_origin_reads_nothing(bed):
    bed.tracked(with_previews(bed))
    view(bed)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 9099), HostileHandler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    bed.closing.callback(server.shutdown)
    window = browsers.Browser(640, 480)
    bed.closing.callback(window.close)
    for origin in ("http://127.0.0.1:9099/", "http://localhost:9099/"):
        window.open(origin)
        tried = window.driver.execute_async_script("const done = arguments[0]; window.tried.then(done, (e) => done(String(e)));")
        say(f"{origin}: {tried}")
        check(isinstance(tried, dict) and set(tried.values()) == {"refused"}, f"a page of {origin} reads: {tried}")
    # The same page opened as a page shows what a browser may see: the refusals above are not an accident.
    window.open(ADDRESS)
    window.wait("document.body.classList.contains('valid')", "the page itself", 15)
    for headers, expected in (({"host": "evil.example:8080"}, 421), ({"host": "127.0.0.1:9999"}, 421), ({"Origin": "http://evil.example"}, 403),
                              ({"Origin": "null"}, 403), ({"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "cors"}, 403), ({}, 200)):
        status, _ = client.get(**headers)
        check(status == expected, f"a request with {headers} is answered with {status}, expected {expected}")
    for arguments, expected in (({"origin": "http://evil.example"}, 403), ({"origin": None}, 403), ({"origin": "null"}, 403),
                                ({"host": "evil.example:8080", "origin": "http://evil.example:8080"}, 421), ({}, 101)):
        status, connection = client.upgrade(**arguments)
        connection.close()
        check(status == expected, f"a stream with {arguments} is answered with {status}, expected {expected}")


def closes_after(connection, data, timeout_s=8):
    """Whether the other end closes a stream within that time after these bytes."""
    connection.settimeout(timeout_s)
    try:
        connection.sendall(data)
        while connection.recv(65536):
            pass
        return True
    except (ConnectionResetError, BrokenPipeError):
        return True
    except TimeoutError:
        return False


def oversized_and_malformed_requests_end_in_an_error(bed):
    process = view(bed)
    head = f"Host: {client.HOST}\r\n"
    expected = (
        ("a head of 20 KB", f"GET / HTTP/1.1\r\n{head}X: {'x' * 20000}\r\n\r\n", 431),
        ("a path of 20 KB", f"GET /{'x' * 20000} HTTP/1.1\r\n{head}\r\n", 431),
        ("noise", "\x00\x01\x02 noise\r\n\r\n", 400),
        ("HTTP/9.9", f"GET / HTTP/9.9\r\n{head}\r\n", 400),
        ("two lengths", f"GET / HTTP/1.1\r\n{head}Content-Length: 1\r\nContent-Length: 2\r\n\r\n", 400),
        ("a body", f"GET / HTTP/1.1\r\n{head}Content-Length: 1000000\r\n\r\n", 413),
        ("chunks", f"GET / HTTP/1.1\r\n{head}Transfer-Encoding: chunked\r\n\r\n", 413),
        ("POST", f"POST / HTTP/1.1\r\n{head}Content-Length: 0\r\n\r\n", 405),
        ("no host", "GET / HTTP/1.1\r\n\r\n", 421),
        ("a path outside", f"GET /../../etc/passwd HTTP/1.1\r\n{head}\r\n", 404),
        ("a path that is not there", f"GET /nothing HTTP/1.1\r\n{head}\r\n", 404),
        ("the page", f"GET / HTTP/1.1\r\n{head}\r\n", 200))
    for what, request, status in expected:
        got = client.status_of(client.ask(request.encode("latin-1")))
        check(got == status, f"{what}: answered with {got}, expected {status}")
    for what, data in (("a message of 100 KB", b"\x81\xff" + (100000).to_bytes(8, "big") + b"mask" + b"x" * 3000),
                       ("a frame that is not masked", b"\x81\x05hello"), ("a frame of a kind that is none", b"\x8b\x80mask")):
        status, connection = client.upgrade()
        check(status == 101, f"the stream is answered with {status}")
        check(closes_after(connection, data), f"{what}: the stream goes on")
        connection.close()
    status, connection = client.upgrade()
    connection.sendall(client.masked(b"nothing that anybody knows") + client.masked(b'{"press": "clear"}') + client.masked(b"seen 99999999999999999999999"))
    check(not closes_after(connection, b"", 1), "words that mean nothing end the stream")
    connection.close()
    slow_ones_shut_nobody_out()
    check(process.poll() is None, "tubed-view has ended")


def slow_ones_shut_nobody_out():
    idle = [client.connect() for _ in range(150)]
    for connection in idle[:75]:
        connection.sendall(b"GET / HT")
    begin = time.monotonic()
    status, _ = client.get()
    took = time.monotonic() - begin
    check(status == 200 and took < 1 * beds.TIME_FACTOR, f"beside 150 connections that say nothing: {status} after {took:.2f} s")
    idle[149].settimeout(8)
    check(idle[149].recv(100) == b"", "a connection that says nothing for 5 s is answered")
    for connection in idle:
        connection.close()


def a_viewer_that_others_can_reach_asks_for_a_token(bed):
    program = bed.program("tubed-view")
    refused = subprocess.run([program, "--listen", "0.0.0.0:8080"], capture_output=True, text=True, check=False, timeout=10)
    check(refused.returncode == 64 and "--token-file" in refused.stderr, f"without a token: {refused}")
    short = bed.write("short.txt", "abc\n")
    refused = subprocess.run([program, "--listen", "0.0.0.0:8080", "--token-file", str(short)], capture_output=True, text=True, check=False, timeout=10)
    check(refused.returncode == 64 and "16" in refused.stderr, f"with a short token: {refused}")
    token = bed.write("token.txt", "0123456789abcdef0123456789abcdef\n")
    view(bed, "--listen", "0.0.0.0:8080", "--host", client.HOST, "--token-file", str(token))
    check(client.get()[0] == 401, "the page is served without a token")
    check(client.get("/?token=0123456789abcdef0123456789abcdee")[0] == 401, "a wrong token is taken")
    status, answer = client.get("/?token=0123456789abcdef0123456789abcdef")
    check(status == 303 and b"HttpOnly" in answer and b"SameSite=Strict" in answer, f"the token is answered with {answer[:300]}")
    check(client.get(Cookie="tubed_view=0123456789abcdef0123456789abcdef")[0] == 200, "the cookie is not taken")
    check(client.upgrade()[0] == 401, "the stream is served without a token")


if __name__ == "__main__":
    beds.main(a_page_of_another_origin_reads_nothing, oversized_and_malformed_requests_end_in_an_error,
              a_viewer_that_others_can_reach_asks_for_a_token)
