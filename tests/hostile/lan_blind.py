"""A host on the LAN sends packets to a machine whose daemon and clients are bound to lo: none may reach them."""
import contextlib
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "system"))
import bed as beds  # noqa: E402
import calm  # noqa: E402
from bed import Skip, check, say  # noqa: E402
from second_host import DAEMON as VICTIM, SUBSCRIBER as ATTACKER, SecondHost, run  # noqa: E402

DISCOVERY_PORT = 7400  # multicast, of all participants of domain 0
FIRST_PORT, LAST_PORT = 7410, 7430  # unicast ports of the first participants of domain 0
PACKETS = 100
FORGING_S = 8


def udp_sockets():
    """{port: packets dropped} of every UDP socket in this network."""
    found = {}
    for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]:
        words = line.split()
        found[int(words[1].split(":")[1], 16)] = int(words[12])
    return found


def udp_ports_of(pid):
    """DDS's ports among those of the UDP sockets that this process holds."""
    held = set()
    for descriptor in pathlib.Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(FileNotFoundError):  # closed meanwhile
            held.add(os.readlink(descriptor))
    lines = [line.split() for line in pathlib.Path("/proc/net/udp").read_text().splitlines()[1:]]
    ports = [int(words[1].split(":")[1], 16) for words in lines if f"socket:[{words[9]}]" in held]
    return sorted(port for port in ports if DISCOVERY_PORT <= port <= LAST_PORT)


def relay(host, *arguments):
    return subprocess.Popen([*host.inside, sys.executable, str(HERE / "lan_relay.py"), *map(str, arguments)], stdout=subprocess.PIPE,
                            text=True, preexec_fn=calm.die_with_parent)


def listening_ports():
    return sorted(port for port in udp_sockets() if FIRST_PORT <= port <= LAST_PORT)


def packets_of_the_lan_reach_neither_daemon_nor_client(bed):
    """The kernel counts, for each socket, the packets that its filter refused."""
    host = SecondHost(bed)
    bed.tracked()
    reached = {port: PACKETS - dropped_of(host, VICTIM, port) for port in listening_ports()}
    say(f"of {PACKETS} packets from the LAN reached, by port: {reached}")
    check(len(reached) >= 4, f"daemon and client listen at two ports each, seen: {reached}")
    check(not any(reached.values()), f"packets of the LAN reached programs that are bound to lo: {reached}")


class SecondCable:
    """Another cable from this machine to the same second host."""

    HERE = "10.78.0.1"

    def __init__(self, host):
        run("ip", "link", "add", "tubed-c", "type", "veth", "peer", "name", "tubed-d", "netns", host.name)
        run("ip", "address", "add", f"{self.HERE}/24", "dev", "tubed-c")
        run("ip", "link", "set", "tubed-c", "up")
        run(*host.inside, "ip", "address", "add", "10.78.0.2/24", "dev", "tubed-d")
        run(*host.inside, "ip", "link", "set", "tubed-d", "up")


def dropped_of(host, address, port):
    """How many of PACKETS packets of that host the socket's filter drops."""
    before = udp_sockets()[port]
    check(relay(host, address, port, PACKETS, "--invented").wait(20) == 0, "the attacker failed")
    return udp_sockets()[port] - before


def with_an_interface_chosen_packets_of_another_one_are_dropped(bed):
    """Chosen is the first cable. Subscribers on this host and at the first cable are served, the second cable is closed."""
    host = SecondHost(bed)
    SecondCable(host)
    bed.start_daemon(bed.simulation(interface=VICTIM))
    far = bed.subscribe("--interface", ATTACKER, prefix=host.inside)
    near = bed.subscribe("--interface", VICTIM)
    far.wait_for(beds.is_valid, "VALID shape on the second host", 20)
    near.wait_for(beds.is_valid, "VALID shape of a subscriber on the daemon's host", 20)
    reached = {port: (PACKETS - dropped_of(host, VICTIM, port), PACKETS - dropped_of(host, SecondCable.HERE, port))
               for port in listening_ports()}
    say(f"of {PACKETS} packets reached, by port, through the chosen cable and through the other one: {reached}")
    check(len(reached) >= 4, f"daemon and client listen at two ports each, seen: {reached}")
    check(all(counts == (PACKETS, 0) for counts in reached.values()), f"expected all and none: {reached}")


def the_firewall_file_lets_in_the_chosen_interface_alone(bed):
    """A plain socket without a filter, as another vendor's DDS has it, behind tubed.nft with and without the interface."""
    host = SecondHost(bed)
    if shutil.which("nft") is None:
        raise Skip("no nft: apt-get install nftables")
    rules = (HERE.parent.parent / "systemd/tubed.nft").read_text()
    opened = rules.replace('{ "lo" }', '{ "lo", "tubed-a" }')
    check(opened != rules, "tubed.nft names its interfaces in another way")
    arrived = []
    for text in ("", rules, opened):
        if text:
            file = bed.write("tubed.nft", text)
            run("nft", "-c", "-f", str(file))
            run("nft", "-f", str(file))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
            plain.bind(("0.0.0.0", FIRST_PORT))
            plain.setblocking(False)
            check(relay(host, VICTIM, FIRST_PORT, PACKETS, "--invented").wait(20) == 0, "the attacker failed")
            arrived.append(waiting_packets(plain))
    say(f"of {PACKETS} packets arrived without the firewall {arrived[0]}, with it {arrived[1]}, with the interface named {arrived[2]}")
    check(arrived == [PACKETS, 0, PACKETS], f"expected all, none, all: {arrived}")


def waiting_packets(plain):
    count = 0
    with contextlib.suppress(BlockingIOError):
        while plain.recv(2048):
            count += 1
    return count


def the_doctor_says_who_can_reach_which_port(bed):
    SecondHost(bed)

    def said(file):
        answer = bed.tubectl("doctor", "--json", "--config", str(file))
        return [(one["verdict"], one["found"]) for one in json.loads(answer.stdout) if one["check"] == "network"]

    for interface, verdict, who in (("lo", "good", "only this host"), (VICTIM, "advice", "hosts on tubed-a")):
        file = bed.write("asked.toml", bed.simulation(interface=interface))
        before = said(file)
        check(len(before) == 1 and "does not run" in before[0][1] and before[0][0] == verdict, f"without a daemon: {before}")
        daemon = bed.start_daemon(bed.simulation(interface=interface))
        subscriber = bed.subscribe("--interface", interface)
        subscriber.wait_for(beds.is_valid, "VALID shape", 15)
        found = said(file)
        for line in found:
            say(": ".join(line))
        own = [(level, words) for level, words in found if f"process {daemon.process.pid})" in words]
        # Whichever of the two programs was first has the ports from 7410.
        ports = udp_ports_of(daemon.process.pid)
        named = sorted(int(number) for _, words in own for number in re.findall(r"\b74[0-3]\d\b", words.partition(")")[2]))
        check(len(ports) >= 2, f"the daemon listens at {ports} alone: this was no test")
        check(named == ports, f"the daemon's UDP ports are {ports}, named are {named}: {found}")
        check(all(level == verdict and who in words for level, words in own), f"expected {verdict}, {who}: {found}")
        daemon.stop()
        subscriber.stop()


def a_forger_on_the_lan_shows_a_client_on_lo_nothing(bed):
    """The forger has a laboratory of its own, whose catheter is 50 mm to the side, and sends all of its packets here."""
    host = SecondHost(bed)
    client = bed.subscribe()
    time.sleep(1)
    relaying = relay(host, VICTIM, FIRST_PORT, LAST_PORT)
    bed.closing.callback(lambda: (relaying.kill(), relaying.wait()))
    check(relaying.stdout.readline() == "listening\n", "the relay does not listen")
    laboratory = bed.subscribe(prefix=host.inside)
    # T_world_em, then T_camera_world, so that its coils and images agree.
    aside = bed.simulation().replace("[[1,0,0,0]", "[[1,0,0,50]", 1).replace("[[1,0,0,0]", "[[1,0,0,-50]", 1)
    aside = aside.replace(f'"{bed.folder}"', '""')
    bed.start_daemon(aside, prefix=host.inside)
    laboratory.wait_for(beds.is_valid, "VALID shape in the forger's laboratory", 15)
    time.sleep(FORGING_S)
    forged, shown = len(laboratory.samples()), len(client.samples())
    say(f"{forged} forged shapes sent from the LAN, {shown} shown by a client on lo")
    check(forged > 100, "too few were forged: this was no test")
    check(shown == 0, f"a client on lo showed {shown} shapes of a forger on the LAN")


if __name__ == "__main__":
    beds.main(packets_of_the_lan_reach_neither_daemon_nor_client, a_forger_on_the_lan_shows_a_client_on_lo_nothing,
              with_an_interface_chosen_packets_of_another_one_are_dropped, the_firewall_file_lets_in_the_chosen_interface_alone,
              the_doctor_says_who_can_reach_which_port)
