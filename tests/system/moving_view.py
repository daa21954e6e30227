"""Views that move: poses that come with images, through the simulation and shared memory, and poses that a reload brings."""
import math
import signal
import time

import bed as beds
import radiographs
import sequences
from bed import check, check_timing, is_fused, is_valid, milliseconds, need_real_time, rate_hz, reasons_of, say
from shared_memory import Grabber, configuration_of

SECONDS = 3
LEARNING_S = 12  # until a view is known well enough for a move of 5 mm
PANNED_AFTER_S = 10  # the background is learnt in six
PANNED_PX = 8
PANNED_MM = PANNED_PX * radiographs.MM_PER_PX  # 4.8
FOUND_AFTER_MM = 12
FOUND_WITHIN_S = 25
LOOKS_PAST_MM = 80  # a camera that is believed to be so far beside where it is does not find the tube


def watched(bed, seconds, simulation):
    """Samples of a daemon whose first view moves, after the first shape at which an image took part. It need not be VALID: a pose that is
    wrong from the beginning is told."""
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(bed.simulation(simulation=simulation))
    subscriber.wait_for(lambda sample: sample.get("has_image", False), "a shape with an image", 10)
    from_ns = time.monotonic_ns()
    time.sleep(seconds)
    samples = subscriber.samples(from_ns)
    subscriber.stop()
    daemon.stop()
    return samples


def share_fused(samples):
    return sum(is_fused(sample) for sample in samples) / max(1, len(samples))


def a_swinging_view_that_says_how_it_stands_keeps_its_images(bed):
    need_real_time()
    swing = "swing_deg = 40\nswing_every_s = 8\n"
    said = watched(bed, 9, swing)
    silent = watched(bed, 9, swing + "announces_pose = false\n")
    say(f"with an image: {100 * share_fused(said):.0f} % of {len(said)} while it says so, {100 * share_fused(silent):.0f} % of "
        f"{len(silent)} while it does not")
    check(share_fused(said) > 0.8, "images are lost although they say how the view stood")
    check(share_fused(silent) < share_fused(said) - 0.2, "that a view has moved is not felt: the test proves nothing")
    check_timing(28 <= rate_hz(said) <= 32, f"{rate_hz(said):.1f} Hz while the view moves")


def a_table_that_is_panned_on_request_is_noticed_and_believed_again_when_it_is_back(bed):
    need_real_time()
    _, subscriber = bed.tracked(bed.simulation())
    time.sleep(LEARNING_S)
    check(not any("GEOMETRY_CHANGED" in reasons_of(sample) for sample in subscriber.samples(0)), "GEOMETRY_CHANGED before anything moved")
    panned_ns = bed.fault("image-A", "pan 5")
    subscriber.wait_for(lambda sample: "GEOMETRY_CHANGED" in sample.get("reason_names", ""), "GEOMETRY_CHANGED", 5,
                        since_ns=panned_ns)
    back_ns = bed.fault("image-A", "pan 0")
    subscriber.wait_for(lambda sample: "reason_names" in sample and is_fused(sample) and "GEOMETRY_CHANGED" not in reasons_of(sample),
                        "a shape with images again", 15, since_ns=back_ns + 1_500_000_000)


def is_found(sample):
    """Made with an image of a view that moved, from where coils and images have found it."""
    return sample.get("has_image", False) and is_geometry_changed(sample) and sample["views"][0]["has_own_geometry"]


def a_view_that_moved_is_found_again_and_its_pose_accepted(bed):
    need_real_time()
    status = bed.subscribe("--topic", "status")
    text = bed.simulation()
    daemon, subscriber = bed.tracked(text)
    time.sleep(LEARNING_S)
    panned_ns = bed.fault("image-A", f"pan {FOUND_AFTER_MM}")
    subscriber.wait_for(is_geometry_changed, "GEOMETRY_CHANGED", 5, since_ns=panned_ns)
    found = subscriber.wait_for(is_found, "a shape with an image of the view that moved", FOUND_WITHIN_S, since_ns=panned_ns).json
    pose = found["views"][0]["T_camera_world"]
    off_mm = math.hypot(pose[3] - FOUND_AFTER_MM, pose[7])
    say(f"found after {milliseconds(found['valid_time_monotonic_ns'] - panned_ns) / 1e3:.1f} s, {off_mm:.1f} mm from where it is across the view")
    check(found["validity_name"] == "QUESTIONABLE", f"a pose that nobody has accepted makes a shape {found['validity_name']}")
    check(off_mm < 3, f"found {off_mm:.1f} mm from where it is: {pose}")
    status.wait_for(lambda s: any("was found from coils and images" in stage["why"] for stage in s.get("stages", [])),
                    "the words for it in TubeStatus", 5)
    written = bed.tubectl("calibrate", "view", "--seconds", "2", "--config", bed.folder / "tubed-1.toml", "--yes")
    check(written.returncode == 0 and "T_camera_world" in written.stdout, f"calibrate view: {written.stdout}{written.stderr}")
    accepted_ns = daemon.signal(signal.SIGHUP)
    subscriber.wait_for(lambda sample: "reason_names" in sample and is_fused(sample) and not is_geometry_changed(sample),
                        "a VALID shape with the pose that was accepted", 15, since_ns=accepted_ns)


def moved(text, by_mm):
    """The configuration, its camera believed to be so far aside."""
    rows = [line for line in text.splitlines() if line.startswith("T_camera_world")]
    check(len(rows) == 1, f"expected one pose in\n{text}")
    return text.replace(rows[0], f"T_camera_world = [[1,0,0,{by_mm}],[0,1,0,0],[0,0,1,{sequences.DEPTH_MM}],[0,0,0,1]]")


def looped_sequence(bed):
    folder = bed.folder / "sequence"
    sequences.write_sequence(folder, SECONDS)
    return folder


def a_corrected_pose_is_taken_by_a_reload(bed):
    need_real_time()
    right = configuration_of(bed, looped_sequence(bed), "replay", loop=True)
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(moved(right, LOOKS_PAST_MM))
    subscriber.wait_for(lambda sample: "IMAGE_LOST_TUBE" in reasons_of(sample), "shape whose image does not show it", 10)
    time.sleep(2)
    wrong_ns = time.monotonic_ns()
    time.sleep(1)
    beside = share_fused(subscriber.samples(wrong_ns))
    say(f"beside the tube {100 * beside:.0f} % with an image")
    check(beside < 0.1, "a camera beside the tube finds it: the test proves nothing")
    bed.write("tubed-1.toml", moved(right, 0))
    asked_ns = daemon.signal(signal.SIGHUP)
    subscriber.wait_for(is_fused, "VALID shape with an image after the reload", 5, asked_ns)
    right_ns = time.monotonic_ns()
    time.sleep(1.5)
    fused = share_fused(subscriber.samples(right_ns))
    say(f"after the reload {100 * fused:.0f} % with an image")
    check(fused > 0.5, f"after the reload only {100 * fused:.0f} % of the shapes have an image")
    check("with other poses of the cameras" in daemon.words(), f"the log says nothing of it:\n{daemon.words()}")
    check("restart" not in daemon.words(), f"the pose waits for a restart:\n{daemon.words()}")


def a_required_geometry_that_is_missing_is_told_and_30_hz_goes_on(bed):
    need_real_time()
    text = configuration_of(bed, looped_sequence(bed), "replay", loop=True)
    status = bed.subscribe("--topic", "status")
    subscriber = bed.subscribe()
    bed.start_daemon(text.replace("[[camera]]", '[[camera]]\ngeometry = "required"'))
    subscriber.wait_for(lambda s: "IMAGE_REJECTED" in s.get("reason_names", ""), "IMAGE_REJECTED", 10)
    status.wait_for(lambda s: any("came without a geometry" in stage["why"] for stage in s.get("stages", [])), "words", 5)
    from_ns = time.monotonic_ns()
    time.sleep(2)
    samples = subscriber.samples(from_ns)
    check(samples and not any(sample["has_image"] for sample in samples), "an image without its geometry was used")
    check_timing(28 <= rate_hz(samples) <= 32, f"{rate_hz(samples):.1f} Hz")


def a_geometry_comes_through_shared_memory(bed):
    need_real_time()
    folder = looped_sequence(bed)
    text = moved(configuration_of(bed, folder, "image_shm", loop=True), LOOKS_PAST_MM)
    numbers = [line.split(",")[0] for line in (folder / "frames.csv").read_text().splitlines()[1:]]
    (folder / "geometry.csv").write_text(
        "frame,fx,fy,cx,cy,qw,qx,qy,qz,x,y,z,sigma_rx,sigma_ry,sigma_rz,sigma_x,sigma_y,sigma_z,pivot_depth\n" + "".join(
            f"{number},{sequences.FOCAL_PX},{sequences.FOCAL_PX},{sequences.WIDTH / 2},{sequences.HEIGHT / 2},1,0,0,0,0,0,"
            f"{sequences.DEPTH_MM},0,0,0,0,0,0,0\n" for number in numbers))
    start_ns = time.monotonic_ns() + 3_000_000_000
    text = text.replace("[replay]", f"[replay]\nstart_monotonic_ns = {start_ns}")
    subscriber = bed.subscribe()
    bed.start_daemon(text)
    Grabber(bed, folder, "--loop", "--start-monotonic-ns", str(start_ns))
    subscriber.wait_for(is_fused, "VALID shape with an image that said how it was taken", 10)
    from_ns = time.monotonic_ns()
    time.sleep(2)
    samples = subscriber.samples(from_ns)
    say(f"{100 * share_fused(samples):.0f} % of {len(samples)} with an image; reasons {set().union(*map(reasons_of, samples))}")
    check(share_fused(samples) > 0.5, "the geometry that came with the images is not used")


def is_geometry_changed(sample):
    return "GEOMETRY_CHANGED" in sample.get("reason_names", "")


def watched_pan(bed, aside_px_at, told_within_s):
    """A daemon that plays a chest that is panned without a word after PANNED_AFTER_S: what it says, and that the right pose ends it."""
    need_real_time()
    text = configuration_of(bed, radiographs.write_panned_sequence(bed, PANNED_AFTER_S + 16, aside_px_at), "replay")
    start_ns = time.monotonic_ns() + 4_000_000_000
    text = text.replace("[replay]", f"[replay]\nstart_monotonic_ns = {start_ns}")
    status = bed.subscribe("--topic", "status")
    subscriber = bed.subscribe()
    daemon = bed.start_daemon(text)
    panned_ns = start_ns + PANNED_AFTER_S * 1_000_000_000
    first = subscriber.wait_for(is_geometry_changed, "GEOMETRY_CHANGED", PANNED_AFTER_S + 4 + told_within_s + 3).json
    before = [sample for sample in subscriber.samples() if start_ns + 2e9 < sample["valid_time_monotonic_ns"] < panned_ns]
    say(f"before the pan {100 * share_fused(before):.0f} % of {len(before)} with an image; told {milliseconds(first['valid_time_monotonic_ns'] - panned_ns):.0f} "
        f"ms after its first image as {first['validity_name']}")
    check(share_fused(before) > 0.4, "the images are not used before the pan: the test proves nothing")
    check(0 <= first["valid_time_monotonic_ns"] - panned_ns < told_within_s * 1e9, "told too early or too late")
    status.wait_for(lambda s: any("the view has moved (" in stage["why"] for stage in s.get("stages", [])), "words in TubeStatus", 5)
    from_ns = time.monotonic_ns()
    time.sleep(2)
    meanwhile = subscriber.samples(from_ns)
    check(meanwhile and all(is_found(sample) for sample in meanwhile if sample["has_image"]),
          "images of a view that has moved are used with the pose that it had")
    check(all(sample["validity_name"] == "QUESTIONABLE" and is_geometry_changed(sample) for sample in meanwhile),
          f"not QUESTIONABLE for GEOMETRY_CHANGED: {set((s['validity_name'], s['reason_names']) for s in meanwhile)}")
    check_timing(28 <= rate_hz(meanwhile) <= 32, f"{rate_hz(meanwhile):.1f} Hz")
    check("the view has moved (" in daemon.words(), f"the log says nothing of it:\n{daemon.words()}")
    bed.write("tubed-1.toml", moved(text, PANNED_MM))
    asked_ns = daemon.signal(signal.SIGHUP)
    subscriber.wait_for(is_fused, "VALID shape with an image after the right pose", 5, asked_ns)
    right_ns = time.monotonic_ns()
    time.sleep(2)
    after = subscriber.samples(right_ns)
    say(f"with the right pose {100 * share_fused(after):.0f} % of {len(after)} with an image")
    check(share_fused(after) > 0.4 and not any(map(is_geometry_changed, after)), "the right pose does not end it")


def a_table_that_is_panned_without_a_word_is_told_at_once_until_the_pose_is_right(bed):
    watched_pan(bed, lambda t_s: PANNED_PX if t_s >= PANNED_AFTER_S else 0, told_within_s=0.3)


def a_table_that_is_panned_slowly_is_told_before_it_has_gone_5_mm(bed):
    # A pixel every 0.4 s: 1.5 mm/s.
    watched_pan(bed, lambda t_s: min(PANNED_PX, max(0, int((t_s - PANNED_AFTER_S) / 0.4) + 1)), told_within_s=3.2)


if __name__ == "__main__":
    beds.main(a_swinging_view_that_says_how_it_stands_keeps_its_images, a_corrected_pose_is_taken_by_a_reload,
              a_required_geometry_that_is_missing_is_told_and_30_hz_goes_on, a_geometry_comes_through_shared_memory,
              a_table_that_is_panned_without_a_word_is_told_at_once_until_the_pose_is_right,
              a_table_that_is_panned_slowly_is_told_before_it_has_gone_5_mm,
              a_table_that_is_panned_on_request_is_noticed_and_believed_again_when_it_is_back,
              a_view_that_moved_is_found_again_and_its_pose_accepted)
