"""Runs inside the container, as root, beside a systemd of its own: tubed as the service that the package brought.

Each check is a function; its sentence and outcome go to the file named on the command line.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import traceback
import urllib.request

from service_commands import (CONFIGURATION, STAND_INS, STAND_INS_MASK, UNIT, WATCHDOG_S, change, command, expect, journal, main_pid,
                              may_raise_limits, says_valid, shown, wait_until)
from service_trackers_inside import (a_tracker_behind_can_is_told_which_drop_in_lets_it_in, a_wrong_command_line_of_the_gateway_is_not_tried_again,
                                     an_aurora_unplugged_and_back_needs_no_restart, one_gateway_at_a_time_has_the_serial_port)


def the_package_starts_nothing_by_itself():
    expect(command("systemctl", "is-enabled", UNIT).stdout.strip() == "disabled", "the unit is enabled after installation")
    expect(shown("ActiveState") == "inactive", f"the unit is {shown('ActiveState')} after installation")
    expect(command("id", "-un", "tubed").stdout.strip() == "tubed", "no user tubed")
    expect("dialout" in command("id", "-Gn", "tubed").stdout.split(), "user tubed may not open serial adapters")
    expect("video" in command("id", "-Gn", "tubed").stdout.split(), "user tubed may not open capture cards")


def it_is_ready_when_it_publishes():
    change("control_folder", '"/run/tubed"')
    begun = time.monotonic()
    started = command("systemctl", "start", UNIT)
    expect(started.returncode == 0, f"start: {started.stderr} {journal(time.time() - 30)}")
    ready_s = time.monotonic() - begun
    answer = command("tubectl", "echo", "--json", "--count", "1", "--seconds", "2")
    expect(answer.returncode == 0, "ready, but a subscriber gets nothing")
    logs = pathlib.Path("/var/log/tubed")
    expect(logs.is_dir() and logs.owner() == "tubed", "no folder for traces of the tracker's line")
    wait_until(lambda: "cath-1" in shown("StatusText"), "a status in words", 3)
    return f"ready after {ready_s:.2f} s; status: {shown('StatusText')}"


def a_subscriber_gets_valid_shapes_at_30_hz():
    wait_until(says_valid, "valid", 10)
    report = json.loads(command("tubectl", "stat", "--seconds", "4", "--json").stdout)["instruments"]["cath-1"]
    expect(29 <= report["rate_hz"] <= 31, f"{report['rate_hz']} Hz")
    return f"{report['rate_hz']:.2f} Hz, {report['validity']}"


def its_threads_have_their_priorities():
    wanted = {"em": 60, "grab-A": 55, "publisher": 52, "optimizer": 50, "frangi-A": 45}
    found = {}
    for task in pathlib.Path(f"/proc/{main_pid()}/task").iterdir():
        name = (task / "comm").read_text().strip()
        if os.sched_getscheduler(int(task.name)) & 0xF == os.SCHED_FIFO:
            found[name] = os.sched_getparam(int(task.name)).sched_priority
    expect(found == wanted, f"SCHED_FIFO: {found}, expected {wanted}")
    return str(found)


def its_memory_is_locked():
    status = pathlib.Path(f"/proc/{main_pid()}/status").read_text()
    expect(int(re.search(r"VmLck:\s+(\d+) kB", status)[1]) > 0, "nothing is locked")
    pages = pathlib.Path(f"/proc/{main_pid()}/smaps_rollup").read_text()
    locked_kb, share_kb, resident_kb = (int(re.search(rf"\n{name}:\s+(\d+) kB", pages)[1]) for name in ("Locked", "Pss", "Rss"))
    expect(locked_kb >= 0.99 * share_kb, f"{locked_kb} kB of {share_kb} kB are locked")
    expect(resident_kb < 128 * 1024, f"{resident_kb} kB are resident")
    before = faults()
    time.sleep(3)
    new = faults() - before
    expect(new == 0, f"{new} page faults of the real-time threads in 3 s")
    return f"{resident_kb // 1024} MB resident and locked, no page fault of a real-time thread in 3 s"


def faults():
    """Page faults, minor and major, of the threads with SCHED_FIFO."""
    count = 0
    for task in pathlib.Path(f"/proc/{main_pid()}/task").iterdir():
        if os.sched_getscheduler(int(task.name)) & 0xF == os.SCHED_FIFO and (task / "comm").read_text().strip() != "publisher":
            fields = (task / "stat").read_text().rsplit(")", 1)[1].split()
            count += int(fields[7]) + int(fields[9])
    return count


def it_has_no_rights_it_does_not_need():
    status = pathlib.Path(f"/proc/{main_pid()}/status").read_text()
    uid = int(re.search(r"Uid:\s+(\d+)", status)[1])
    expect(uid == int(command("id", "-u", "tubed").stdout), f"runs as user {uid}")
    capabilities = "0" * 16 if may_raise_limits() else STAND_INS_MASK
    for name, value in (("CapEff", capabilities), ("CapBnd", capabilities), ("NoNewPrivs", "1"), ("Seccomp", "2")):
        found = re.search(rf"{name}:\s+(\S+)", status)[1]
        expect(found == value, f"{name} is {found}, expected {value}")


def permits(directive, action):
    """Whether Python may do that in a unit with this directive."""
    return command("systemd-run", "--wait", "--pipe", "-q", "-p", directive, sys.executable, "-c", f"import socket\n{action}").returncode == 0


def its_network_is_this_host():
    """What the unit asks for; and, since systemd says nothing when it cannot, what of it this machine enforces."""
    # systemd 252 shows ipv4:udp as "ipv4:udpany".
    for name, values in (("RestrictNetworkInterfaces", {"lo"}), ("SocketBindDeny", {"any"}), ("SocketBindAllow", {"ipv4:udp", "ipv4:udpany"}),
                         ("IPAddressAllow", {"127.0.0.0/8", "::1/128"})):
        found = set(shown(name).split())
        expect(found and found <= values, f"{name} is {found}, expected {values}")
    send = "socket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', ('127.0.0.1', 5555))"
    listen = "socket.socket().bind(('127.0.0.1', 5555))"
    expect(permits("IPAddressAllow=any", send) and permits("SocketBindAllow=any", listen), "nothing can be judged here")
    ignored = [directive for directive, action in (("RestrictNetworkInterfaces=~lo", send), ("SocketBindDeny=any", listen),
                                                   ("IPAddressDeny=any", send)) if permits(directive, action)]
    return f"asked for; silently ignored by this machine's systemd: {' '.join(ignored) or 'nothing'}"


def a_good_reload_changes_the_log_level_and_nothing_else():
    pid, since = main_pid(), time.time()
    change("log_level", '"debug"')
    change("rate_hz", "25.0")
    reloaded = command("systemctl", "reload", UNIT)
    expect(reloaded.returncode == 0, f"reload: {reloaded.stderr}")
    wait_until(lambda: "reload: done" in journal(since), "reloaded", 3)
    change("rate_hz", "30.0")  # only now: the daemon reads the file when it has the signal
    expect("daemon.rate_hz differs from what runs: takes effect with a restart" in journal(since), journal(since))
    expect(main_pid() == pid, "a reload restarted the daemon")


def a_bad_reload_keeps_what_runs_and_says_so():
    pid, since = main_pid(), time.time()
    kept = CONFIGURATION.read_text()
    change("log_level", '"loud"')
    refused = command("systemctl", "reload", UNIT)
    os.kill(pid, signal.SIGHUP)  # past the check of the unit
    try:
        wait_until(lambda: "the configuration that runs is kept" in journal(since), "said to be kept", 3)
    finally:
        CONFIGURATION.write_text(kept)
    expect(refused.returncode != 0, "systemctl reload of a wrong file succeeds")
    expect(re.search(r"tubed\.toml:\d+:\d+:.*log_level", journal(since)), f"no place in: {journal(since)}")
    expect(main_pid() == pid and shown("ActiveState") == "active" and says_valid(), "it does not go on")


def grant_capabilities_instead():
    drop_in = pathlib.Path("/etc/systemd/system/tubed.service.d/limits.conf")
    drop_in.parent.mkdir()
    drop_in.write_text(f"[Service]\nCapabilityBoundingSet={STAND_INS}\nAmbientCapabilities={STAND_INS}\n")
    command("systemctl", "daemon-reload")


def fault(words):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
        sender.sendto(words.encode(), "/run/tubed/em.sock")


def a_tracker_that_falls_silent_and_comes_back_needs_no_restart():
    pid = main_pid()
    begun = time.monotonic()
    fault(f"stall {WATCHDOG_S + 2:.1f}")
    said_s = wait_until(lambda: "EM_STALE" in shown("StatusText"), "said to be stale", 2)
    expect(command("tubectl", "echo", "--count", "1", "--seconds", "1").returncode == 0, "no estimates without a tracker")
    expect(not says_valid(), "valid without a tracker")
    wait_until(says_valid, "valid", WATCHDOG_S + 4)
    expect(main_pid() == pid, "it was restarted")
    return f"status after {said_s:.2f} s; silent for {WATCHDOG_S + 2} s, valid after {time.monotonic() - begun:.2f} s"


def comes_back(number, limit_s):
    pid = main_pid()
    begun = time.monotonic()
    os.kill(pid, number)
    wait_until(lambda: main_pid() not in (0, pid), "restarted", limit_s)
    restarted_s = time.monotonic() - begun
    wait_until(says_valid, "valid", max(0.1, limit_s - restarted_s))
    total_s = time.monotonic() - begun
    return f"restarted after {restarted_s:.2f} s, valid after {total_s:.2f} s"


def a_hung_daemon_is_valid_again_within_the_watchdog_and_3_s():
    return comes_back(signal.SIGSTOP, WATCHDOG_S + 3)


def the_journal_has_fields_beside_the_words():
    command("journalctl", "--sync")
    found = {}
    for line in command("journalctl", "-u", UNIT, "-o", "json").stdout.splitlines():
        entry = json.loads(line)
        for name in ("TUBED_STAGE", "TUBED_INSTRUMENT"):
            if name in entry:
                found.setdefault((name, entry[name]), entry)
    stage, instrument = found.get(("TUBED_STAGE", "em")), found.get(("TUBED_INSTRUMENT", "cath-1"))
    expect(stage and instrument, f"entries with fields: {list(found)}")
    expect(stage["MESSAGE"].startswith(f"em is {stage['TUBED_STATE']}") and "\x1f" not in stage["MESSAGE"], str(stage))
    expect(stage["_SYSTEMD_UNIT"] == UNIT and stage["SYSLOG_IDENTIFIER"] == "tubed" and stage["PRIORITY"] in "346", str(stage))
    valid = command("journalctl", "-u", UNIT, "-o", "cat", "TUBED_INSTRUMENT=cath-1", "TUBED_VALIDITY=VALID").stdout.splitlines()
    expect(valid and all(line.startswith("cath-1 is VALID") for line in valid), f"asked for VALID: {valid[:3]}")
    return f"{len(valid)} entries of cath-1 becoming VALID found by field"


def a_killed_daemon_is_valid_again_within_3_s():
    return comes_back(signal.SIGKILL, 3)


def a_second_room_runs_beside_the_first():
    left = pathlib.Path("/etc/tubed/left.toml")
    left.write_text(re.sub(r"(?m)^partition = .*$", 'partition = "left"', CONFIGURATION.read_text())
                    .replace('control_folder = "/run/tubed"', 'control_folder = ""'))
    started = command("systemctl", "start", "tubed@left.service")
    expect(started.returncode == 0, f"start: {started.stderr} {journal(time.time() - 30, 'tubed@left.service')}")
    answer = command("tubectl", "echo", "--partition", "left", "--count", "1", "--seconds", "2")
    expect(answer.returncode == 0, "nothing from the second room")
    command("systemctl", "stop", "tubed@left.service")
    expect(shown("ActiveState") == "active", "the first room ended with the second")


def the_viewer_serves_its_page():
    command("systemctl", "start", "tubed-view.service")
    time.sleep(1)
    with urllib.request.urlopen("http://127.0.0.1:8080/", timeout=5) as answer:
        text = answer.read().decode()
    state = shown("ActiveState", "tubed-view.service")
    command("systemctl", "stop", "tubed-view.service")
    expect("<title>tubed</title>" in text and state == "active", f"{state}: {text[:300]}")


def the_exporter_says_in_prometheus_text_what_the_daemon_reports():
    command("systemctl", "start", "tubed-exporter.service")
    time.sleep(2.5)  # two reports, one a second
    with urllib.request.urlopen("http://127.0.0.1:9756/metrics", timeout=5) as answer:
        text = answer.read().decode()
    command("systemctl", "stop", "tubed-exporter.service")
    from prometheus_client.parser import text_string_to_metric_families
    samples = {(sample.name, tuple(sorted(sample.labels.items()))): sample.value
               for family in text_string_to_metric_families(text) for sample in family.samples}
    expect(samples.get(("tubed_up", (("instrument", "cath-1"),))) == 1, f"not up: {text[:500]}")
    expect(samples[("tubed_validity", (("instrument", "cath-1"), ("validity", "VALID")))] == 1, "not valid")
    expect(samples[("tubed_stage_steps_total", (("instrument", "cath-1"), ("stage", "em")))] > 100, "no steps of em")
    if shutil.which("promtool") is None:
        return f"{len(samples)} samples; not judged by promtool (apt-get install prometheus)"
    judged = subprocess.run(["promtool", "check", "metrics"], input=text, capture_output=True, text=True, check=False)
    expect(judged.returncode == 0, judged.stdout + judged.stderr)
    return f"{len(samples)} samples; promtool has nothing to say"


def what_cannot_start_is_tried_ever_more_slowly_and_for_ever():
    command("systemctl", "stop", UNIT)
    kept, since = CONFIGURATION.read_text(), time.time()
    change("network_interface", '"nosuch0"')
    before = int(shown("NRestarts") or 0)
    command("systemctl", "start", "--no-block", UNIT)
    time.sleep(12)
    restarts = int(shown("NRestarts")) - before
    said = journal(since)
    CONFIGURATION.write_text(kept)
    expect(shown("ActiveState") == "activating", f"it is {shown('ActiveState')}: given up")
    expect(shown("ExecMainStatus") in ("69", "0"), f"exit {shown('ExecMainStatus')}")
    expect(4 <= restarts <= 12, f"{restarts} restarts in 12 s: {said}")  # 50 with RestartSec= alone
    expect("waiting 200 ms" in said and "waiting 2000 ms" in said, f"the waiting is not told: {said}")
    lines = [line for line in said.splitlines() if "cannot start" in line]
    expect(len(lines) <= restarts + 1 and all("nosuch0" in line for line in lines), f"more than one line a start: {lines}")
    ready_s = wait_until(lambda: shown("ActiveState") == "active", "active, the service that can start again", 6)
    expect(not pathlib.Path("/run/tubed/failed-starts").exists(), "a start that succeeded is counted as failed")
    return f"{restarts} restarts in 12 s; active {ready_s:.1f} s after it could be"


def a_wrong_configuration_is_one_clear_line_and_no_restart():
    command("systemctl", "stop", UNIT)
    command("systemctl", "reset-failed", UNIT)
    kept, since = CONFIGURATION.read_text(), time.time()
    change("rate_hz", '"fast"')
    started = command("systemctl", "start", UNIT)
    time.sleep(1)
    CONFIGURATION.write_text(kept)
    expect(started.returncode != 0, "it starts")
    expect(shown("ExecMainStatus") == "78", f"exit {shown('ExecMainStatus')}")
    expect(shown("NRestarts") == "0" and shown("ActiveState") == "failed", f"{shown('NRestarts')} restarts")
    lines = [line for line in journal(since).splitlines() if "tubed.toml:" in line]
    expect(len(lines) == 1 and "rate_hz" in lines[0], f"said: {journal(since)}")
    return lines[0]


def exporter_with_keys(keys):
    """Its user exists only while it runs: systemd hands it the files."""
    drop_in = pathlib.Path("/etc/systemd/system/tubed-exporter.service.d/keys.conf")
    drop_in.parent.mkdir()
    files = "".join(f"LoadCredential={file.name}:{file}\n" for file in sorted(pathlib.Path(keys).iterdir()))
    drop_in.write_text("[Service]\nExecStart=\nExecStart=/usr/bin/tubed-exporter --listen 127.0.0.1:9756 "
                       f"--security ${{CREDENTIALS_DIRECTORY}}\n{files}")
    command("systemctl", "daemon-reload")
    command("systemctl", "start", "tubed-exporter.service")
    time.sleep(3.5)  # the handshake, two reports
    try:
        with urllib.request.urlopen("http://127.0.0.1:9756/metrics", timeout=5) as answer:
            return answer.read().decode()
    finally:
        command("systemctl", "stop", "tubed-exporter.service")
        shutil.rmtree(drop_in.parent)
        command("systemctl", "daemon-reload")


def with_keys_it_runs_in_the_same_sandbox():
    """Made and copied as README.md says, to where only root and the service may read."""
    room, kept = "/root/or-3", CONFIGURATION.read_text()
    made = command("tubectl", "keys", "make-room", room)
    expect(made.returncode == 0, f"make-room: {made.stderr}")
    command("tubectl", "keys", "add", room, "subscriber", "exporter")
    command("install", "-d", "-m", "0750", "-g", "tubed", "/etc/tubed/keys")
    command("sh", "-c", f"install -m 0640 -g tubed {room}/daemon/* /etc/tubed/keys/")
    change("security", '"/etc/tubed/keys"')
    restarted = command("systemctl", "restart", UNIT)
    try:
        expect(restarted.returncode == 0, f"restart: {restarted.stderr} {journal(time.time() - 30)}")
        wait_until(lambda: "VALID" in command("tubectl", "echo", "--json", "--count", "1", "--seconds", "2", "--security",
                                              f"{room}/subscriber").stdout, "valid with keys", 15)
        expect(command("tubectl", "echo", "--count", "1", "--seconds", "2").returncode != 0, "who has no keys hears it")
        doctor = command("tubectl", "doctor").stdout
        expect("security: DDS Security is on: daemon (daemon) of tubed, /etc/tubed/keys, valid until" in doctor, doctor)
        metrics = exporter_with_keys(f"{room}/exporter")
        expect('tubed_up{instrument="cath-1"} 1' in metrics, f"the exporter with keys: {metrics[:300]} "
               + journal(time.time() - 20, "tubed-exporter.service"))
    finally:
        CONFIGURATION.write_text(kept)
        command("systemctl", "restart", UNIT)
    return "daemon, tubectl and exporter"


CHECKS = (the_package_starts_nothing_by_itself, it_is_ready_when_it_publishes, a_subscriber_gets_valid_shapes_at_30_hz,
          its_threads_have_their_priorities, its_memory_is_locked, it_has_no_rights_it_does_not_need, its_network_is_this_host,
          a_good_reload_changes_the_log_level_and_nothing_else, a_bad_reload_keeps_what_runs_and_says_so,
          a_tracker_that_falls_silent_and_comes_back_needs_no_restart, a_hung_daemon_is_valid_again_within_the_watchdog_and_3_s,
          a_killed_daemon_is_valid_again_within_3_s, a_second_room_runs_beside_the_first,
          the_journal_has_fields_beside_the_words, an_aurora_unplugged_and_back_needs_no_restart,
          a_tracker_behind_can_is_told_which_drop_in_lets_it_in, one_gateway_at_a_time_has_the_serial_port,
          a_wrong_command_line_of_the_gateway_is_not_tried_again,
          the_viewer_serves_its_page, the_exporter_says_in_prometheus_text_what_the_daemon_reports,
          what_cannot_start_is_tried_ever_more_slowly_and_for_ever,
          with_keys_it_runs_in_the_same_sandbox, a_wrong_configuration_is_one_clear_line_and_no_restart)


def main():
    command("ip", "link", "set", "lo", "up")
    with open(sys.argv[1], "w", buffering=1) as results:
        if not may_raise_limits():
            grant_capabilities_instead()
            results.write("noted: this machine may not raise limits; the capabilities " + STAND_INS + " stand in for them\n")
        for check in CHECKS:
            name = check.__name__.replace("_", " ")
            try:
                results.write(f"passed: {name}: {check() or 'yes'}\n".replace("\r", ""))
            except Exception as error:  # whatever it is belongs into the results
                results.write(f"FAILED: {name}: {' '.join(str(error).split())}\n")
                traceback.print_exc()
                print(journal(time.time() - 20)[-3000:], flush=True)


main()
