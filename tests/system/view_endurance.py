#!/usr/bin/env python3
"""The memory of daemon, viewer and page while somebody looks for an hour. TUBED_MINUTES: how many instead of 60."""
import contextlib
import os
import pathlib
import time

import bed as beds
import browser as browsers
import view
from bed import check, say

MINUTES = int(os.environ.get("TUBED_MINUTES", "60"))
WARM_UP = 1 / 6  # the part in which buffers grow to their sizes
MAX_KB = {"daemon": 512, "viewer": 512, "objects of the page": 1024}  # more in the last than in the first of what follows, an hour
MAX_PAGE_SHARE = 0.1  # of the browser's processes: its caches are its own business


def measured(window, daemon, viewer):
    """kB, after the page's garbage is collected. Of the programs what they have written to themselves: no file's pages."""
    window.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    heap = window.driver.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"]
    return {"daemon": anonymous_kb(daemon.pid), "viewer": anonymous_kb(viewer.pid), "objects of the page": heap / 1024,
            "browser": sum(map(proportional_kb, processes_of(window.driver.service.process.pid)))}


def anonymous_kb(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("RssAnon:"))


def processes_of(first):
    """Process ids of a process and of all that it started, whichever of its threads did."""
    parents = {}
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):  # it has ended
            parents[int(stat.parent.name)] = int(stat.read_text(encoding="ascii").rpartition(")")[2].split()[1])
    found = {first}
    while more := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def proportional_kb(pid):
    """Pages that processes share count once."""
    with open(f"/proc/{pid}/smaps_rollup", encoding="ascii") as lines:
        return next(int(line.split()[1]) for line in lines if line.startswith("Pss:"))


def mean(rows, name):
    return sum(row[name] for row in rows) / len(rows)


def an_hour_of_the_page_takes_no_more_memory(bed):
    daemon, subscriber = bed.tracked(view.with_previews(bed))
    subscriber.stop()  # it keeps all that it hears
    viewer = view.view(bed)
    window = browsers.Browser(640, 480)
    bed.closing.callback(window.close)
    window.open(view.ADDRESS)
    window.wait("window.tubedView && document.body.classList.contains('valid') && tubedView.counts.images > 0", "a VALID shape in the page", 20)
    rows, began = [], time.monotonic()
    painted = lambda: window.run("return tubedView.counts.estimates;")
    before = painted()
    while time.monotonic() < began + 60 * MINUTES:
        time.sleep(min(60, 6 * MINUTES))
        rows.append(measured(window, daemon.process, viewer))
        if len(rows) % 10 == 0:
            say(f"{(time.monotonic() - began) / 60:.0f} min: " + ", ".join(f"{name} {kb:.0f} kB" for name, kb in rows[-1].items()))
    seconds = time.monotonic() - began
    check((painted() - before) / seconds > 30, f"only {(painted() - before) / seconds:.1f} samples a second were painted")
    rows = rows[int(WARM_UP * len(rows)):]
    first, last = rows[:len(rows) // 4], rows[-(len(rows) // 4):]
    grown = {name: mean(last, name) - mean(first, name) for name in rows[0]}
    say(f"from the first to the last quarter of {len(rows)} measurements in {seconds / 60:.0f} min: "
        + ", ".join(f"{name} {mean(first, name):.0f} kB and {kb:+.0f}" for name, kb in grown.items()))
    for name, max_kb in MAX_KB.items():
        check(grown[name] <= max_kb, f"{name}: {grown[name]:.0f} kB more at the end")
    check(grown["browser"] <= MAX_PAGE_SHARE * mean(first, "browser"), f"the browser: {grown['browser']:.0f} kB more at the end")


if __name__ == "__main__":
    beds.main(an_hour_of_the_page_takes_no_more_memory)
