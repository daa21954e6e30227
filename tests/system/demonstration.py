"""tubectl demo: one command, no hardware."""
import contextlib
import json
import pathlib

import bed as beds
from bed import check, is_valid, need_real_time, say

PREPARING_S = 30  # until a VALID shape: the room is simulated first, with progress, which takes as long as the machine is slow
HOT = ("em", "grab-A", "view-A", "frangi-A", "optimizer")


def helpers_of_demonstrations():
    """Process numbers."""
    found = set()
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):  # it has ended meanwhile
            words = path.read_bytes()
            if (b"aurora-emulator" in words or b"can-gateway" in words) and b"/tubed-demo-" in words:
                found.add(path.parent.name)
    return found


def the_demonstration_shows_a_tracked_catheter(bed):
    need_real_time()  # its images are of full size, too much for a sanitized filter
    report_file = bed.folder / "out.json"
    done = bed.tubectl("demo", "--headless", "12", "--json", str(report_file), timeout_s=40)
    check(done.returncode == 0, f"tubectl demo exits {done.returncode}:\n{done.stderr}")
    report = json.loads(report_file.read_text())
    say(json.dumps({key: report.get(key) for key in ("rate_hz", "latency_ms", "rms_mm", "validity", "reasons", "lost")}))
    check(29.5 <= report["rate_hz"] <= 30.5, f"rate {report['rate_hz']:.2f} Hz")
    check(0 < report["latency_ms"]["p50"] <= report["latency_ms"]["p99"], f"latency {report['latency_ms']}")
    for stage in ("image_source", "frangi", "optimizer", "dds"):
        check(report["stages_ms"][stage]["p50"] >= 0, f"stage {stage}: {report['stages_ms'].get(stage)}")
    rms = report["rms_mm"]
    check(0 < rms["fused"] < rms["em"], f"RMS error fused {rms['fused']} mm, coils alone {rms['em']} mm")
    check(report["validity"]["VALID"] >= 300, f"validity {report['validity']}")
    check(report["reasons"]["DEMO_DATA"] >= report["samples"], "simulated shapes that do not say so")
    for stage in HOT:
        check(report["allocations_per_frame"][stage] == 0, f"allocations {report['allocations_per_frame']}")
    check(report["allocations_per_frame"]["publisher"] > 0, "the publisher's allocations are not counted")


def the_demonstration_reads_an_emulated_aurora(bed):
    """The real driver at a pseudo-terminal; its tracker measures the catheter that the images show."""
    judge_aurora(bed, "aurora-serial")


def the_demonstration_reads_an_aurora_behind_a_can_gateway(bed):
    """The same tracker, a gateway that reads it, and the real driver of its frames."""
    judge_aurora(bed, "aurora-can")


def the_demonstration_says_how_to_make_a_can_interface(bed):
    done = bed.tubectl("demo", "--headless", "3", "--tracker", "aurora-can", "--can", "nosuchcan")
    check(done.returncode == 1, f"tubectl demo exits {done.returncode}")
    check("nosuchcan" in done.stderr and "ip link add vcan0 type vcan" in done.stderr, f"it says: {done.stderr}")


def judge_aurora(bed, tracker):
    need_real_time()
    report_file = bed.folder / "out.json"
    subscriber = bed.subscribe()
    demo = beds.Daemon([bed.program("tubectl"), "demo", "--tracker", tracker, "--domain", "0", "--headless", "16",
                        "--json", str(report_file)], bed.folder / "tubed-demo.log")
    bed.daemons.append(demo)
    for instrument in ("cath-1", "cath-1-em"):
        sample = subscriber.wait_for(lambda s, i=instrument: s.get("instrument_id") == i and is_valid(s), f"VALID {instrument}",
                                     PREPARING_S).json
        check("DEMO_DATA" in sample["reason_names"], f"a simulated {instrument} that says {sample['reason_names']}")
    check(demo.wait(PREPARING_S) == 0, f"tubectl demo exits {demo.process.returncode}")
    report = json.loads(report_file.read_text())
    say(json.dumps({key: report.get(key) for key in ("rate_hz", "latency_ms", "rms_mm", "validity", "reasons", "lost")}))
    check(29.5 <= report["rate_hz"] <= 30.5, f"rate {report['rate_hz']:.2f} Hz")
    # Coils measured elsewhere, earlier or later than the images show them would not agree with these.
    rms = report["rms_mm"]
    check(0 < rms["fused"] < rms["em"] < 5, f"RMS error fused {rms['fused']} mm, coils alone {rms['em']} mm")
    check(rms["fused"] < 1.5, f"RMS error fused {rms['fused']} mm")
    check(report["validity"]["VALID"] >= 250, f"validity {report['validity']}")
    for stage in HOT:
        check(report["allocations_per_frame"][stage] == 0, f"allocations {report['allocations_per_frame']}")


def the_demonstration_leaves_nothing_behind(bed):
    """Its daemon, its tracker and its folder end with it."""
    need_real_time()
    before = {path.name for path in bed.folder.parent.glob("tubed-demo-*")}
    helpers_before = helpers_of_demonstrations()
    for options in (("--headless", "3"), ("--headless", "8", "--tracker", "aurora-can")):
        done = bed.tubectl("demo", *options, "--json", "-", timeout_s=30)
        check(done.returncode == 0, f"tubectl demo exits {done.returncode}:\n{done.stderr}")
    helpers = helpers_of_demonstrations() - helpers_before
    check(not helpers, f"an emulated tracker or a gateway still runs: {helpers}")
    left = {path.name for path in bed.folder.parent.glob("tubed-demo-*")} - before
    check(not left, f"folders are left: {left}")
    sockets = [line for line in open("/proc/net/udp", encoding="ascii").read().splitlines()[1:]]
    check(not sockets, f"somebody still listens in this network: {sockets}")


if __name__ == "__main__":
    beds.main(the_demonstration_shows_a_tracked_catheter, the_demonstration_reads_an_emulated_aurora,
              the_demonstration_reads_an_aurora_behind_a_can_gateway, the_demonstration_says_how_to_make_a_can_interface,
              the_demonstration_leaves_nothing_behind)
