"""The simulation as a person uses it: folders it writes, and what it says about a vessel it cannot use."""
import csv
import hashlib
import json

import bed as beds
from bed import check, say

EXIT_CONFIGURATION = 78  # sysexits.h
IN_METRES = "x,y,z,radius\n" + "".join(f"0,0,{0.05 * i},0.010\n" for i in range(12))


def _digest(folder):
    """Of every file but its own name, by path."""
    return {str(file.relative_to(folder)): hashlib.sha256(file.read_bytes()).hexdigest()
            for file in sorted(folder.rglob("*")) if file.is_file()}


def _simulated(bed, name, seed, *options):
    folder = bed.folder / name
    done = bed.tubectl("simulate", "--preset", "paper", "--seed", str(seed), "--every", "40", "--out", str(folder), *options,
                       timeout_s=150)
    check(done.returncode == 0, f"tubectl simulate exits {done.returncode}: {done.stderr}")
    return folder


def a_simulated_folder_is_the_same_for_the_same_seed_and_can_be_reconstructed(bed):
    folder, again, other = _simulated(bed, "a", 21), _simulated(bed, "b", 21), _simulated(bed, "c", 22)
    check(_digest(folder) == _digest(again), "the same seed gives other files")
    check(_digest(folder)["truth.csv"] != _digest(other)["truth.csv"], "another seed gives the same truth")
    for mode in ("em", "filter"):
        done = bed.tubectl("reconstruct", str(folder), "--mode", mode, "--out", str(bed.folder / f"{mode}.csv"),
                           timeout_s=100)
        check(done.returncode == 0, f"tubectl reconstruct --mode {mode} exits {done.returncode}: {done.stderr}")
    with open(folder / "frames.csv", encoding="utf-8", newline="") as rows:
        frames = {row["frame"] for row in csv.DictReader(rows)}
    with open(bed.folder / "filter.csv", encoding="utf-8", newline="") as rows:
        check({row["frame"] for row in csv.DictReader(rows)} == frames, "not every exposure was reconstructed")
    done = bed.tubectl("evaluate", str(folder), "--em", str(bed.folder / "em.csv"), "--fused",
                       str(bed.folder / "filter.csv"), "--in-view", "--json", "-")
    check(done.returncode == 0, f"tubectl evaluate exits {done.returncode}: {done.stderr}")
    metrics = json.loads(done.stdout)["comparison"]["metrics"]
    across = {method: metrics["x RMS"][f"{method}_mm"]["median"] for method in ("em", "fused")}
    say(f"across the view, mm: {across}")
    check(across["fused"] < 0.5 * across["em"], f"images do not help: {across}")
    check(len(frames) >= 8, f"only {len(frames)} exposures")


def the_second_view_comes_as_often_as_asked_for(bed):
    folder = bed.folder / "two"
    done = bed.tubectl("simulate", "--preset", "biplane", "--every", "60", "--second-view-every", "1", "--out", str(folder), timeout_s=150)
    check(done.returncode == 0, f"tubectl simulate exits {done.returncode}: {done.stderr}")
    with open(folder / "frames.csv", encoding="utf-8", newline="") as rows:
        cameras = [row["camera"] for row in csv.DictReader(rows)]
    check(cameras.count("A") == cameras.count("B") >= 5, f"views: {cameras}")
    done = bed.tubectl("simulate", "--preset", "paper", "--second-view-every", "1")
    check(done.returncode != 0 and "one view" in done.stderr, f"a second view of a preset with one: {done.returncode}, {done.stderr}")


def mistakes_change_what_is_described_or_measured_and_never_the_truth(bed):
    right = _simulated(bed, "right", 21)
    texts = ("registration=6,2", "offset=2,5", "focal=1.08")
    digest = _digest(right)
    described = _digest(_simulated(bed, "described", 21, *(word for text in texts for word in ("--mistake", text))))
    check({name for name in digest if described[name] != digest[name]} <= {"sequence.toml", "em.csv"},
          "a wrong description changes pictures, stamps or the truth")
    check(described["sequence.toml"] != digest["sequence.toml"], "nothing is described wrong")
    late = _simulated(bed, "late", 21, "--mistake", "clock=150")
    check(_digest(late)["truth.csv"] == digest["truth.csv"], "a late clock changes the truth")
    stamps = [[float(row["t_s"]) for row in csv.DictReader(open(folder / "frames.csv", encoding="utf-8", newline=""))] for folder in (right, late)]
    check(all(abs(b - a - 0.15) < 1e-9 for a, b in zip(*stamps)), f"stamps are not 150 ms late: {stamps}")
    panned = _digest(_simulated(bed, "panned", 21, "--pan", "5", "--unannounced"))
    changed = {name for name in digest if panned[name] != digest[name]}
    check("truth.csv" not in changed and "geometry.csv" not in panned, "an unannounced pan changes the truth or is announced")
    pictures = sorted((name for name in digest if name.startswith("images/")), key=lambda name: int(name.split("-")[1].split(".")[0]))
    half = len(pictures) // 2
    check(changed & set(pictures) == set(pictures[half:]) or changed & set(pictures) == set(pictures[half + 1:]), f"not the second half of the pictures changed: {sorted(changed)}")
    done = bed.tubectl("simulate", "--mistake", "focal=9")
    check(done.returncode != 0 and "FACTOR from 0.2 to 5" in done.stderr, f"focal=9: {done.returncode}, {done.stderr}")


def a_daemon_with_a_mistake_that_there_is_not_ends_with_78(bed):
    daemon = bed.start_daemon(bed.simulation(simulation='mistakes = "focus=1.1"'))
    code = daemon.wait(20)
    say(daemon.words().strip())
    check(code == EXIT_CONFIGURATION and "focal=FACTOR" in daemon.words(), f"exit code {code}, expected {EXIT_CONFIGURATION} and the list")


def a_vessel_in_metres_is_refused_with_its_place(bed):
    vessel = bed.write("aorta.csv", IN_METRES)
    done = bed.tubectl("simulate", "--vessel", str(vessel))
    say(done.stderr.strip())
    check(done.returncode != 0, "tubectl simulate took it")
    for word in (f"{vessel}:2", "is it in m?"):
        check(word in done.stderr, f"tubectl does not say {word!r}")


def a_daemon_with_a_vessel_it_cannot_use_ends_with_78(bed):
    for name, text, words in (("aorta.csv", IN_METRES, ("aorta.csv:2", "is it in m?")),
                              ("aorta.stl", "solid open\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\nendloop\nendfacet\n"
                               "endsolid open\n", ("aorta.stl", "closed surface"))):
        vessel = bed.write(name, text)
        daemon = bed.start_daemon(bed.simulation(simulation=f'preset = "paper"\nvessel = "{vessel}"'))
        code = daemon.wait(20)
        say(daemon.words().strip())
        check(code == EXIT_CONFIGURATION, f"exit code {code}, expected {EXIT_CONFIGURATION}")
        for word in words:
            check(word in daemon.words(), f"the message does not say {word!r}")


if __name__ == "__main__":
    beds.main(a_simulated_folder_is_the_same_for_the_same_seed_and_can_be_reconstructed,
              the_second_view_comes_as_often_as_asked_for, a_vessel_in_metres_is_refused_with_its_place,
              mistakes_change_what_is_described_or_measured_and_never_the_truth, a_daemon_with_a_mistake_that_there_is_not_ends_with_78, a_daemon_with_a_vessel_it_cannot_use_ends_with_78)
