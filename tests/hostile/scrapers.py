"""Clients of tubed-exporter that dawdle: that send a byte a second, or nothing, or read nothing."""
import pathlib
import re
import selectors
import shutil
import socket
import statistics
import subprocess
import sys
import threading
import time
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import bed as beds  # noqa: E402
import calm  # noqa: E402
from bed import Skip, check, check_timing, say  # noqa: E402

ADDRESS = ("127.0.0.1", 9756)
REQUEST = b"GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n"
SCRAPES = 40
ALERTS = pathlib.Path(__file__).resolve().parents[2] / "systemd/tubed-alerts.yml"


def exporter(bed):
    process = subprocess.Popen([bed.program("tubed-exporter")], stderr=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(process.kill)
    until = time.monotonic() + 10
    while time.monotonic() < until:
        if "tubed_validity{" in text_or_nothing():
            return process
        time.sleep(0.1)
    raise beds.Failure("the exporter shows no daemon within 10 s")


def text_or_nothing():
    try:
        return scraped()[0]
    except OSError:
        return ""


def scraped():
    """The metrics, and how long they took (s)."""
    begun = time.monotonic()
    with urllib.request.urlopen(f"http://{ADDRESS[0]}:{ADDRESS[1]}/metrics", timeout=10) as answer:
        text = answer.read().decode()
    return text, time.monotonic() - begun


def quick_times():
    return [scraped()[1] for _ in range(SCRAPES)]


class Dawdlers:
    """So many clients that never finish: in turn a byte a second, nothing at all, and a request whose answer is not read. Who is
    thrown out comes again."""

    def __init__(self, count):
        self.thrown_out = 0
        self._ends = threading.Event()
        self._clients = [self._connect() for _ in range(count)]
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @staticmethod
    def _connect():
        client = socket.socket()
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        client.settimeout(2)
        client.connect(ADDRESS)
        client.setblocking(False)
        return client

    def _run(self):
        while not self._ends.wait(0.5):
            for place, client in enumerate(self._clients):
                try:
                    if place % 3 == 0:
                        client.send(REQUEST[:1])
                    elif place % 3 == 2:
                        client.send(REQUEST)
                    if place % 3 != 2 and client.recv(1, socket.MSG_PEEK) == b"":
                        raise ConnectionResetError
                except BlockingIOError:
                    pass
                except OSError:
                    self.thrown_out += 1
                    client.close()
                    try:
                        self._clients[place] = self._connect()
                    except OSError:
                        self._clients[place] = socket.socket()

    def end(self):
        self._ends.set()
        self._thread.join()
        for client in self._clients:
            client.close()


def measured_beside(bed, count, seconds=0.0):
    """Medians of a quick client alone and beside so many dawdlers, ms."""
    alone = quick_times()
    dawdlers = Dawdlers(count)
    bed.closing.callback(dawdlers.end)
    time.sleep(0.6 + seconds)
    beside = quick_times()
    return statistics.median(alone) * 1e3, statistics.median(beside) * 1e3, max(beside) * 1e3, dawdlers


def a_slow_client_costs_a_quick_one_nothing(bed):
    bed.tracked()
    exporter(bed)
    alone_ms, beside_ms, worst_ms, _ = measured_beside(bed, 3)
    say(f"a scrape takes {alone_ms:.1f} ms alone, {beside_ms:.1f} ms beside three that dawdle ({beside_ms / alone_ms:.1f} times), "
        f"{worst_ms:.1f} ms at worst of {SCRAPES}")
    check_timing(beside_ms < 3 * alone_ms, f"beside three that dawdle a scrape takes {beside_ms / alone_ms:.1f} times as long")
    check_timing(worst_ms < 1000, f"one scrape took {worst_ms:.0f} ms")


def a_hundred_clients_that_dawdle_shut_nobody_out(bed):
    bed.tracked()
    process = exporter(bed)
    alone_ms, beside_ms, worst_ms, dawdlers = measured_beside(bed, 100, seconds=3)
    descriptors = len(list(pathlib.Path(f"/proc/{process.pid}/fd").iterdir()))
    say(f"a scrape takes {alone_ms:.1f} ms alone, {beside_ms:.1f} ms beside a hundred that dawdle ({beside_ms / alone_ms:.1f} times), "
        f"{worst_ms:.1f} ms at worst of {SCRAPES}; {dawdlers.thrown_out} were thrown out; {descriptors} descriptors")
    check_timing(beside_ms < 5 * alone_ms, f"beside a hundred that dawdle a scrape takes {beside_ms / alone_ms:.1f} times as long")
    check_timing(worst_ms < 1500, f"one scrape took {worst_ms:.0f} ms")
    check(dawdlers.thrown_out > 0, "nobody who dawdles is thrown out")
    check(descriptors < 200, f"{descriptors} descriptors are open")


def what_is_no_request_is_refused_and_a_long_one_ended(bed):
    bed.tracked()
    process = exporter(bed)

    def answer_to(octets):
        with socket.create_connection(ADDRESS, timeout=5) as client:
            try:
                client.sendall(octets)
                answer = b""
                while piece := client.recv(65536):
                    answer += piece
            except ConnectionError:
                return b"reset"
            return answer

    for octets, status in ((b"\x16\x03\x01\x00\x05hello\r\n\r\n", b"400"), (b"POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 5\r\n\r\nhello", b"405"),
                           (b"GET /etc/passwd HTTP/1.1\r\nHost: x\r\n\r\n", b"404"), (REQUEST, b"200")):
        first = answer_to(octets).split(b"\r\n", 1)[0]
        check(status in first or (status == b"400" and first in (b"", b"reset")), f"{octets[:30]!r} is answered with {first!r}")
    before = resident_kb(process)
    for _ in range(20):
        long = answer_to(b"GET /metrics HTTP/1.1\r\nX: " + b"x" * 4_000_000)
        check(b" 200 " not in long.split(b"\r\n", 1)[0], "a header of 4 MB is answered")
    grown = resident_kb(process) - before
    say(f"20 requests of 4 MB: {grown} kB more resident")
    check_timing(grown < 4096, f"{grown} kB more resident")
    check(scraped()[0], "nothing is answered any more")


def resident_kb(process):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{process.pid}/status").read_text())[1])


def twenty_thousand_invented_instruments_fill_neither_exporter_nor_top(bed):
    bed.tracked()
    process = exporter(bed)
    top = subprocess.Popen([bed.program("tubectl"), "top"], stdout=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(top.kill)
    time.sleep(3)
    before = {name: resident_kb(each) for name, each in (("exporter", process), ("top", top))}
    forger = subprocess.Popen([bed.program("forger"), "", "reports", "20000"], stdout=subprocess.DEVNULL, preexec_fn=calm.die_with_parent)
    bed.closing.callback(forger.kill)
    check(forger.wait(120 * beds.TIME_FACTOR) == 0, "the forger failed")
    grown = {"exporter": resident_kb(process) - before["exporter"], "top": resident_kb(top) - before["top"]}
    text = scraped()[0]
    instruments = set(re.findall(r'tubed_up\{instrument="([^"]*)"\}', text))
    say(f"20,000 invented instruments: exporter {grown['exporter']} kB more, top {grown['top']} kB more; {len(instruments)} instruments shown")
    check(len(instruments) <= 8 and 'tubed_up{instrument="cath-1"} 1' in text, f"shown: {sorted(instruments)[:20]}")
    for name, kb in grown.items():
        check_timing(kb < 4096, f"{name} grew by {kb} kB")


def what_is_exported_satisfies_promtool_and_the_alerts(bed):
    if shutil.which("promtool") is None:
        raise Skip("no promtool: apt-get install prometheus")
    bed.tracked()
    exporter(bed)
    text = scraped()[0]
    judged = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, check=False)
    check(judged.returncode == 0, f"promtool: {judged.stdout}{judged.stderr}")
    rules = subprocess.run(["promtool", "check", "rules", str(ALERTS)], capture_output=True, text=True, check=False)
    check(rules.returncode == 0, f"promtool: {rules.stdout}{rules.stderr}")
    asked = {name for line in ALERTS.read_text().splitlines() if "expr:" in line for name in re.findall(r"tubed_\w+", line)}
    missing = {name for name in asked if f"# TYPE {name} " not in text}
    check(asked and not missing, f"alerts ask for what is not exported: {missing}")
    say(f"promtool has no word against {len(text.splitlines())} lines; the alerts ask for {len(asked)} metrics, which are there")


if __name__ == "__main__":
    beds.main(a_slow_client_costs_a_quick_one_nothing, a_hundred_clients_that_dawdle_shut_nobody_out,
              what_is_no_request_is_refused_and_a_long_one_ended, twenty_thousand_invented_instruments_fill_neither_exporter_nor_top,
              what_is_exported_satisfies_promtool_and_the_alerts)
