"""What the hot threads of a running daemon must not do: allocate, lock, throw."""
import signal
import time

import bed as beds
from bed import Skip, check, say

HOT = ("em", "grab-A", "view-A", "frangi-A", "optimizer")
COUNTED_S = 10


def stages_of(health):
    """Those that are threads: idl/README.md."""
    return {stage["name"]: stage for stage in health["stages"] if stage["name"] not in ("dds", "shm-door")}


def check_no_costs(before, after, meanwhile):
    for name in HOT:
        costs = {what: after[name][what] - before[name][what] for what in ("allocations", "locks", "exceptions")}
        say(f"{name:10} {costs}")
        check(not any(costs.values()), f"{name} while {meanwhile}: {costs}")


def hot_threads_neither_allocate_nor_lock_nor_throw(bed):
    health = bed.subscribe("--topic", "health", "--instrument", "cath-1")
    bed.tracked(bed.simulation((beds.Instrument("cath-1", 1), beds.Instrument("cath-2", 6)),
                               head=f'[shm]\npreview_folder = "{bed.folder}"\n'))  # the Frangi thread copies images for viewers
    time.sleep(2)  # start-up: first images, first shapes
    from_ns = time.monotonic_ns()
    first = health.wait_for(lambda _: True, "TubeHealth", 3, from_ns)
    last = health.wait_for(lambda _: True, "TubeHealth", COUNTED_S + 3, first.read_ns + int(COUNTED_S * 1e9))
    before, after = stages_of(first.json), stages_of(last.json)
    check(set(after) == {*HOT, "publisher", "preview"}, f"stages {sorted(after)}")
    if not all(stage["allocations_counted"] for stage in after.values()):
        if beds.TIME_FACTOR > 1:
            raise Skip("a sanitizer owns the functions that are counted here; run it in a build without one")
        raise beds.Failure(f"costs are not counted: {[(n, s['allocations_counted']) for n, s in after.items()]}")
    grown = {name: {what: after[name][what] - before[name][what] for what in
                    ("steps", "allocations", "locks", "exceptions", "refused")} for name in after}
    for name, figures in grown.items():
        say(f"{name:10} " + "  ".join(f"{what} {count}" for what, count in figures.items()))
    for name in HOT:
        check(grown[name]["steps"] >= 20 * COUNTED_S, f"{name} made only {grown[name]['steps']} steps in {COUNTED_S} s")
        for what in ("allocations", "locks", "exceptions"):
            check(grown[name][what] == 0, f"{name}: {grown[name][what]} {what} in {grown[name]['steps']} steps")
    # The same counters do count: publishing allocates and locks in Cyclone.
    for what in ("allocations", "locks"):
        check(grown["publisher"][what] > 0, f"the publisher's {what} are 0: nothing is counted")


def hot_threads_stay_clean_while_a_view_moves(bed):
    """Each image has a geometry of its own, to a degree and a millimetre; the configuration's is changed by a reload meanwhile."""
    health = bed.subscribe("--topic", "health")
    text = bed.simulation(simulation="swing_deg = 40\nswing_every_s = 6\nswing_deg_s = 20")
    daemon, _ = bed.tracked(text)
    time.sleep(2)
    first = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    for depth_mm in (1201, 1200):
        bed.write("tubed-1.toml", text.replace("[0,0,1,1200]", f"[0,0,1,{depth_mm}]"))
        daemon.signal(signal.SIGHUP)
        time.sleep(2)
    last = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    before, after = stages_of(first.json), stages_of(last.json)
    if not after["em"]["allocations_counted"]:
        check(beds.TIME_FACTOR > 1, "costs are not counted")
        raise Skip("a sanitizer owns the functions that are counted here; run it in a build without one")
    check_no_costs(before, after, "the view moved")


def hot_threads_stay_clean_while_a_view_that_moved_is_found(bed):
    """The table is panned and nobody says so; coils and images find where the view stands."""
    health = bed.subscribe("--topic", "health")
    _, subscriber = bed.tracked()
    time.sleep(12)  # the background is learnt
    first = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    panned_ns = bed.fault("image-A", "pan 12")
    subscriber.wait_for(lambda sample: "GEOMETRY_CHANGED" in sample.get("reason_names", "") and sample["has_image"],
                        "the view was not found", 25, panned_ns)
    last = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    before, after = stages_of(first.json), stages_of(last.json)
    if not after["em"]["allocations_counted"]:
        check(beds.TIME_FACTOR > 1, "costs are not counted")
        raise Skip("a sanitizer owns the functions that are counted here; run it in a build without one")
    check_no_costs(before, after, "a view that moved was found")


def hot_threads_stay_clean_when_sources_fail(bed):
    """Faults are handled by the hot threads too: a stall, a lost coil, a black image cost nothing either."""
    health = bed.subscribe("--topic", "health")
    bed.tracked()
    time.sleep(2)
    first = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    for source, command in (("image-A", "stall 0.7"), ("em", "lose-coil 3"), ("em", "lose-coil 1"), ("image-A", "black"),
                            ("em", "stall 0.7"), ("image-A", "off"), ("em", "outlier 2 60"), ("em", "stuck")):
        bed.fault(source, command)
        time.sleep(0.9)
        bed.fault(source, "clear")
        time.sleep(0.2)
    last = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    before, after = stages_of(first.json), stages_of(last.json)
    if not after["em"]["allocations_counted"]:
        check(beds.TIME_FACTOR > 1, "costs are not counted")
        raise Skip("a sanitizer owns the functions that are counted here; run it in a build without one")
    check_no_costs(before, after, "sources failed")


def hot_threads_stay_clean_while_images_are_mirrored(bed):
    """Nobody told the daemon that they are: it reads them in other ways too, and says which one shows the tube."""
    health = bed.subscribe("--topic", "health")
    daemon = bed.start_daemon(bed.simulation(simulation='mistakes = "mirrored"'))
    found = health.wait_for(lambda sample: sample["agreement"]["explanation"] == 9, "the mirrored images were not named", 30)
    time.sleep(4 * beds.TIME_FACTOR)
    last = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    check(last.json["agreement"]["explanation"] == 9, f"they are named no longer: {last.json['agreement']}")
    check("images of camera A show the tube when they are mirrored left to right" in daemon.words(), f"no word of it: {daemon.words()}")
    before, after = stages_of(found.json), stages_of(last.json)
    if not after["em"]["allocations_counted"]:
        check(beds.TIME_FACTOR > 1, "costs are not counted")
        raise Skip("a sanitizer owns the functions that are counted here; run it in a build without one")
    check_no_costs(before, after, "images were mirrored")


def hot_threads_stay_clean_while_it_is_found_that_tubes_are_bright(bed):
    """Images come as negatives, and nobody has said so: the filter reads those after it for bright ridges."""
    words = "tubes are bright on its images"
    health = bed.subscribe("--topic", "health")
    daemon = bed.start_daemon(bed.simulation(simulation='mistakes = "polarity"'))
    first = health.wait_for(lambda sample: stages_of(sample).get("frangi-A", {}).get("steps", 0) > 0, "image was measured", 30)
    check(words not in daemon.words(), "it was found before anything was counted")
    until = time.monotonic() + 15 * beds.TIME_FACTOR
    while words not in daemon.words() and time.monotonic() < until:
        time.sleep(0.1)
    check(words in daemon.words(), f"it is not found: {daemon.words()}")
    time.sleep(2 * beds.TIME_FACTOR)
    last = health.wait_for(lambda _: True, "TubeHealth", 3, time.monotonic_ns())
    check(not last.json["agreement"]["disagree"], f"it is called a mistake: {last.json['agreement']}")
    before, after = stages_of(first.json), stages_of(last.json)
    if not after["em"]["allocations_counted"]:
        check(beds.TIME_FACTOR > 1, "costs are not counted")
        raise Skip("a sanitizer owns the functions that are counted here; run it in a build without one")
    check_no_costs(before, after, "it was found")


if __name__ == "__main__":
    beds.main(hot_threads_neither_allocate_nor_lock_nor_throw, hot_threads_stay_clean_when_sources_fail,
              hot_threads_stay_clean_while_a_view_moves, hot_threads_stay_clean_while_a_view_that_moved_is_found,
              hot_threads_stay_clean_while_images_are_mirrored,
              hot_threads_stay_clean_while_it_is_found_that_tubes_are_bright)
