"""Trackers that lose a coil or stall: the very next sample says so."""
import time

import bed as beds
from bed import age_when_made_ns, check, check_timing, is_fused, milliseconds, need_real_time, rate_hz, reasons_of, say

FLAGGED_WITHIN_MS = 100  # of the newest measurement, at the subscriber
PERIOD_MS = 25  # of the simulated tracker


def a_lost_coil_is_flagged_in_the_next_sample(bed):
    measurements = bed.subscribe("--topic", "em")
    _, subscriber = bed.tracked()
    measurements.wait_for(lambda _: True, "EmSamples", 2)
    time.sleep(0.5)
    lost_ns = bed.fault("em", "lose-coil 2")
    lost = measurements.wait_for(lambda sample: sample["coils"][1]["status"] == 0, "measurement without coil 2", 1, lost_ns)
    time.sleep(1)
    back_ns = bed.fault("em", "restore-coil 2")
    back = measurements.wait_for(lambda sample: sample["coils"][1]["status"] == 1, "measurement with coil 2", 1, back_ns)
    time.sleep(0.5)

    first_lost, first_back = lost.json["tracker_frame"], back.json["tracker_frame"]
    flagged = 0
    for sample in subscriber.samples():
        if sample["em_frame"] == 0:
            continue  # before the first measurement
        is_without = first_lost <= sample["em_frame"] < first_back
        says_so = "COIL_LOST" in reasons_of(sample)
        check(is_without == says_so, f"measurements {first_lost} .. {first_back - 1} lack coil 2; the sample that uses "
              f"measurement {sample['em_frame']} says {sample['reason_names']}")
        if is_without:
            check(sample["coils"][1]["state"] == 0, f"coil 2 is in state {sample['coils'][1]['state']}, expected missing")
            check(sample["coils"][1]["position_mm"] is None, "a coil that gave nothing has a residual")
        flagged += says_so
    check_timing(flagged >= 25, f"only {flagged} samples without the coil in a second")
    newer = [sample for sample in subscriber.samples()
             if sample["stamps"]["publish_started_monotonic_ns"] > lost.json["received_monotonic_ns"]]
    until = next(i for i, sample in enumerate(newer) if "COIL_LOST" in reasons_of(sample))
    say(f"{flagged} samples flagged; {until} sample(s) published after the measurement had come did not yet use it")
    # An image-bearing estimate uses the measurement of its exposure, which may be the one before.
    check_timing(until <= 1, f"{until} samples after the loss were unflagged")


def a_stalled_tracker_is_flagged_while_30_hz_goes_on(bed):
    need_real_time()
    _, subscriber = bed.tracked()
    time.sleep(0.5)
    stalled_ns = bed.fault("em", "stall 3.0")
    flagged = subscriber.wait_for(lambda sample: "EM_STALE" in sample.get("reason_names", ""), "EM_STALE", 1, stalled_ns)
    newest_ns = flagged.json["stamps"]["em_measured_monotonic_ns"]
    took_ms = milliseconds(flagged.read_ns - newest_ns)
    say(f"EM_STALE {took_ms:.0f} ms after the newest measurement, {milliseconds(flagged.read_ns - stalled_ns):.0f} ms "
        "after the tracker's falling silent")
    check(took_ms <= FLAGGED_WITHIN_MS, f"EM_STALE after {took_ms:.0f} ms, expected {FLAGGED_WITHIN_MS} ms")

    recovered = subscriber.wait_for(is_fused, "VALID shape after the stall", 5, flagged.read_ns)
    recovered_ms = milliseconds(recovered.read_ns - stalled_ns)
    say(f"VALID again {recovered_ms:.0f} ms after the beginning of a stall of 3000 ms")
    check(3000 <= recovered_ms <= 3000 + 250, f"recovered {recovered_ms:.0f} ms after the beginning")
    samples = [sample for sample in subscriber.samples(stalled_ns) if sample["received_monotonic_ns"] <= recovered.read_ns]
    rate = rate_hz(samples)
    say(f"meanwhile {rate:.2f} Hz")
    check(29 <= rate <= 31, f"{rate:.2f} Hz during the stall, expected 30")
    check(not [line for line in subscriber.events(stalled_ns) if line.read_ns <= recovered.read_ns], "an event")
    for sample in samples:
        age_ms = milliseconds(age_when_made_ns(sample, "em_age_ns"))
        stale = "EM_STALE" in reasons_of(sample)
        check(stale or age_ms <= FLAGGED_WITHIN_MS, f"a measurement {age_ms:.1f} ms old, reasons {sample['reason_names']}")
        check(not stale or age_ms > 2 * PERIOD_MS, f"a measurement {age_ms:.1f} ms old is called stale")
        check(not stale or sample["validity_name"] == "INVALID", f"EM_STALE and yet {sample['validity_name']}")


if __name__ == "__main__":
    beds.main(a_lost_coil_is_flagged_in_the_next_sample, a_stalled_tracker_is_flagged_while_30_hz_goes_on)
