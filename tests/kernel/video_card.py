"""The daemon, the doctor and tubectl grab at a video device of the kernel.

Runs in the guest of video_guest.py: /dev/video0 captures 1280 x 720, and plays faults on request.
"""
import fcntl
import json
import struct

import bed as beds
from bed import check, say

CARD = "/dev/video0"
S_CTRL = 0xC008561C  # VIDIOC_S_CTRL
DISCONNECT, SIGNAL_MODE = 0xF0F041, 0xF0F03E  # controls of the kernel's module vivid
NO_SIGNAL, A_SIGNAL = 1, 0
RUNNING, RECONNECTING = 1, 3  # states of a stage in TubeStatus


def control(number, value):
    with open(CARD, "rb", buffering=0) as node:
        fcntl.ioctl(node, S_CTRL, struct.pack("<Ii", number, value))


def configuration(bed, keys="decimation = 8\nformat = \"grey\"\n"):
    # The guest has one slow CPU: few images, and coils alone.
    text = bed.simulation(instruments=[beds.Instrument(mode="em")], head="[daemon]\nrate_hz = 5.0\n", simulation="em_rate_hz = 5.0\n")
    camera = text[text.index("[[camera]]"):text.index("[[instrument]]")]
    card = ('[[camera]]\nname = "A"\nwidth = 1280\nheight = 720\nfx = 6000.0\nfy = 6000.0\ncx = 640.0\ncy = 360.0\n'
            f'T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,1200],[0,0,0,1]]\ndriver = "v4l2"\ndevice = "{CARD}"\n\n')
    return text.replace(camera, card) + f"[v4l2]\n{keys}\n"


def stage_of(status):
    return next((stage for stage in status.get("stages", ()) if stage["name"] == "grab-A"), {})


class Room:
    """A daemon whose images come from the card."""

    def __init__(self, bed, **options):
        self.status = bed.subscribe("--topic", "status")
        self.daemon = bed.start_daemon(configuration(bed, **options))

    def told(self, state, words="", since_ns=0):
        def is_told(status):
            stage = stage_of(status)
            return stage.get("state") == state and words in stage.get("why", "")
        try:
            return self.status.wait_for(is_told, f"status {state} {words}", 6, since_ns)
        except beds.Failure:
            said = list(dict.fromkeys((stage_of(s).get("state"), stage_of(s).get("why")) for s in self.status.samples(since_ns)))
            raise beds.Failure(f"no status says {state} '{words}'; they say {said}") from None


def the_daemon_tells_what_happens_to_a_card(bed):
    room = Room(bed)
    running = room.told(RUNNING)
    control(SIGNAL_MODE, NO_SIGNAL)
    lost = room.told(RECONNECTING, "no signal", running.read_ns)
    control(SIGNAL_MODE, A_SIGNAL)
    back = room.told(RUNNING, since_ns=lost.read_ns)
    with open("/dev/video1", "rb", buffering=0):  # the device stays away while this is open
        control(DISCONNECT, 1)
        room.told(RECONNECTING, "has gone", back.read_ns)
    room.told(RUNNING, since_ns=beds.time.monotonic_ns())
    check(room.daemon.process.poll() is None, "the daemon has ended")


def findings(bed, name):
    done = bed.tubectl("doctor", "--json", "--config", str(bed.folder / name))
    return {one["check"]: one for one in json.loads(done.stdout)}


def the_doctor_names_the_card_and_what_does_not_fit(bed):
    bed.write("good.toml", configuration(bed))
    good = findings(bed, "good.toml")
    say(good[f"card {CARD}"]["found"])
    for words in ("vivid", "HDMI", "signal 1280 x 720", "grey up to"):
        check(words in good[f"card {CARD}"]["found"], f"the doctor does not say {words}: {good}")
    check(good["camera A"]["verdict"] == "good", f"{good['camera A']}")
    check("card /dev/video1" not in good, "an output is no card")
    bed.write("size.toml", configuration(bed, keys="").replace("width = 1280\nheight = 720", "width = 640\nheight = 480"))
    found = findings(bed, "size.toml")["camera A"]
    check(found["verdict"] == "WRONG" and "1280 x 720" in found["found"] and "640 x 480" in found["found"], f"{found}")
    bed.write("absent.toml", configuration(bed).replace(CARD, "/dev/video7"))
    found = findings(bed, "absent.toml")["camera A"]
    check(found["verdict"] == "WRONG" and "/dev/video7 is not there" in found["found"], f"{found}")
    bed.write("socket.toml", configuration(bed).replace('"v4l2"', '"image_shm"').replace(CARD, str(bed.folder / "nobody.sock")))
    found = findings(bed, "socket.toml")["camera A"]
    check(found["verdict"] == "WRONG" and "nobody serves it" in found["found"], f"{found}")


def a_grabber_of_its_own_hands_the_cards_pictures_to_the_daemon(bed):
    door = bed.folder / "image-A.sock"
    grabber = beds.Daemon([bed.program("tubectl"), "grab", "--video", CARD, "--socket", str(door), "--decimation", "8", "--format", "grey"],
                          bed.folder / "tubed-grab.log")
    bed.daemons.append(grabber)
    text = configuration(bed).replace('"v4l2"', '"image_shm"').replace(CARD, str(door)).replace("[v4l2]\ndecimation = 8\nformat = \"grey\"\n", "")
    text = text.replace("width = 1280\nheight = 720\nfx = 6000.0\nfy = 6000.0\ncx = 640.0\ncy = 360.0",
                        "width = 160\nheight = 90\nfx = 750.0\nfy = 750.0\ncx = 79.6\ncy = 44.6")
    status = bed.subscribe("--topic", "status")
    bed.start_daemon(text)
    status.wait_for(lambda s: stage_of(s).get("state") == RUNNING, "status of images that come", 6)
    control(SIGNAL_MODE, NO_SIGNAL)
    until = beds.time.monotonic() + 60
    while "no signal" not in grabber.words():
        check(beds.time.monotonic() < until, f"the grabber does not tell the lost signal: {grabber.words()}")
        beds.time.sleep(0.1)
    control(SIGNAL_MODE, A_SIGNAL)
    while "was started" not in grabber.words().rpartition("no signal")[2]:
        check(beds.time.monotonic() < until, f"the grabber does not go on: {grabber.words()}")
        beds.time.sleep(0.1)


if __name__ == "__main__":
    beds.main(the_daemon_tells_what_happens_to_a_card, the_doctor_names_the_card_and_what_does_not_fit,
              a_grabber_of_its_own_hands_the_cards_pictures_to_the_daemon)
