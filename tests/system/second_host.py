"""A subscriber on another host: two network namespaces joined by a pair of virtual Ethernet devices."""
import os
import shutil
import subprocess
import time

import bed as beds
from bed import Skip, check, check_timing, is_fused, need_preloading, rate_hz, reasons_of, say

DAEMON, SUBSCRIBER = "10.77.0.1", "10.77.0.2"
LISTENING_S = 20


def run(*command, **options):
    return subprocess.run(command, check=True, capture_output=True, text=True, **options).stdout


class SecondHost:
    """A network namespace with one cable to this one. /run is private here: nothing is left if we are killed."""

    def __init__(self, bed):
        self.name = f"tubed-{os.getpid()}"
        try:
            run("ip", "netns", "add", self.name)
            bed.closing.callback(run, "ip", "netns", "delete", self.name)
            run("ip", "link", "add", "tubed-a", "type", "veth", "peer", "name", "tubed-b", "netns", self.name)
        except subprocess.CalledProcessError as refused:
            raise Skip(f"no second network namespace with a veth pair: {refused.stderr.strip()}") from None
        run("ip", "address", "add", f"{DAEMON}/24", "dev", "tubed-a")
        run("ip", "link", "set", "tubed-a", "up")
        run(*self.inside, "ip", "address", "add", f"{SUBSCRIBER}/24", "dev", "tubed-b")
        for device in ("lo", "tubed-b"):
            run(*self.inside, "ip", "link", "set", device, "up")

    @property
    def inside(self):
        return ("ip", "netns", "exec", self.name)

    def lose(self, percent):
        """Drops so many of 100 UDP packets on arrival: the sender does not learn of it."""
        if shutil.which("nft") is None:
            raise Skip("no nft to lose packets with: apt-get install nftables")
        rules = ("table inet loss {\nchain arriving {\ntype filter hook input priority 0; policy accept;\n"
                 f"meta l4proto udp numgen random mod 100 < {percent} counter drop\n}}\n}}\n")
        try:
            run(*self.inside, "nft", "-f", "-", input=rules)
        except subprocess.CalledProcessError as refused:
            check("syntax error" not in refused.stderr, refused.stderr)
            raise Skip(f"nftables cannot lose packets here: {refused.stderr.strip()}") from None

    def lost_packets(self):
        words = run(*self.inside, "nft", "list", "ruleset").split()
        return int(words[words.index("packets") + 1])


def listen_from_second_host(bed, lose_percent=0):
    """The samples that a subscriber on a second host gets in 20 s, and its bed."""
    host = SecondHost(bed)
    if lose_percent:
        host.lose(lose_percent)
    bed.start_daemon(bed.simulation(interface=DAEMON))
    subscriber = bed.subscribe("--interface", SUBSCRIBER, prefix=host.inside)
    subscriber.wait_for(is_fused, "VALID shape with an image on the second host", 15)
    from_ns = time.monotonic_ns()
    time.sleep(LISTENING_S)
    return subscriber.samples(from_ns), host


def share_delivered(samples):
    numbers = [sample["sequence_number"] for sample in samples]
    check(numbers == sorted(set(numbers)), "numbers went backward or came twice")
    return len(numbers) / (numbers[-1] - numbers[0] + 1)


def a_second_host_gets_30_hz(bed):
    samples, _ = listen_from_second_host(bed)
    rate, share = rate_hz(samples), share_delivered(samples)
    say(f"{rate:.2f} Hz, {100 * share:.1f} % of the numbers, longest gap {beds.longest_gap_ms(samples):.0f} ms")
    check_timing(rate >= 29, f"{rate:.2f} Hz on the second host, expected 30")
    check_timing(share >= 0.99, f"{100 * share:.1f} % delivered although nothing is lost")


def a_second_host_that_loses_5_percent_of_packets_gets_98_percent_of_shapes(bed):
    samples, host = listen_from_second_host(bed, lose_percent=5)
    lost, share = host.lost_packets(), share_delivered(samples)
    say(f"{lost} UDP packets dropped; {100 * share:.1f} % of the numbers came ({len(samples)} samples, "
        f"{rate_hz(samples):.2f} Hz, longest gap {beds.longest_gap_ms(samples):.0f} ms)")
    # Five of 100 packets of three topics and more at over 100 packets a second, for 20 s.
    check(lost >= 30, f"only {lost} packets were dropped: this was no test")
    # 95 % would come if nothing were sent again; nearly all when what was lost is repaired before it is replaced.
    check_timing(share >= 0.98, f"{100 * share:.1f} % delivered, expected 98 %")


def nothing_leaves_the_host_by_default(bed):
    """Bound to lo unless the configuration says otherwise: a subscriber on a second host hears nothing."""
    host = SecondHost(bed)
    bed.start_daemon()
    far = bed.subscribe("--interface", SUBSCRIBER, prefix=host.inside)
    bed.subscribe().wait_for(is_fused, "VALID shape with an image on the daemon's host", 10)
    time.sleep(5)
    check(far.process.poll() is None, f"the far subscriber ended: {far.errors.read_text()}")
    check(not far.lines(), "a second host heard a daemon that is bound to lo")


def a_clock_without_reference_is_told_where_other_hosts_listen(bed):
    """CLOCK_UNSYNCED follows what the kernel says, and leaves the validity alone; on lo nobody needs it."""
    need_preloading()
    answer = bed.write("kernel-clock", "free")
    prefix = ("env", f"LD_PRELOAD={bed.programs / 'libkernel_clock.so'}", f"KERNEL_CLOCK={answer}")
    near = bed.subscribe()
    alone = bed.start_daemon(prefix=prefix)
    sample = near.wait_for(is_fused, "VALID shape with an image on lo", 15).json
    check("CLOCK_UNSYNCED" not in reasons_of(sample), f"nobody compares clocks on lo: {sample['reason_names']}")
    bed.end_daemons()
    host = SecondHost(bed)
    bed.start_daemon(bed.simulation(interface=DAEMON), prefix=prefix)
    far = bed.subscribe("--interface", SUBSCRIBER, prefix=host.inside)
    for word, is_flagged in (("free", True), ("followed", False), ("refused", True), ("followed", False)):
        answer.write_text(word)
        from_ns = time.monotonic_ns()
        sample = far.wait_for(
            lambda sample, flagged=is_flagged: is_fused(sample) and ("CLOCK_UNSYNCED" in reasons_of(sample)) == flagged,
            f"VALID shape while the clock is {word}", 15, since_ns=from_ns).json
        say(f"{word}: {sample['validity_name']} {sample['reason_names']}")


if __name__ == "__main__":
    beds.main(a_second_host_gets_30_hz, a_second_host_that_loses_5_percent_of_packets_gets_98_percent_of_shapes,
              nothing_leaves_the_host_by_default, a_clock_without_reference_is_told_where_other_hosts_listen)
