"""Runs inside the container: trackers at a serial port and behind CAN, as units of their own."""
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import time

from service_commands import (STAND_INS, command, expect, journal, main_pid, may_raise_limits, shown, wait_until)


def tracker_at_a_serial_port(emulator):
    """Another room, whose tracker is an emulated Aurora at a serial port; the unit's name."""
    pathlib.Path("/etc/tubed/right.toml").write_text(
        '[dds]\nnetwork_interface = "lo"\npartition = "right"\n'
        '[em]\ndriver = "aurora-serial"\ndevice = "/run/tubed/aurora"\nT_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n'
        '[[instrument]]\nid = "cath-9"\nmode = "em"\nlength_mm = 380.0\n' + "".join(
            f"[[instrument.coil]]\nsensor = {sensor}\noffset_from_tip_mm = {offset_mm}\nport = {(sensor + 1) // 2}\n"
            f"channel = {(sensor + 1) % 2}\n" for sensor, offset_mm in enumerate((10.0, 90.0, 170.0, 270.0, 370.0), 1)))
    drop_in = pathlib.Path("/etc/systemd/system/tubed@right.service.d/pty.conf")
    drop_in.parent.mkdir()
    # An emulated port is a pseudo-terminal, which no unit for real trackers has to be let at.
    drop_in.write_text("[Service]\nDeviceAllow=char-pts rw\n" + (
        f"CapabilityBoundingSet={STAND_INS}\nAmbientCapabilities={STAND_INS}\n" if not may_raise_limits() else ""))
    command("systemctl", "daemon-reload")
    started = command("systemctl", "start", "tubed@right.service")
    expect(started.returncode == 0, f"start: {started.stderr} {journal(time.time() - 30, 'tubed@right.service')}")
    expect(emulator.poll() is None, "the emulated tracker ended")
    return "tubed@right.service"


def an_aurora_unplugged_and_back_needs_no_restart():
    def valid():
        answer = command("tubectl", "echo", "--partition", "right", "--json", "--count", "1", "--seconds", "1").stdout
        return bool(answer) and json.loads(answer.splitlines()[0]).get("validity_name") == "VALID"

    def tell(words):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
            sender.sendto(words.encode(), "/run/tubed/tracker.sock")

    emulator = subprocess.Popen(["tubectl", "aurora-emulator", "--link", "/run/tubed/aurora", "--control", "/run/tubed/tracker.sock"],
                                user="tubed", group="tubed", start_new_session=True)
    try:
        wait_until(lambda: os.path.exists("/run/tubed/aurora"), "there, the emulated port", 5)
        unit = tracker_at_a_serial_port(emulator)
        wait_until(valid, "valid with an Aurora", 15)
        pid = main_pid(unit)
        tell("disconnect")
        wait_until(lambda: not valid() and "EM_STALE" in shown("StatusText", unit), "said to be stale", 5)
        time.sleep(1)
        tell("connect")
        valid_s = wait_until(valid, "valid again", 15)
        expect(main_pid(unit) == pid, "it was restarted")
        command("systemctl", "stop", unit)
        return f"cable out and in: valid {valid_s:.2f} s after"
    finally:
        emulator.kill()
        emulator.wait()


def one_gateway_at_a_time_has_the_serial_port():
    left, right = "tubed-can-gateway@can0.service", "tubed-can-gateway@can1.service"
    expect(command("systemctl", "is-enabled", left).stdout.strip() == "disabled", "the gateway is enabled after installation")
    for name in ("can0", "can1"):
        pathlib.Path(f"/etc/tubed/can-gateway-{name}.env").write_text("SERIAL=/run/tubed/bridged\nOPTIONS=--layout classic\n")
    drop_in = pathlib.Path("/etc/systemd/system/tubed-can-gateway@.service.d")
    drop_in.mkdir()
    (drop_in / "pty.conf").write_text("[Service]\nDeviceAllow=char-pts rw\n")  # as for tubed@right.service
    command("systemctl", "daemon-reload")
    emulator = subprocess.Popen(["tubectl", "aurora-emulator", "--link", "/run/tubed/bridged"], user="tubed", group="tubed",
                                start_new_session=True)
    try:
        wait_until(lambda: os.path.exists("/run/tubed/bridged"), "there, the emulated port", 5)
        since = time.time()
        expect(command("systemctl", "start", left).returncode == 0, f"start: {journal(since, left)}")
        wait_until(lambda: re.search("can0 (cannot|is not)", journal(since, left)), "told of its interface by the first gateway", 10)
        command("systemctl", "start", right)
        wait_until(lambda: "is used by another program" in journal(since, right), "refused, the second gateway", 5)
        expect(shown("ActiveState", left) == "active", "the first gateway ended with the second")
        os.kill(main_pid(left), signal.SIGKILL)
        taken_s = wait_until(lambda: re.search("can1 (cannot|is not)", journal(since, right)) or int(shown("NRestarts", left)) > 0,
                             "used again, the port", 10)
        command("systemctl", "stop", left, right)
        return f"the second is refused; after a kill one has the port {taken_s:.1f} s later"
    finally:
        emulator.kill()
        emulator.wait()


def a_wrong_command_line_of_the_gateway_is_not_tried_again():
    unit = "tubed-can-gateway@can2.service"
    pathlib.Path("/etc/tubed/can-gateway-can2.env").write_text("OPTIONS=--base-id 0x310\n")
    since = time.time()
    command("systemctl", "start", unit)
    wait_until(lambda: shown("ActiveState", unit) == "failed", "failed, the gateway", 5)
    expect((shown("ExecMainStatus", unit), shown("NRestarts", unit)) == ("64", "0"), f"exit {shown('ExecMainStatus', unit)}")
    expect("a base is a multiple of 0x80" in journal(since, unit), journal(since, unit))


def a_tracker_behind_can_is_told_which_drop_in_lets_it_in():
    """Of log and doctor; whether this kernel has CAN at all is another matter (tests/kernel)."""
    unit, configuration = "tubed@bus.service", "/etc/tubed/bus.toml"

    def sandbox():
        findings = json.loads(command("tubectl", "doctor", "--json", "-c", configuration).stdout)
        return next(one for one in findings if one["check"] == "tracker sandbox")

    pathlib.Path(configuration).write_text(
        '[dds]\nnetwork_interface = "lo"\npartition = "bus"\n[em]\ndriver = "aurora-can"\ndevice = "can0"\n'
        'T_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n[[instrument]]\nid = "cath-7"\nmode = "em"\nlength_mm = 100.0\n'
        '[[instrument.coil]]\nsensor = 1\noffset_from_tip_mm = 10.0\n[[instrument.coil]]\nsensor = 2\noffset_from_tip_mm = 90.0\n')
    since = time.time()
    started = command("systemctl", "start", unit)
    expect(started.returncode == 0, f"start: {started.stderr} {journal(since, unit)}")
    wait_until(lambda: "/usr/share/tubed/can.conf" in journal(since, unit), "told of the drop-in, the journal", 5)
    expect("AF_CAN" not in shown("RestrictAddressFamilies", unit).split(), "CAN is let in already")
    expect(sandbox()["verdict"] == "WRONG" and "/usr/share/tubed/can.conf" in sandbox()["advice"], str(sandbox()))
    command("install", "-D", "-m", "644", "/usr/share/tubed/can.conf", "/etc/systemd/system/tubed@.service.d/can.conf")
    command("systemctl", "daemon-reload")
    expect("AF_CAN" in shown("RestrictAddressFamilies", unit).split(), shown("RestrictAddressFamilies", unit))
    expect(sandbox()["verdict"] == "good", str(sandbox()))
    command("systemctl", "stop", unit)
