"""What `./run demo` says of its progress, with the time and the processor that each step took."""
import os
import time

from bare_root import processor_s

# A line that begins so begins the phase; the last one of ./run demo begins before anything is done.
BEGINNINGS = (("== ./run demo", "looking"), ("== installing", "installing"), ("== configuring", "configuring"), ("== compiling", "compiling"),
              ("== starting", "starting"), ("first VALID shape after", "first VALID"))
BOLD, PLAIN = "\033[1m", "\033[0m"


class Missing(Exception):
    """What was never said."""


class Phases:
    """Of one command, in the order in which they began."""

    def __init__(self):
        self.began = time.monotonic()
        self.lines = []
        self._rest = ""
        self._marks = []  # (name, when it began, processor until then)

    def hear(self, piece, pid):
        """What was said just now, by the process of that number and those that it started."""
        text = self._rest + piece.decode(errors="replace")
        *lines, self._rest = text.replace("\r", "\n").split("\n")
        for line in lines:
            line = line.replace(BOLD, "").replace(PLAIN, "").replace("\033[K", "").strip()
            if not line:
                continue
            self.lines.append(line)
            print(f"{self.total_s():7.1f}  {line}", flush=True)
            for beginning, name in BEGINNINGS:
                if line.startswith(beginning):
                    self._mark(name, pid)

    def _mark(self, name, pid):
        # A second installation (of what the browser needs) belongs to the first.
        if name not in (mark[0] for mark in self._marks):
            self._marks.append((name, time.monotonic(), processor_s(pid)))

    def end(self, name):
        self._mark(name, 0)

    def need(self, *names):
        missing = [name for name in names if name not in (mark[0] for mark in self._marks)]
        if missing:
            raise Missing(f"it never said: {', '.join(missing)}\n{self.tail()}")

    def total_s(self):
        return time.monotonic() - self.began

    def _index(self, name):
        return next((i for i, mark in enumerate(self._marks[:-1]) if mark[0] == name), None)

    def seconds(self, name):
        """From its beginning to that of the next."""
        i = self._index(name)
        return 0.0 if i is None else self._marks[i + 1][1] - self._marks[i][1]

    def processor_s(self, name):
        i = self._index(name)
        return 0.0 if i is None else max(self._marks[i + 1][2] - self._marks[i][2], 0.0)

    def until(self, name):
        """From the command until the phase began; None when it never did."""
        return next((mark[1] - self.began for mark in self._marks if mark[0] == name), None)

    def tail(self):
        return "\n".join(f"    {line}" for line in self.lines[-30:])


class Table:
    """A row for each command."""

    HEAD = "| command | new packages | apt | cmake | compile | first VALID shape after | all of it |"

    def __init__(self, bare_packages):
        self._bare_packages = bare_packages
        self._rows = []

    def add(self, command, phases, packages, last):
        def cell(name):
            return f"{phases.seconds(name):.0f} s ({phases.processor_s(name):.0f} s)"
        steps = " | ".join(cell(name) for name in ("installing", "configuring", "compiling"))
        valid_s = phases.until("first VALID")
        self._rows.append(f"| {command} | {packages} | {steps} | {f'{valid_s:.0f} s' if valid_s else ''} | {phases.until(last):.0f} s |")

    def text(self):
        return "\n".join([self.HEAD, "|---" * 7 + "|", *self._rows, "",
                          f"In brackets: seconds of processor. {os.cpu_count()} processors, load average {os.getloadavg()[1]:.1f} over the last "
                          f"5 minutes, {self._bare_packages} packages in the bare root."])
