"""What the checks inside the container share: commands, the journal, the configuration, waiting."""
import functools
import json
import pathlib
import re
import subprocess
import time

WATCHDOG_S = 2
CONFIGURATION = pathlib.Path("/etc/tubed/tubed.toml")
UNIT = "tubed.service"
# Where a service manager may not raise limits, these stand in for LimitRTPRIO= and LimitMEMLOCK=.
STAND_INS = "CAP_IPC_LOCK CAP_SYS_NICE"
STAND_INS_MASK = f"{1 << 14 | 1 << 23:016x}"


def command(*words, timeout_s=40):
    return subprocess.run(words, capture_output=True, text=True, check=False, timeout=timeout_s)


def shown(name, unit=UNIT):
    return command("systemctl", "show", "--value", "-p", name, unit).stdout.strip()


def main_pid(unit=UNIT):
    return int(shown("MainPID", unit))


def journal(since, unit=UNIT):
    command("journalctl", "--sync")
    return command("journalctl", "-u", unit, "-o", "cat", "--since", f"@{since:.3f}").stdout


def expect(condition, message):
    if not condition:
        raise AssertionError(message)


def wait_until(condition, what, timeout_s):
    """Seconds it took."""
    begun = time.monotonic()
    while time.monotonic() - begun < timeout_s:
        if condition():
            return time.monotonic() - begun
        time.sleep(0.02)
    raise AssertionError(f"not {what} within {timeout_s} s; status: {shown('StatusText')}, {shown('ActiveState')}")


def says_valid():
    """Of the newest second: an estimate that a subscriber inside gets is VALID."""
    answer = command("tubectl", "echo", "--json", "--count", "1", "--seconds", "1").stdout
    return bool(answer) and json.loads(answer.splitlines()[0]).get("validity_name") == "VALID"


def change(key, value):
    text = CONFIGURATION.read_text()
    changed, found = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text, count=1)
    expect(found == 1, f"no {key} in {CONFIGURATION}")
    CONFIGURATION.write_text(changed)


@functools.cache
def may_raise_limits():
    """Whether this machine's service manager may grant the unit's limits: not without CAP_SYS_RESOURCE."""
    hard = command("systemd-run", "--wait", "--pipe", "-q", "-p", "LimitRTPRIO=90", "sh", "-c", "ulimit -Hr").stdout.strip()
    return hard == "90"
