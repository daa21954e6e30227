"""What 60-tubed.rules makes of devices, as udev would; and that every line of it can be understood.

udev itself needs real devices, and `udevadm verify` systemd 254: that judges as well where it is there.
"""
import fnmatch
import pathlib
import re
import shutil
import subprocess
import sys

RULES = pathlib.Path(__file__).resolve().parent.parent.parent / "systemd" / "60-tubed.rules"
TOKEN = re.compile(r'(?P<key>[A-Z]+)(?:\{(?P<attribute>\w+)\})?(?P<operator>==|!=|\+=|=)"(?P<value>[^"]*)"')
MATCHES = {"ACTION", "SUBSYSTEM", "DRIVER", "ATTRS"}


def parsed(text):
    """A list of (key, attribute, operator, value) a rule."""
    rules = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line or line.startswith("#"):
            continue
        tokens = [TOKEN.fullmatch(part) for part in re.split(r', (?=[A-Z])', line)]
        if not all(tokens):
            raise AssertionError(f"{RULES.name}:{number}: cannot be understood: {line}")
        rules.append([token.group("key", "attribute", "operator", "value") for token in tokens])
    return rules


def any_of(pattern, value):
    return value is not None and any(fnmatch.fnmatchcase(value, one) for one in pattern.split("|"))


def matches(tests, device):
    for key, _, operator, value in tests:
        if key != "ATTRS" and any_of(value, device[key]) != (operator == "=="):
            return False
    attributes = [(name, value) for key, name, _, value in tests if key == "ATTRS"]
    # All of them at one and the same device on the way up.
    return not attributes or any(all(any_of(value, parent.get(name)) for name, value in attributes) for parent in device["parents"])


def applied(rules, device):
    """What the rules set: {"GROUP": ..., "SYMLINK": [...], "latency_timer": ...}."""
    found = {"SYMLINK": []}
    label = None
    for rule in rules:
        if label is not None:
            label = None if ("LABEL", None, "=", label) in rule else label
            continue
        if not matches([token for token in rule if token[0] in MATCHES], device):
            continue
        for key, attribute, operator, value in (token for token in rule if token[0] not in MATCHES):
            if key == "GOTO":
                label = value
            elif key == "SYMLINK":
                assert operator == "+=", "other rules' links are thrown away"
                found[key].append(value.replace("$attr{serial}", device["parents"][-1].get("serial", "")))
            elif key != "LABEL":
                found[attribute or key] = value
    assert label is None, f"no LABEL {label}"
    return found


def device(subsystem, vendor, product, serial=None, action="add"):
    usb = {"idVendor": vendor, "idProduct": product} | ({"serial": serial} if serial else {})
    return {"ACTION": action, "SUBSYSTEM": subsystem, "DRIVER": "ftdi_sio" if subsystem == "usb-serial" else "",
            "parents": [{}, {"bInterfaceNumber": "00"}, usb]}


def expect(found, **wanted):
    wanted = {"SYMLINK": []} | wanted
    chosen = {key: found.get(key) for key in ("SYMLINK", "GROUP", "MODE", "ID_MM_DEVICE_IGNORE", "latency_timer") if key in found or key in wanted}
    assert chosen == wanted, f"{chosen}, expected {wanted}"


def ndis_devices_belong_to_group_tubed(rules):
    for vendor, product in (("0403", "da70"), ("0403", "da71"), ("0403", "da72"), ("0403", "da73"), ("23f2", "0003")):
        expect(applied(rules, device("tty", vendor, product, "A1")), GROUP="tubed", MODE="0660", ID_MM_DEVICE_IGNORE="1")


def the_aurora_has_a_name_that_stays(rules):
    wanted = {"GROUP": "tubed", "MODE": "0660", "ID_MM_DEVICE_IGNORE": "1"}
    expect(applied(rules, device("tty", "0403", "da74", "A1")), SYMLINK=["tubed/aurora", "tubed/aurora-A1"], **wanted)
    expect(applied(rules, device("tty", "0403", "da74")), SYMLINK=["tubed/aurora"], **wanted)


def ftdi_chips_hold_nothing_back(rules):
    for vendor, product in (("0403", "da70"), ("0403", "da74"), ("23f2", "0003"), ("0403", "6001"), ("0403", "6010"), ("0403", "6011"),
                            ("0403", "6014"), ("0403", "6015")):
        for action in ("add", "bind"):
            expect(applied(rules, device("usb-serial", vendor, product, action=action)), latency_timer="1")
    expect(applied(rules, device("usb-serial", "0403", "6001", action="unbind")))


def adapters_of_others_stay_what_they_are(rules):
    for vendor, product in (("0403", "6001"), ("0403", "da75"), ("067b", "2303"), ("23f2", "0004")):
        expect(applied(rules, device("tty", vendor, product, "A1")))
    expect(applied(rules, device("usb-serial", "067b", "2303")))


def what_is_pulled_out_is_left_alone(rules):
    expect(applied(rules, device("tty", "0403", "da74", "A1", action="remove")))


def udev_understands_every_line(_):
    if shutil.which("udevadm") is None or "verify" not in subprocess.run(["udevadm", "--help"], capture_output=True, text=True, check=False).stdout:
        print("not judged by udevadm verify (systemd 254)")
        return
    judged = subprocess.run(["udevadm", "verify", str(RULES)], capture_output=True, text=True, check=False)
    assert judged.returncode == 0, judged.stdout + judged.stderr


def main():
    failed = 0
    rules = parsed(RULES.read_text(encoding="ascii"))
    for check in (ndis_devices_belong_to_group_tubed, the_aurora_has_a_name_that_stays, ftdi_chips_hold_nothing_back,
                  adapters_of_others_stay_what_they_are, what_is_pulled_out_is_left_alone, udev_understands_every_line):
        try:
            check(rules)
            print(f"passed: {check.__name__}")
        except AssertionError as failure:
            failed += 1
            print(f"FAILED: {check.__name__}: {failure}")
    return 1 if failed else 0


sys.exit(main())
