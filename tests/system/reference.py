"""A reference on the patient: a field generator that is pushed does not move the shape, and a lost reference is said."""
import math
import random
import time

import bed as beds
import replayed_sequence
import sequences
from bed import check, check_timing, is_valid, milliseconds, need_real_time, rate_hz, say

SENSOR = 6
SAID_WITHIN_MS = 250
TIMEOUT_MS = 500
# The simulated reference with its generator at rest: drivers/laboratory/tracker/generator_motion.hpp
POSE = "sensor = 6\nT_em_reference = [[1, 0, 0, 70], [0, 1, 0, 40], [0, 0, 1, 60], [0, 0, 0, 1]]\n"
COILS = "sensors = [6, 7]\npositions_em_mm = [55, 40, 60, 85, 40, 60]\naxes_em = [0, 0, 1, 0, 1, 0]\n"
RESTS = "lambda_mm = 0.3\npsi_deg = 0.3\nspeed_mm_s = 0\n"  # the catheter, so that its shape may be compared
PUSH_S, PUSH_MM = 10, 20


def configuration(bed, reference, simulation=""):
    """Coils alone, or images would hold the shape across their view."""
    text = bed.simulation((beds.Instrument(mode="em"),), simulation=RESTS + simulation)
    return text if not reference else f"{text}\n[em.reference]\n{reference}"


def is_lost(sample):
    return "REFERENCE_LOST" in sample.get("reason_names", "")


def mean_points(samples):
    return [[sum(s["points"][i]["p_world_mm"][axis] for s in samples) / len(samples) for axis in range(3)]
            for i in range(0, samples[0]["point_count"], 16)]


def moved_by_the_push_mm(bed, reference):
    """How far the shape goes when the generator is pushed and turned by 3 degrees, and the samples while it is."""
    epoch_ns = time.monotonic_ns()
    push = (f"epoch_ns = {epoch_ns}\ngenerator_shift_mm = {PUSH_MM}.0\ngenerator_turn_deg = 3.0\n"
            f"generator_moves_at_s = {PUSH_S}.0\n")
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(configuration(bed, reference, push))
    subscriber.wait_for(is_valid, "VALID shape", 8)
    pushed_ns = epoch_ns + PUSH_S * 1_000_000_000
    check_timing(time.monotonic_ns() < pushed_ns - 2_000_000_000, "the daemon took too long to start")
    time.sleep((pushed_ns - time.monotonic_ns()) * 1e-9 + 4)
    samples = subscriber.samples()
    subscriber.stop()
    daemon.stop()
    before = [sample for sample in samples if is_valid(sample) and sample["valid_time_monotonic_ns"] < pushed_ns]
    after = [sample for sample in samples if sample["valid_time_monotonic_ns"] >= pushed_ns]
    check(len(before) > 30 and len(after) > 90, f"{len(before)} samples before the push, {len(after)} after it")
    check(is_valid(after[-1]) and not is_lost(after[-1]), f"not good again by itself: {after[-1]['reason_names']}")
    way = max(math.dist(a, b) for a, b in zip(mean_points(before[-60:]), mean_points(after[-60:])))
    return way, after, pushed_ns, daemon


def a_generator_that_moves_does_not_move_the_shape(bed):
    need_real_time()
    without_mm, after, _, _ = moved_by_the_push_mm(bed, "")
    say(f"without a reference the shape goes {without_mm:.1f} mm with a generator that is pushed by {PUSH_MM} mm")
    check(without_mm > PUSH_MM / 2, "the push is not felt: the test proves nothing")
    check(not any(is_lost(sample) for sample in after), "without a reference none can be lost")
    for name, reference in (("a sensor of 6 degrees of freedom", POSE), ("two coils", COILS)):
        way_mm, after, pushed_ns, daemon = moved_by_the_push_mm(bed, reference)
        said = [sample for sample in after if is_lost(sample)]
        check(said, f"{name}: the jump is not said")
        told_ms = milliseconds(said[0]["received_monotonic_ns"] - pushed_ns)
        say(f"with {name} {way_mm:.2f} mm; said {told_ms:.0f} ms after the push began, in {len(said)} samples")
        check(way_mm < 1.0, f"with {name} the shape goes {way_mm:.2f} mm")
        check_timing(told_ms < SAID_WITHIN_MS, f"{name}: said after {told_ms:.0f} ms")
        check(not any(is_valid(sample) for sample in said), "VALID while the reference is in doubt")
        check("has jumped by" in daemon.words(), f"the log says nothing of the jump:\n{daemon.words()}")


def a_lost_reference_is_said_at_once_and_good_again_by_itself(bed):
    need_real_time()
    subscriber, status = bed.subscribe(), bed.subscribe("--topic", "status")
    bed.start_daemon(configuration(bed, POSE + f"timeout_ms = {TIMEOUT_MS}.0\n"))
    subscriber.wait_for(is_valid, "VALID shape", 10)
    time.sleep(1)
    lost_ns = bed.fault("em", f"lose-coil {SENSOR}")
    first = subscriber.wait_for(is_lost, "sample with REFERENCE_LOST", 2, lost_ns)
    took_ms = milliseconds(first.read_ns - lost_ns)
    check(first.json["validity_name"] == "QUESTIONABLE", f"at first {first.json['validity_name']}")
    check_timing(took_ms <= SAID_WITHIN_MS, f"said after {took_ms:.0f} ms")
    invalid = subscriber.wait_for(lambda s: s.get("validity_name") == "INVALID", "INVALID", 3, lost_ns)
    invalid_ms = milliseconds(invalid.read_ns - lost_ns)
    check_timing(TIMEOUT_MS - 50 <= invalid_ms <= TIMEOUT_MS + SAID_WITHIN_MS, f"INVALID after {invalid_ms:.0f} ms")
    status.wait_for(lambda s: any(f"sensor {SENSOR}, is missing" in stage["why"] for stage in s.get("stages", [])), "words", 3, lost_ns)
    time.sleep(1)
    found_ns = bed.fault("em", f"restore-coil {SENSOR}")
    again = subscriber.wait_for(lambda s: is_valid(s) and not is_lost(s), "VALID shape", 2, found_ns)
    again_ms = milliseconds(again.read_ns - found_ns)
    say(f"said after {took_ms:.0f} ms, INVALID after {invalid_ms:.0f} ms, VALID {again_ms:.0f} ms after it is back")
    check_timing(again_ms <= SAID_WITHIN_MS, f"VALID again after {again_ms:.0f} ms")
    samples = subscriber.samples(lost_ns)
    between = [s for s in samples if lost_ns + 300_000_000 < s["received_monotonic_ns"] < found_ns]
    check(all(is_lost(s) and not is_valid(s) for s in between), "a shape without its reference that does not say so")
    check_timing(28 <= rate_hz(samples) <= 32, f"{rate_hz(samples):.1f} Hz while the reference is lost")


def write_sequence_with_reference(folder):
    """The generator jumps half way; sensor 6 rests on the patient, and is missing for 0.3 s."""
    sequences.write_sequence(folder, seconds=4)
    head, *rows = (folder / "em.csv").read_text().splitlines()
    noise, text = random.Random(7), head + "\n"
    for row in rows:
        cells = row.split(",")
        shift = (12.0, -9.0, 14.0) if float(cells[0]) > 2 else (0, 0, 0)
        cells[4:7] = [f"{float(cell) - mm:.4f}" for cell, mm in zip(cells[4:7], shift)]
        text += ",".join(cells) + "\n"
        if cells[2] == str(len(sequences.COIL_OFFSETS_MM)):
            x, y, z = (at + noise.gauss(0, 0.1) - mm for at, mm in zip((70, 40, 60), shift))
            pose = ",,,,,,,,,," if 3 < float(cells[0]) < 3.3 else f"{x:.4f},{y:.4f},{z:.4f},0,0,1,1,0,0,0,0.5"
            text += f"{cells[0]},{cells[1]},{SENSOR},{'MISSING' if pose.startswith(',') else 'OK'},{pose}\n"
    (folder / "em.csv").write_text(text)
    (folder / "reference.toml").write_text(f"[em.reference]\n{POSE}")


def a_replayed_reference_gives_what_the_offline_reconstruction_gives(bed):
    need_real_time()
    folder = bed.folder / "sequence"
    write_sequence_with_reference(folder)
    done = bed.tubectl("configure", str(folder), "--mode", "filter")
    check(done.returncode == 0 and "reference" in done.stdout, f"tubectl configure: {done.stderr}\n{done.stdout}")
    configured = bed.write("offline.toml", done.stdout)
    share, samples = replayed_sequence.compare(bed, folder, "filter", ("--config", str(configured)))
    lost = [frame for frame, sample in samples.items() if is_lost(sample)]
    say(f"{len(lost)} of {len(samples)} frames say REFERENCE_LOST")
    check(share >= 0.9, f"only {100 * share:.0f} % of the frames were not skipped")
    check(any(sample["has_image"] for sample in samples.values()), "no image took part")
    check(8 <= len(lost) <= 60, "the jump, or that the reference was missing, was not said")
    check(not any(is_valid(samples[frame]) for frame in lost), "VALID while the reference is lost")


if __name__ == "__main__":
    beds.main(a_generator_that_moves_does_not_move_the_shape, a_lost_reference_is_said_at_once_and_good_again_by_itself,
              a_replayed_reference_gives_what_the_offline_reconstruction_gives)
