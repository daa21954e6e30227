"""Who subscribes when, and what all of them get."""
import signal
import time

import bed as beds
from bed import check, check_timing, is_fused, is_valid, milliseconds, rate_hz, say

RATE_HZ = (29.5, 30.5)  # what the contract allows; one sample more or less in 8 s is 0.13 Hz
EXIT_OK = 0


def a_subscriber_that_came_first_is_served(bed):
    subscriber = bed.subscribe()
    time.sleep(1)  # it has joined the domain and hears nobody
    check(not subscriber.lines(), f"the subscriber heard somebody before there was a daemon: {subscriber.lines()[:1]}")
    daemon = bed.start_daemon()
    first = subscriber.wait_for(lambda sample: "event" not in sample, "first sample", 5)
    valid = subscriber.wait_for(is_fused, "VALID shape with an image", 5)
    say(f"first sample {milliseconds(first.read_ns - daemon.started_ns):.0f} ms, first VALID with an image "
        f"{milliseconds(valid.read_ns - daemon.started_ns):.0f} ms after the daemon's start")
    numbers = [sample["sequence_number"] for sample in subscriber.samples()]
    check_timing(numbers[0] <= 15, f"half a second was missed although the subscriber was there: first number {numbers[0]}")


def a_subscriber_that_came_later_is_served(bed):
    daemon = bed.start_daemon()
    time.sleep(3)
    check(daemon.process.poll() is None, "the daemon has ended by itself")
    started_ns = time.monotonic_ns()
    subscriber = bed.subscribe()
    valid = subscriber.wait_for(is_fused, "VALID shape with an image", 5)
    say(f"first VALID with an image {milliseconds(valid.read_ns - started_ns):.0f} ms after the subscriber's start")
    first = subscriber.samples()[0]
    age_ns = first["received_monotonic_ns"] - first["stamps"]["publish_started_monotonic_ns"]
    # VOLATILE: nothing is kept for late joiners. A lifespan of 200 ms is what an old sample could hide behind.
    check_timing(age_ns < 100e6, f"the first sample was written {milliseconds(age_ns):.0f} ms before it came")


def a_late_subscriber_learns_what_is_tracked(bed):
    bed.start_daemon()
    time.sleep(2)
    identity = bed.subscribe("--topic", "identity").wait_for(lambda _: True, "TubeIdentity", 5).json
    check(identity["instrument_id"] == "cath-1", f"instrument {identity['instrument_id']}")
    check(identity["coil_offsets_from_tip_mm"] == [10, 90, 170, 270, 370], f"offsets {identity}")
    focal_length_px = 2000 * beds.IMAGE_SCALE
    check(identity["cameras"][0]["focal_length_px"] == [focal_length_px] * 2, f"cameras {identity['cameras']}")
    status = bed.subscribe("--topic", "status").wait_for(lambda _: True, "TubeStatus", 5).json
    names = [stage["name"] for stage in status["stages"]]
    check(names == ["em", "grab-A", "view-A", "frangi-A", "optimizer", "publisher"], f"stages {names}")


def two_subscribers_get_the_same_numbers_at_30_hz(bed):
    bed.start_daemon()
    both = [bed.subscribe(), bed.subscribe()]
    for subscriber in both:
        subscriber.wait_for(is_fused, "VALID shape with an image", 10)
    from_ns = time.monotonic_ns()
    time.sleep(8)
    first, second = (subscriber.samples(since_ns=from_ns) for subscriber in both)
    for samples in (first, second):
        rate = rate_hz(samples)
        say(f"{len(samples)} samples at {rate:.2f} Hz, longest gap {beds.longest_gap_ms(samples):.0f} ms")
        check_timing(RATE_HZ[0] <= rate <= RATE_HZ[1], f"rate {rate:.2f} Hz over 8 s, expected {RATE_HZ}")
        numbers = [sample["sequence_number"] for sample in samples]
        check_timing(numbers == list(range(numbers[0], numbers[0] + len(numbers))), f"numbers are missing: {numbers}")
        check_timing(all(sample["lost_before"] == 0 for sample in samples), "the client library counted a loss")
    by_number = {sample["sequence_number"]: sample for sample in first}
    common = [sample for sample in second if sample["sequence_number"] in by_number]
    check_timing(len(common) >= 230, f"only {len(common)} numbers in common")
    for sample in common:
        other = by_number[sample["sequence_number"]]
        check(sample["points"] == other["points"] and sample["publish_time_ns"] == other["publish_time_ns"],
              f"number {sample['sequence_number']} is not the same sample for both")


def a_daemon_that_is_asked_to_end_says_goodbye(bed):
    daemon, subscriber = bed.tracked()
    asked_ns = daemon.signal(signal.SIGTERM)
    code = daemon.wait(1)
    took_ms = milliseconds(time.monotonic_ns() - asked_ns)
    check(code == EXIT_OK, f"exit code {code}, expected {EXIT_OK}")
    told = subscriber.wait_for(lambda line: line.get("event") == "writer gone", "event 'writer gone'", 1, asked_ns)
    say(f"ended after {took_ms:.0f} ms, the subscriber was told after {milliseconds(told.read_ns - asked_ns):.0f} ms")
    time.sleep(0.5)
    check(not subscriber.samples(told.read_ns), "a sample came after the goodbye")


def two_instruments_are_tracked_in_the_same_images(bed):
    instruments = (beds.Instrument("cath-1", 1), beds.Instrument("cath-2", 6))
    _, subscriber = bed.tracked(bed.simulation(instruments))
    for instrument in instruments:
        subscriber.wait_for(lambda sample, id=instrument.id: sample.get("instrument_id") == id and is_fused(sample),
                            f"VALID shape of {instrument.id}", 10)
    time.sleep(4)  # at a beginning a straight tip may be AMBIGUOUS for three seconds
    from_ns = time.monotonic_ns()
    time.sleep(8)
    exposures = []
    for instrument in instruments:
        samples = subscriber.samples(from_ns, instrument.id)
        rate = rate_hz(samples)
        fused = [sample for sample in samples if sample["has_image"]]
        inliers = sorted(sample["image_inlier_ratio"] for sample in fused)
        say(f"{instrument.id}: {rate:.2f} Hz, {sum(map(is_valid, samples))} of {len(samples)} VALID, {len(fused)} with an "
            f"image, inliers median {inliers[len(inliers) // 2]:.2f}")
        check_timing(RATE_HZ[0] <= rate <= RATE_HZ[1], f"{instrument.id}: {rate:.2f} Hz")
        # Crossing catheters may cost single frames.
        check_timing(sum(map(is_valid, samples)) >= 0.95 * len(samples), f"{instrument.id} is not VALID: {worst(samples)}")
        check_timing(len(fused) >= 0.9 * len(samples), f"{instrument.id}: {len(fused)} of {len(samples)} have an image")
        check_timing(inliers[len(inliers) // 2] > 0.6, f"{instrument.id}: the image shows {inliers[len(inliers) // 2]:.2f} of it")
        exposures.append({sample["image_frame"] for sample in fused})
    common = exposures[0] & exposures[1]
    check_timing(len(common) >= 0.95 * max(map(len, exposures)), "the two were not seen in the same images")
    first, second = ({sample["image_frame"]: sample["points"][0]["p_world_mm"] for sample in
                      subscriber.samples(from_ns, instrument.id)} for instrument in instruments)
    apart = min(sum((a - b) ** 2 for a, b in zip(first[frame], second[frame])) ** 0.5 for frame in common)
    say(f"{len(common)} images in common, tips at least {apart:.0f} mm apart")
    check(apart > 5, f"both estimates are of one catheter: tips {apart:.1f} mm apart")


def worst(samples):
    bad = [sample for sample in samples if not is_valid(sample)]
    return f"{len(bad)} of {len(samples)}, e.g. {beds.shortened(bad[0])}" if bad else "none"


if __name__ == "__main__":
    beds.main(a_subscriber_that_came_first_is_served, a_subscriber_that_came_later_is_served,
              a_late_subscriber_learns_what_is_tracked, two_subscribers_get_the_same_numbers_at_30_hz,
              a_daemon_that_is_asked_to_end_says_goodbye, two_instruments_are_tracked_in_the_same_images)
