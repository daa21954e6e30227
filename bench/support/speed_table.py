#!/usr/bin/env python3
"""The tables of latency, speed and accuracy in the READMEs, made from bench/results/*.json.

  speed_table.py           print them
  speed_table.py --write   put them into bench/README.md and README.md, between their marks
"""
import json
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "bench/results"


class Figures:
    """The rows of all results by name."""

    def __init__(self, folder):
        self.rows = {}
        self.reports = {}
        for file in sorted(folder.glob("*.json")):
            report = json.loads(file.read_text())
            self.reports[file.stem] = report
            for row in report["rows"]:
                self.rows[row["name"]] = dict(row, file=file.stem)

    def get(self, name, member="p50"):
        """A figure, or None when it was not measured."""
        return self.rows.get(name, {}).get(member)

    def steady(self, *names):
        """None of these rows, which are there, has halves that differ."""
        return not any(self.rows.get(name, {}).get("flagged") for name in names)

    def text(self, name, pattern="{:.2f}", member="p50"):
        value = self.get(name, member)
        if value is None:
            return "not measured"
        return pattern.format(value) + (" (unsteady)" if self.rows[name].get("flagged") else "")

    def machine(self, stem):
        """What measured it, on what, and the command as it was given; where it wrote to is nobody's business."""
        report = self.reports[stem]
        command = re.sub(r" --json \S+", "", report.get("command", ""))
        return (f"{report['machine']['cpu']}, {report['machine']['cores']} cores, load {report['machine']['load']:.1f} beside it, "
                f"revision {report['git']}" + (f", `{command}`" if command else ""))


def judged(value, first, goal, smaller_is_better=True, steady=True):
    """In words: goal reached, first aim reached, or not; nothing is judged when the machine was unsteady."""
    if value is None:
        return "not measured"
    if not steady:
        return "not judged: unsteady, measure again"
    better = (lambda a, b: a <= b) if smaller_is_better else (lambda a, b: a >= b)
    if better(value, goal):
        return "reaches the goal"
    if better(value, first):
        return "reaches the first aim, not the goal"
    return "FALLS SHORT of the first aim"


def row(what, peer, measured, aims, verdict, command):
    return f"| {what} | {peer} | {measured} | {aims} | {verdict} | `{command}` |"


def growth(figures, varied):
    """Greatest departure of the CPU's growth from a straight line, %."""
    return figures.get(f"load/{varied}/cpu_off_a_line", "max")


def speed_rows(figures):
    frangi = figures.get("frangi/400x600/4scales/full", "speedup")
    yield row("Frangi, 400 x 600 px, 4 scales", "OpenCV, three `sepFilter2D` a scale",
              f"{figures.text('frangi/400x600/4scales/full')} ms for "
              f"{figures.text('frangi/400x600/4scales/full', member='peer_p50')}: "
              + (f"{frangi:.1f} times faster" if frangi else "not measured"),
              "4; 7 (AVX2), 10 (AVX-512)", judged(frangi, 4, 10, False), "./run bench stages --only frangi")
    solve = figures.get("solve/26/coils_and_lines/ceres-sparse-cholesky", "speedup")
    yield row("Gauss-Newton of coils and lines", "`ceres::Solve`, same residuals, automatic derivatives, sparse Cholesky",
              f"{figures.text('solve/26/coils_and_lines/ceres-sparse-cholesky', '{:.3f}')} ms for "
              f"{figures.text('solve/26/coils_and_lines/ceres-sparse-cholesky', '{:.3f}', 'peer_p50')}: "
              + (f"{solve:.1f} times faster" if solve else "not measured"),
              "15; 80", judged(solve, 15, 80, False), "./run bench stages --only solve")
    yield row("an instant until its estimate leaves: likelihood, solves, covariance", "mode `paper`; the paper says 20 ms",
              f"{figures.text('instant/filter')} ms for {figures.text('instant/filter', '{:.0f}', 'peer_p50')}",
              "", "", "./run bench stages --only instant")
    written = figures.get("end_to_end/30/written")
    ratio = figures.get("end_to_end/30/written", "speedup")
    yield row("exposure to `dds_write` returned, p50, one core", "the paper's loop in one thread; the paper says 70 ms",
              f"{figures.text('end_to_end/30/written')} ms for {figures.text('end_to_end/30/written', '{:.0f}', 'peer_p50')}: "
              + (f"ratio {ratio:.0f}, to the paper's own 70 ms {70 / written:.0f}" if written and ratio else "not measured"),
              "7 ms; 2.4 ms", judged(written, 7, 2.4, steady=figures.steady("end_to_end/30/written")),
              "./run bench end_to_end")
    shape = figures.get("end_to_end/30/cpu_a_shape", "speedup")
    yield row("CPU time of a shape, everything included", "the paper's loop",
              f"{figures.text('end_to_end/30/cpu_a_shape')} ms for "
              f"{figures.text('end_to_end/30/cpu_a_shape', '{:.0f}', 'peer_p50')}"
              + (f": {shape:.0f} times less" if shape else ""), "", "", "./run bench end_to_end")
    udp = figures.get("publish/udp/30/1", "ratio_p50")
    yield row("publish to a DDS subscriber, p50 at 30 Hz", "bare Cyclone writer, same type",
              f"{figures.text('publish/udp/30/1', '{:.0f}')} us for {figures.text('publish/udp/30/1', '{:.0f}', 'peer_p50')}: "
              + (f"{udp:.2f} times" if udp else "not measured"), "1.3; 1.05", judged(udp, 1.3, 1.05, steady=figures.steady("publish/udp/30/1", "publish/cyclone-udp/30/1")), "./run bench publish")
    shm = figures.get("publish/shm/30/1", "ratio_p50")
    yield row("shared memory, one way, p50 at 30 Hz", "Cyclone's shared memory, loans and listener",
              f"{figures.text('publish/shm/30/1', '{:.0f}')} us for {figures.text('publish/shm/30/1', '{:.0f}', 'peer_p50')}: "
              + (f"{shm:.2f} times" if shm else "not measured"), "0.75; 0.55", judged(shm, 0.75, 0.55, steady=figures.steady("publish/shm/30/1", "publish/cyclone-shm-loan/30/1")),
              "./run bench publish")
    cpu = figures.get("end_to_end/30/cpu")
    yield row("CPU at 30 Hz, share of one core", "", f"{figures.text('end_to_end/30/cpu', '{:.0f}')} %", "25; 10 %",
              judged(cpu, 25, 10), "./run bench end_to_end")
    hot = [figures.get(f"soak/allocations/{stage}") for stage in ("em", "grab-A", "frangi-A", "optimizer")]
    most = None if None in hot else max(hot)
    yield row("allocations in acquisition, grab, Frangi, optimizer after start", "",
              "not measured" if most is None else f"{most:.0f}", "0; 0", judged(most, 0, 0), "./run bench soak")
    resident = figures.get("end_to_end/30/resident")
    yield row("resident memory", "", f"{figures.text('end_to_end/30/resident', '{:.0f}')} MB", "60; 40 MB",
              judged(resident, 60, 40), "./run bench end_to_end")
    for varied, words in (("megapixels", "pixels"), ("coefficients", "coefficients, 20 to 48 (the most there are)"),
                          ("instruments", "instruments"), ("subscribers", "subscribers")):
        off = growth(figures, varied)
        yield row(f"growth of CPU with {words}: off a straight line", "", "not measured" if off is None else f"{off:.0f} %",
                  "10 %", judged(off, 10, 10), f"./run bench load --only {varied}")
    one, two = (figures.get(f"load/instruments/{n}/written_last_instrument") for n in (1, 2))
    second = None if one is None or two is None else two - one
    yield row("the second instrument costs", "", "not measured" if second is None else f"{second:.1f} ms", "1 ms",
              judged(second, 1, 1), "./run bench load --only instruments")


def speed_table(figures):
    lines = ["| what | peer in the same run | measured | first aim; goal | | command |", "|---|---|---|---|---|---|"]
    lines += list(speed_rows(figures))
    if "end_to_end" in figures.reports:
        lines += ["", "\"unsteady\": the two halves of the run differ by more than 15 %. Measured on " +
                  "; ".join(f"`{stem}`: {figures.machine(stem)}" for stem in
                            ("end_to_end", "publish", "stages", "load", "soak") if stem in figures.reports) + "."]
    return "\n".join(lines)


def latency_table(figures):
    """Stage by stage at 30 Hz."""
    rows = [("from the exposure until `dds_write` has returned", "written"), ("... until a subscriber has it, DDS over UDP", "udp"),
            ("... until a reader has it, shared memory", "shm"),
            ("of that: image from the grabber's process to the daemon", "stage/grab"), ("of that: Frangi, 4 scales", "stage/frangi"),
            ("of that: optimizer", "stage/optimizer"), ("of that: `dds_write`", "stage/dds_write")]
    lines = ["| ms, 400 x 600 px at 30 Hz | p50 | p99 |", "|---|---|---|"]
    for words, name in rows:
        lines.append(f"| {words} | {figures.text(f'end_to_end/30/{name}')} | {figures.text(f'end_to_end/30/{name}', member='p99')} |")
    lines.append(f"| beside it, the paper's loop in one thread: until `dds_write` has returned | "
                 f"{figures.text('end_to_end/30/paper-loop/written', '{:.0f}')} | "
                 f"{figures.text('end_to_end/30/paper-loop/written', '{:.0f}', 'p99')} |")
    if "end_to_end" in figures.reports:
        lines += ["", f"{figures.machine('end_to_end')}."]
    return "\n".join(lines)


# Simulated presets: what they are, the first aim for the RMS of `filter`.
PRESETS = (("paper", "noise drawn anew at each measurement, 4 mm and 3 deg: the paper's simulation", 0.9),
           ("field", "a field warped smoothly by 4 mm and 3 deg, which stays", 1.3),
           ("frozen", "an error of 4 mm and 3 deg drawn once for each coil, which stays", 1.5),
           ("biplane", "warped field, a second view with every sixth exposure", 0.7),
           ("clinical", "warped field, coils that drop out and lie, second wire, contrast agent, collimator, fluoroscopy on and off", None))


def middle(values):
    """Median of a list; None of an empty one."""
    ordered = sorted(values)
    half = len(ordered) // 2
    return None if not ordered else ordered[half] if len(ordered) % 2 else (ordered[half - 1] + ordered[half]) / 2


def over_seeds(figures, preset, method, metric, member="p50"):
    """That figure of each run of a preset, by the name of the run."""
    pattern = re.compile(rf"accuracy/({preset}-\d+)/{method}/{metric}$")
    return {found.group(1): row.get(member) for name, row in figures.rows.items() if (found := pattern.match(name))}


def of_seeds(figures, preset, method, metric, member="p50", spread=False):
    """Median of the runs, and their least and greatest, in words."""
    values = [value for value in over_seeds(figures, preset, method, metric, member).values() if value is not None]
    if not values:
        return "-"
    text = f"{middle(values):.2f}"
    return f"{text} ({min(values):.2f} .. {max(values):.2f})" if spread and len(values) > 1 else text


def steps_of(command):
    """How often a run of the accuracy bench measured, in words."""
    every = re.search(r"--every[ =](\d+)", command)
    return "every step (337 and more, 7.5 a second)" if every is None or every.group(1) == "1" else f"one of {every.group(1)} steps"


def accuracy_table(figures):
    """Presets in rows; RMS by mode, and the rest of the default mode."""
    if "accuracy" not in figures.reports:
        return "Not measured."
    runs = sorted({found.group(1) for name in figures.rows if (found := re.match(r"accuracy/[a-z]+-(\d+)/", name))})
    lines = ["| run | RMS `em` | `paper` | **`filter`** | aim | x, y, z of `filter` | Hausdorff | 95 % of instants below | within 1/2/3 sigma |",
             "|---|---|---|---|---|---|---|---|---|"]
    for preset, words, aim in PRESETS:
        rms = middle(list(over_seeds(figures, preset, "filter", "RMS/in_view").values()))
        sigma = [shares for shares in over_seeds(figures, preset, "filter", "within_sigma", "values").values() if shares]
        within = "/".join(f"{100 * middle([shares[k] for shares in sigma]):.0f}" for k in range(3)) if sigma else "-"
        verdict = "" if aim is None or rms is None else f"{aim} " + ("reached" if rms <= aim else "NOT reached")
        lines.append(
            f"| `{preset}`: {words} | {of_seeds(figures, preset, 'em', 'RMS/in_view')} | {of_seeds(figures, preset, 'paper', 'RMS/in_view')} | "
            f"**{of_seeds(figures, preset, 'filter', 'RMS/in_view', spread=True)}** | {verdict} | "
            + ", ".join(of_seeds(figures, preset, "filter", f"{axis} RMS/in_view") for axis in "xyz")
            + f" | {of_seeds(figures, preset, 'filter', 'Hausdorff/in_view')} | {of_seeds(figures, preset, 'filter', 'RMS/in_view', 'p95')} | {within} |")
    lines += ["| the paper's own figures (its Table 1) | 2.8 | 2.0 | | | 0.2, 0.2, | | | |", "",
              f"Everything simulated, {steps_of(figures.reports['accuracy']['command'])}, mm, points in the image, closest-point distances; each figure is the median over instants, then over "
              f"{len(runs)} runs (seeds {', '.join(runs)}, none of them used while tuning), in brackets the best and the worst run. Modes are those of "
              f"`[estimator] mode`; `filter` is the default, `em` never sees an image. "
              f"`{figures.reports['accuracy']['command']}`, "
              f"then its `accuracy.json` to `bench/results/`; revision {figures.reports['accuracy']['git']}."]
    return "\n".join(lines)


FRANGI_ROWS = (  # row of results, in words
    ("400x600/4scales/full", "400 x 600, 4 scales (1, 1.5, 2, 3 px), AVX-512"),
    ("400x600/4scales/full/AVX2", "the same with AVX2"),
    ("400x600/4scales/full/SSE4", "with SSE4"),
    ("400x600/4scales/full/SCALAR", "without any"),
    ("400x600/4scales/full/c20", "c configured (`structureness = 20`): one pass instead of two"),
    ("400x600/4scales/full/int16", "16-bit smoothing"),
    ("400x600/4scales/full/int16/c20", "16-bit smoothing, c configured"),
    ("400x600/1scales/full", "1 scale (2 px)"),
    ("400x600/4scales/band/beside", "band of 16 px to either side of a tube, in tiles 64 px wide"),
    ("64x64/4scales/full", "64 x 64"),
    ("1024x1024/4scales/full/beside", "1024 x 1024, a power of two, beside its neighbour"),
    ("2048x2048/4scales/full", "2048 x 2048"))


def frangi_table(figures):
    """Sizes, registers and options of the Frangi filter beside OpenCV, or the row that is named."""
    lines = ["| Frangi, 8-bit image | ms | ns a pixel | peer, ms | times faster | peer |", "|---|---|---|---|---|---|"]
    for name, words in FRANGI_ROWS:
        row = figures.rows.get(f"frangi/{name}")
        if row is None:
            lines.append(f"| {words} | not measured | | | | |")
            continue
        share = f": {100 * row['pixels'] / 240000:.0f} % of the pixels" if "/band/" in name else ""
        lines.append(f"| {words}{share} | {row['p50']:#.3g} | {row['ns_per_px']:.1f} | {row['peer_p50']:.3g} | {row['speedup']:.1f} | "
                     f"{'OpenCV' if row['peer'].startswith('opencv') else row['peer'].removeprefix('frangi/')} |")
    return "\n".join([*lines, "", f"{figures.machine('stages')}."])


def solver_table(figures):
    """Gauss-Newton on coils and lines beside both ways that Ceres has to solve it."""
    lines = ["| coefficients | ms | Ceres, sparse Cholesky | Ceres, dense Cholesky | sum of squares above Ceres' |", "|---|---|---|---|---|"]
    for count in (26, 48):
        sparse, dense = (figures.rows.get(f"solve/{count}/coils_and_lines/ceres-{kind}-cholesky") for kind in ("sparse", "dense"))
        if sparse is None or dense is None:
            lines.append(f"| {count} | not measured | | | |")
            continue
        lines.append(f"| {count} | {sparse['p50']:.3f} | {sparse['peer_p50']:.2f} ({sparse['speedup']:.1f} times) | "
                     f"{dense['peer_p50']:.2f} ({dense['speedup']:.1f} times) | {sparse['cost_above_ceres']:.1e} of it |")
    return "\n".join([*lines, "", f"{figures.machine('stages')}."])


def put_between_marks(file, mark, text):
    before = file.read_text()
    pattern = re.compile(rf"(<!-- {mark}[^\n]*-->\n).*?(<!-- end of {mark} -->)", re.S)
    after, count = pattern.subn(lambda found: found.group(1) + text + "\n" + found.group(2), before)
    if count != 1:
        sys.exit(f"speed_table.py: {file} has {count} places marked '{mark}', expected one")
    file.write_text(after)


def main():
    figures = Figures(RESULTS)
    tables = ((ROOT / "bench/README.md", "speed table", speed_table(figures)),
              (ROOT / "bench/README.md", "Frangi table", frangi_table(figures)),
              (ROOT / "bench/README.md", "solver table", solver_table(figures)),
              (ROOT / "README.md", "latency table", latency_table(figures)),
              (ROOT / "README.md", "accuracy table", accuracy_table(figures)))
    for file, mark, text in tables:
        if "--write" in sys.argv[1:]:
            put_between_marks(file, mark, text)
        else:
            print(text + "\n")


if __name__ == "__main__":
    try:
        main()
    except BrokenPipeError:  # whoever reads has seen enough
        pass
