"""Readers and writers of shared memory who mean harm. None of them reaches a subscriber, and none costs a real-time thread."""
import os
import pathlib
import re
import statistics
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import bed as beds  # noqa: E402
import calm  # noqa: E402
import sequences  # noqa: E402
import shared_memory  # noqa: E402
from bed import check, check_timing, is_fused, is_valid, longest_gap_ms, milliseconds, need_real_time, rate_hz, say  # noqa: E402

SLEEPERS = 3000
TURN_S = 3
AGAIN_MS = 250  # the contract: the real writer is heard again
GRAB_SHARE = 0.05  # of one core: what a grab thread may cost whatever its writer does
MEMORY_KB = 4096  # by which the daemon may grow meanwhile
FIRST = ("chrt", "-f", "40")  # a subscriber who is not kept waiting by whoever else computes
MEMORY_LIES = ("hollow", "large", "hollow and large", "small", "not sealed", "shrunk after", "headers")
IMAGE_LIES = ("torn", "from the future", "backwards", "numbers at random")


class Evil:
    """One of the programs beside this file, from the line in which it says that it is ready on."""

    def __init__(self, bed, program, *arguments, user=None):
        self.log = bed.folder / f"tubed-{program}.log"
        with open(self.log, "ab") as sink:
            self.process = subprocess.Popen([bed.program(program), *map(str, arguments)], stdout=subprocess.PIPE, stderr=sink, text=True,
                                            preexec_fn=calm.die_with_parent, user=user)
        bed.closing.callback(self.end)
        self.hear("ready")

    def hear(self, word):
        heard = self.process.stdout.readline().strip()
        check(heard == word, f"the evil program says '{heard}', expected '{word}': {self.log.read_text()}")

    def end(self):
        """CLOCK_MONOTONIC (ns) just before."""
        now_ns = time.monotonic_ns()
        self.process.kill()
        self.process.wait()
        return now_ns


class Grabber(shared_memory.Grabber):
    """A real one, in step with the daemon's coils."""

    def __init__(self, bed, folder, start_ns):
        super().__init__(bed, folder, "--loop", "--start-monotonic-ns", str(start_ns))
        said = self.log.read_text().count("\n") if self.log.exists() else 0
        while self.log.read_text().count("\n") <= said:
            check(self.process.poll() is None, self.log.read_text())
            time.sleep(0.002)
        self.ready_ns = time.monotonic_ns()


def thread_s(daemon, name):
    """Time on a CPU so far of the daemon's thread of that name."""
    for task in pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir():
        if (task / "comm").read_text().strip() == name:
            return int((task / "schedstat").read_text().split()[0]) * 1e-9
    raise beds.Failure(f"the daemon has no thread {name}")


def resident_kb(daemon):
    status = pathlib.Path(f"/proc/{daemon.process.pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1])


def with_images_of_another(bed):
    """A daemon with real-time threads, a subscriber, the sequence and its start."""
    need_real_time()
    folder = bed.folder / "sequence"
    sequences.write_sequence(folder, shared_memory.SECONDS)
    start_ns = time.monotonic_ns() + 500_000_000
    text = shared_memory.configuration_of(bed, folder, "image_shm", start_ns, loop=True)
    subscriber = bed.subscribe(prefix=FIRST)
    daemon = bed.start_daemon(f"{text}\n{shared_memory.REAL_TIME}\n")
    grabber = Grabber(bed, folder, start_ns)
    subscriber.wait_for(is_fused, "VALID shape with an image", 10)
    return daemon, subscriber, folder, start_ns, grabber


def judge(samples, words):
    # Images may come at 30.6 Hz, which is taken for 30, and irregularly, so that ticks fall between them.
    check_timing(29 <= rate_hz(samples) <= 32, f"{words}: {rate_hz(samples):.1f} Hz")
    check_timing(longest_gap_ms(samples) <= 100, f"{words}: {longest_gap_ms(samples):.0f} ms without a shape")


def lies_are_told(bed, lies, has_good_images=False):
    """Each in the place of the real grabber, which comes back after it. Good images are in order, whatever they show."""
    daemon, subscriber, folder, start_ns, grabber = with_images_of_another(bed)
    for lie in lies:
        grabber.kill()
        subscriber.forget()
        evil = Evil(bed, "evil_writer", bed.folder / "image-A.sock", "A", sequences.WIDTH, sequences.HEIGHT, lie)
        time.sleep(0.7)  # the daemon has found out that the real one is dead, and tries again
        grab_s, before_kb, begun_ns = thread_s(daemon, "grab-A"), resident_kb(daemon), time.monotonic_ns()
        time.sleep(TURN_S)
        share = (thread_s(daemon, "grab-A") - grab_s) / ((time.monotonic_ns() - begun_ns) * 1e-9)
        grown_kb = resident_kb(daemon) - before_kb
        samples = subscriber.samples(begun_ns)
        check(daemon.process.poll() is None, f"{lie}: the daemon ended")
        check(has_good_images or not any(map(is_fused, samples)), f"{lie}: a VALID shape with an image of the liar")
        judge(samples, lie)
        evil.end()
        grabber = Grabber(bed, folder, start_ns)
        fused = subscriber.wait_for(is_fused, "VALID shape with an image of the real grabber", 5, grabber.ready_ns)
        again_ms = milliseconds(fused.read_ns - grabber.ready_ns)
        say(f"{lie}: {rate_hz(samples):.1f} Hz, longest gap {longest_gap_ms(samples):.0f} ms, grab thread {100 * share:.1f} % of a core, "
            f"{grown_kb:+} kB; the real one heard {again_ms:.0f} ms after it was there")
        check_timing(share < GRAB_SHARE, f"{lie}: the grab thread computes {100 * share:.0f} % of the time")
        check_timing(grown_kb < MEMORY_KB, f"{lie}: the daemon grew by {grown_kb} kB")
        check_timing(again_ms <= AGAIN_MS, f"{lie}: the real grabber was heard after {again_ms:.0f} ms")
    return daemon


def memory_that_is_not_what_it_says_is_refused_with_words(bed):
    daemon = lies_are_told(bed, MEMORY_LIES)
    for words in ("has holes", "expected at most", "smaller than its header says", "no sealed shared memory"):
        check(words in daemon.words(), f"the log does not say '{words}'")


def images_that_lie_are_not_believed(bed):
    daemon = lies_are_told(bed, IMAGE_LIES)
    for words in ("its exposure lies in the future", "it was not exposed after the one before"):
        check(f"image refused: {words}" in daemon.words(), f"the log does not say '{words}'")


def a_bell_without_news_keeps_no_thread_busy(bed):
    daemon = lies_are_told(bed, ("rings without news",))
    check("rings without an image" in daemon.words(), "the log does not name the writer that rings without an image")


def images_at_ten_times_the_rate_leave_as_30_hz(bed):
    health = bed.subscribe("--topic", "health")
    daemon = lies_are_told(bed, ("ten times the rate",), has_good_images=True)
    check("images come faster than daemon.rate_hz = 30" in daemon.words(), "the log does not say that images are thinned out")
    grab = [stage for stage in health.lines()[-1].json["stages"] if stage["name"] == "grab-A"][0]
    say(f"images left out, as counted in TubeHealth: {grab['dropped']}")
    check(grab["dropped"] > 100 * TURN_S, "TubeHealth does not count the images that were left out")


def estimates_in_shared_memory(bed):
    """A simulated room that publishes both ways, its threads real-time, and a subscriber to DDS of real time too."""
    need_real_time()
    socket = bed.folder / "shapes.sock"
    text = bed.simulation(head=f"[shm]\nestimates_socket = '{socket}'\n{shared_memory.REAL_TIME}\n")
    subscriber = bed.subscribe(prefix=FIRST)
    daemon = bed.start_daemon(text)
    subscriber.wait_for(is_fused, "VALID shape with an image", 10)
    return daemon, subscriber, socket


def under_way_us(samples):
    """From the estimate, finished, to the subscriber of DDS."""
    return sorted((sample["received_monotonic_ns"] - sample["stamps"]["optimizer_finished_monotonic_ns"]) / 1e3 for sample in samples)


def a_reader_with_3000_sleeping_threads_delays_no_subscriber(bed):
    daemon, subscriber, socket = estimates_in_shared_memory(bed)
    latencies_us = {False: [], True: []}
    publisher_s = {False: 0.0, True: 0.0}
    for sleeps in (False, True, False, True):
        evil = Evil(bed, "evil_reader", socket, "sleep", SLEEPERS) if sleeps else None
        time.sleep(0.5)
        subscriber.forget()
        before_s, begun_ns = thread_s(daemon, "publisher"), time.monotonic_ns()
        time.sleep(TURN_S)
        publisher_s[sleeps] += thread_s(daemon, "publisher") - before_s
        samples = subscriber.samples(begun_ns)
        judge(samples, f"{SLEEPERS if sleeps else 0} sleepers")
        latencies_us[sleeps] += under_way_us(samples)
        if evil:
            evil.end()
    p50, p90 = ({sleeps: sorted(found)[int(share * len(found))] for sleeps, found in latencies_us.items()} for share in (0.5, 0.9))
    say(f"from the estimate to a subscriber of DDS, beside nobody and beside {SLEEPERS} sleeping threads: p50 {p50[False]:.0f} and {p50[True]:.0f} us, "
        f"p90 {p90[False]:.0f} and {p90[True]:.0f} us; the publisher computes {publisher_s[False] / TURN_S / 2 * 100:.1f} and "
        f"{publisher_s[True] / TURN_S / 2 * 100:.1f} % of the time")
    check_timing(p50[True] < 3 * p50[False], "the median subscriber is delayed by them")
    check_timing(p90[True] < 3 * p90[False] + 1000, "subscribers are delayed by them")
    check_timing(publisher_s[True] < 3 * publisher_s[False], "they cost the publisher's real-time thread")


def a_reader_beside_3000_sleeping_threads_is_woken(bed):
    _, _, socket = estimates_in_shared_memory(bed)
    Evil(bed, "evil_reader", socket, "sleep", SLEEPERS)
    reader = bed.subscribe("--shm", str(socket))
    reader.wait_for(is_valid, "VALID shape through shared memory", 10)
    begun_ns = time.monotonic_ns()
    time.sleep(TURN_S)
    samples = reader.samples(begun_ns)
    median_ms = statistics.median(milliseconds(sample["received_monotonic_ns"] - sample["stamps"]["publish_started_monotonic_ns"])
                                  for sample in samples)
    say(f"beside {SLEEPERS} sleepers a reader without a priority has {rate_hz(samples):.1f} Hz, longest gap {longest_gap_ms(samples):.0f} ms, "
        f"{median_ms:.1f} ms after publishing in the median")
    # Left asleep it would look by its own clock, after the 100 ms of a missed deadline, and be 50 ms late.
    check_timing(rate_hz(samples) > 25 and median_ms < 33, "the reader is left asleep beside other readers")


def readers_that_knock_hold_the_door_or_talk_garbage_cost_nothing(bed):
    daemon, subscriber, socket = estimates_in_shared_memory(bed)
    for act, count in (("knock", 10_000), ("hold", 10_000), ("garbage", 10_000)):
        subscriber.forget()
        descriptors = len(os.listdir(f"/proc/{daemon.process.pid}/fd"))
        before_kb, begun_ns = resident_kb(daemon), time.monotonic_ns()
        evil = Evil(bed, "evil_reader", socket, act, count)
        if act == "knock":
            evil.hear("done")  # each of them was answered: about 480 a second
        else:
            time.sleep(TURN_S)
        grown_kb = resident_kb(daemon) - before_kb
        samples = subscriber.samples(begun_ns)
        judge(samples, act)
        evil.end()
        left = len(os.listdir(f"/proc/{daemon.process.pid}/fd")) - descriptors
        found = under_way_us(samples)
        ended_ns = time.monotonic_ns()
        reader = bed.subscribe("--shm", str(socket))
        came = reader.wait_for(is_valid, "VALID shape through shared memory", 5, ended_ns)
        reader.stop()
        say(f"{act}: {rate_hz(samples):.1f} Hz, from the estimate to a subscriber of DDS p50 {statistics.median(found):.0f} us, p90 {found[int(0.9 * len(found))]:.0f} us; "
            f"{grown_kb:+} kB, {left} descriptors more; a reader after it has a shape in {milliseconds(came.read_ns - ended_ns):.0f} ms")
        check_timing(grown_kb < MEMORY_KB and left <= 1, f"{act}: {grown_kb} kB and {left} descriptors more")


if __name__ == "__main__":
    beds.main(memory_that_is_not_what_it_says_is_refused_with_words, images_that_lie_are_not_believed,
              a_bell_without_news_keeps_no_thread_busy, images_at_ten_times_the_rate_leave_as_30_hz,
              a_reader_with_3000_sleeping_threads_delays_no_subscriber, a_reader_beside_3000_sleeping_threads_is_woken,
              readers_that_knock_hold_the_door_or_talk_garbage_cost_nothing)
