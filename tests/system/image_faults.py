"""Fluoroscopes that stall, are switched off or show nothing: 30 Hz goes on and every sample says what it lacks."""
import statistics
import time

import bed as beds
from bed import (age_when_made_ns, check, check_timing, is_fused, is_valid, longest_gap_ms, milliseconds, need_real_time, rate_hz,
                 reasons_of, say)

IMAGE_PERIOD_MS = 1000 / 30
IMAGE_LATENCY_MS = 8  # of the simulated fluoroscope, exposure to delivery
IMAGE_STALE_MS = 9 / 4 * IMAGE_PERIOD_MS  # the daemon's timeout: two periods, as it learnt them, and a little


def check_rate_went_on(subscriber, from_ns, to_ns):
    """30 Hz between two instants, without a gap that a subscriber would call a missed deadline."""
    samples = [sample for sample in subscriber.samples(from_ns) if from_ns <= sample["received_monotonic_ns"] <= to_ns]
    rate, gap_ms = rate_hz(samples), longest_gap_ms(samples)
    say(f"meanwhile {rate:.2f} Hz, longest gap {gap_ms:.0f} ms")
    # Over 2.5 s and more a sample that moves by half a period changes the rate by 0.2 Hz.
    check_timing(29 <= rate <= 31, f"{rate:.2f} Hz during the fault, expected 30")
    check_timing(gap_ms <= 100, f"{gap_ms:.0f} ms without a sample during the fault")
    check_timing(not [line for line in subscriber.events(from_ns) if line.read_ns <= to_ns], "an event during the fault")
    return samples


def is_fused_without_reserve(sample):
    """With a sanitizer every sample may say that it is late."""
    return is_fused(sample) and (beds.TIME_FACTOR != 1 or not reasons_of(sample))


def median_sigma_mm(samples):
    """One standard deviation, median over all points, of which most are in view: of each the harmonic mean of the
    principal variances, where the direction that is known best counts most. A view leaves the others to the coils."""
    sigmas = []
    for sample in samples:
        for point in sample["points"]:
            xx, xy, xz, yy, yz, zz = point["covariance_mm2"]
            minors = [yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy]
            determinant = xx * minors[0] - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
            sigmas.append(max(3 * determinant / sum(minors), 0) ** 0.5)
    return statistics.median(sigmas)


def a_stalled_fluoroscope_is_flagged_while_30_hz_goes_on(bed):
    need_real_time()
    _, subscriber = bed.tracked()
    time.sleep(1)
    stalled_ns = bed.fault("image-A", "stall 3.0")
    flagged = subscriber.wait_for(lambda sample: "IMAGE_STALE" in sample.get("reason_names", ""), "IMAGE_STALE", 1,
                                  stalled_ns)
    newest = max(sample["valid_time_monotonic_ns"] for sample in subscriber.samples() if sample["has_image"])
    first_missing_ns = newest + (IMAGE_PERIOD_MS + IMAGE_LATENCY_MS) * 1e6
    late_ms = milliseconds(flagged.read_ns - first_missing_ns)
    say(f"IMAGE_STALE {late_ms:.0f} ms after the first missing image was due, its age being "
        f"{milliseconds(age_when_made_ns(flagged.json, 'image_age_ns')):.0f} ms")
    # Two image periods, the grace of 10 ms that a tick leaves to a late image, and 40 ms for a busy machine.
    bound_ms = 2 * IMAGE_PERIOD_MS + 10 + 40
    check(late_ms <= bound_ms, f"flagged after {late_ms:.0f} ms, expected {bound_ms:.0f} ms")

    recovered = subscriber.wait_for(is_fused, "VALID shape with an image after the stall", 5, flagged.read_ns)
    recovered_ms = milliseconds(recovered.read_ns - stalled_ns)
    say(f"with images again {recovered_ms:.0f} ms after the beginning of a stall of 3000 ms")
    check(3000 <= recovered_ms <= 3000 + 200, f"recovered {recovered_ms:.0f} ms after the beginning")
    samples = check_rate_went_on(subscriber, stalled_ns, recovered.read_ns)
    for sample in samples:
        stale, age_ms = "IMAGE_STALE" in reasons_of(sample), milliseconds(age_when_made_ns(sample, "image_age_ns"))
        # The limit in both directions; the learnt period moves by a few milliseconds with the machine's noise.
        check(stale or age_ms <= IMAGE_STALE_MS + 8,
              f"an image {age_ms:.0f} ms old, unflagged: {beds.shortened(sample)}")
        check(not stale or age_ms >= IMAGE_STALE_MS - 8, f"an image {age_ms:.0f} ms old is called stale")
        check(not stale or not is_valid(sample), "IMAGE_STALE and yet VALID")


def without_fluoroscopy_shapes_are_valid_from_coils_alone(bed):
    _, subscriber = bed.tracked()
    # What coils and images say together of the room takes seconds to settle, and until then it is in sigma too.
    time.sleep(5)
    before_ns = time.monotonic_ns()
    time.sleep(2)
    off_ns = bed.fault("image-A", "off")
    subscriber.wait_for(lambda sample: "IMAGE_OFF" in sample.get("reason_names", ""), "IMAGE_OFF", 1, off_ns)
    settled_ns = time.monotonic_ns()
    time.sleep(3)
    on_ns = bed.fault("image-A", "on")
    with_image = [sample for sample in subscriber.samples(before_ns)
                  if sample["received_monotonic_ns"] < off_ns and sample["has_image"]]
    samples = check_rate_went_on(subscriber, settled_ns, on_ns)
    for sample in samples:
        check_timing(is_valid(sample) and reasons_of(sample) == {"IMAGE_OFF"} and not sample["has_image"],
              f"expected VALID with IMAGE_OFF alone: {beds.shortened(sample)}")
    sigma_off, sigma_on = median_sigma_mm(samples), median_sigma_mm(with_image)
    say(f"one sigma {sigma_off:.2f} mm without fluoroscopy, {sigma_on:.2f} mm with it")
    # Images hold the tube up to what is not known of their pose and scale.
    check_timing(sigma_off > 1.3 * sigma_on, f"without images sigma is {sigma_off:.2f} mm, with them {sigma_on:.2f} mm")
    subscriber.wait_for(is_fused_without_reserve, "VALID shape with an image", 2, on_ns)


def a_black_image_is_rejected(bed):
    _, subscriber = bed.tracked()
    black_ns = bed.fault("image-A", "black")
    first = subscriber.wait_for(lambda sample: "IMAGE_REJECTED" in sample.get("reason_names", ""), "IMAGE_REJECTED", 1,
                                black_ns)
    took_ms = milliseconds(first.read_ns - black_ns)
    say(f"IMAGE_REJECTED {took_ms:.0f} ms after the command")
    # The command works from the source's next read on; that image is due within a period and its latency.
    bound_ms = 2 * IMAGE_PERIOD_MS + IMAGE_LATENCY_MS + 50
    check_timing(took_ms <= bound_ms, f"rejected after {took_ms:.0f} ms, expected {bound_ms:.0f} ms")
    time.sleep(2.6)
    clear_ns = bed.fault("image-A", "clear")
    for sample in check_rate_went_on(subscriber, first.read_ns + 1, clear_ns):
        check_timing("IMAGE_REJECTED" in reasons_of(sample) and not is_valid(sample) and not sample["has_image"],
              f"a black image was believed: {beds.shortened(sample)}")
    subscriber.wait_for(is_fused_without_reserve, "VALID shape with an image", 2,
                        clear_ns)


if __name__ == "__main__":
    beds.main(a_stalled_fluoroscope_is_flagged_while_30_hz_goes_on,
              without_fluoroscopy_shapes_are_valid_from_coils_alone, a_black_image_is_rejected)
