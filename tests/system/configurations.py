"""Configurations as the daemon itself takes or refuses them."""
import pathlib
import subprocess
import time

import bed as beds
from bed import check, is_fused, need_real_time, say

EXIT_CONFIGURATION = 78  # sysexits.h: EX_CONFIG
SOURCES = pathlib.Path(__file__).resolve().parents[2]
CASES = SOURCES / "tests" / "daemon" / "config"


def tubed(bed, *arguments):
    return subprocess.run([bed.program("tubed"), *map(str, arguments)], capture_output=True, text=True, check=False,
                          timeout=10 * beds.TIME_FACTOR)


def bad_cases():
    """(number of the line, what to find, its replacement, line:column, key)"""
    for number, line in enumerate((CASES / "bad_configurations.tsv").read_text().splitlines(), 1):
        if line and not line.startswith("#"):
            find, replacement, position, key = line.split("\t")[:4]
            unescaped = [text.replace("\\n", "\n").replace("\\t", "\t") for text in (find, replacement)]
            yield number, *unescaped, position, key


def a_hundred_bad_configurations_end_with_78_and_their_place(bed):
    good = (CASES / "base.toml").read_text()
    accepted = tubed(bed, "--check", CASES / "base.toml")
    check(accepted.returncode == 0, f"the good one is refused: {accepted.stderr}")
    cases, wrong = list(bad_cases()), []
    for number, find, replacement, position, key in cases:
        check(find in good, f"bad_configurations.tsv:{number}: base.toml has no {find!r}")
        file = bed.write("bad.toml", good.replace(find, replacement, 1))
        done = tubed(bed, "--config", file)
        expected = f"{file}:{position}: " + ("" if key == "-" else f"{key}:")
        if done.returncode != EXIT_CONFIGURATION or expected not in done.stderr:
            wrong.append(f"bad_configurations.tsv:{number}: expected exit code {EXIT_CONFIGURATION} and '{expected}', got "
                         f"{done.returncode} and:\n{done.stderr}")
    say(f"{len(cases)} bad configurations, {len(wrong)} not refused as expected")
    check(len(cases) >= 100, f"only {len(cases)} cases")
    check(not wrong, "\n".join(wrong))


def a_mirrored_registration_is_refused(bed):
    """A reflection has the size of a rotation and shows left as right: of the tracker as well as of a camera."""
    good = (CASES / "base.toml").read_text()
    for key, place, matrix in (("em.T_world_em", "22:14", "T_world_em = [[1, 0, 0, 0]"),
                               ("camera[0].T_camera_world", "33:18", "T_camera_world = [[1, 0, 0, 0]")):
        check(matrix in good, f"base.toml has no {matrix}")
        file = bed.write("mirrored.toml", good.replace(matrix, matrix.replace("[[1,", "[[-1,"), 1))
        done = tubed(bed, "--check", file)
        said = f"{file}:{place}: {key}: "
        check(done.returncode == EXIT_CONFIGURATION and said in done.stderr and "reflection" in done.stderr,
              f"expected exit code {EXIT_CONFIGURATION} and '{said}... reflection', got {done.returncode} and:\n{done.stderr}")


def the_sample_configuration_runs_as_it_is(bed):
    sample = pathlib.Path(bed.program("tubed")).parents[1] / "tubed.toml"  # the build writes it beside the programs' folder
    checked = tubed(bed, "--check", sample)
    check(checked.returncode == 0, f"tubed --check {sample} exits {checked.returncode}: {checked.stderr}")
    check(tubed(bed, "--sample").stdout == sample.read_text(), "tubed --sample prints another one")
    need_real_time()  # its images are of full size, too much for a sanitized filter
    subscriber = bed.subscribe()
    bed.start_daemon(sample.read_text())
    subscriber.wait_for(is_fused, "VALID shape with an image", 10)


def two_rooms_in_one_network_do_not_hear_each_other(bed):
    def in_room(room):
        return bed.simulation((beds.Instrument(f"cath-{room}"),)).replace("[dds]", f'[dds]\npartition = "{room}"') \
            .replace(f'control_folder = "{bed.folder}"', "")

    heard = {room: bed.subscribe("--partition", room) for room in ("north", "south")}
    for room in heard:
        bed.start_daemon(in_room(room))
    for room, subscriber in heard.items():
        subscriber.wait_for(is_fused, f"VALID shape in room {room}", 10)
    time.sleep(2)
    for room, subscriber in heard.items():
        ids = {sample["instrument_id"] for sample in subscriber.samples()}
        check(ids == {f"cath-{room}"}, f"in room {room} one hears {ids}")


if __name__ == "__main__":
    beds.main(a_hundred_bad_configurations_end_with_78_and_their_place, a_mirrored_registration_is_refused, the_sample_configuration_runs_as_it_is,
              two_rooms_in_one_network_do_not_hear_each_other)
