"""Compares tubectl's statistics with scipy.stats on random, tied and zero-ridden samples.

Usage: statistics_against_scipy.py PROBE. Exit codes: 0 all agree, 1 a difference (printed), 77 scipy is missing.
"""

import json
import math
import subprocess
import sys
from itertools import product

try:
    import numpy as np
    from scipy import stats
except ImportError as missing:
    print(f"SKIPPED: {missing}. The comparison with scipy was NOT made; apt-get install python3-scipy", flush=True)
    sys.exit(77)

SEED = 20260101
BRUTE_FORCE_LIMIT = 12   # signs: 2^12 assignments, enumerated here without any cleverness
EXACT_LIMIT = 50
LONG_SAMPLE = 337   # the paper's count of simulation steps


def samples():
    """Named samples: sizes on both sides of every switch in the code, smooth and rounded (ties, zeros), shifted."""
    random = np.random.default_rng(SEED)
    sizes = [3, 4, 5, 6, 7, 9, 10, 11, 12, 13, 20, 25, 37, 49, 50, 51, 52, 80, 113, 337, 1000, 4999]
    for size in sizes:
        for shift in (0.0, 0.4, 2.0):
            for name, draw in (
                ("normal", random.normal(shift, 1, size)),
                ("lognormal", random.lognormal(0, 1, size) - 1 + shift),
                ("uniform", random.uniform(-1, 1, size) + shift),
                ("rounded", np.round(random.normal(shift, 1, size), 1)),
                ("coarse", np.round(random.normal(shift, 1, size))),
            ):
                yield f"{name} n={size} shift={shift}", draw


def brute_force_p(used):
    """Two-sided exact p given the mid-ranks, every sign assignment looked at."""
    ranks = stats.rankdata(np.abs(used))
    observed = min(ranks[used > 0].sum(), ranks[used < 0].sum())
    total = ranks.sum()
    sums = [sum(rank for rank, sign in zip(ranks, signs) if sign) for signs in product((0, 1), repeat=len(ranks))]
    extreme = sum(min(s, total - s) <= observed + 1e-9 for s in sums)
    return extreme / len(sums)


def expected_wilcoxon_p(sample):
    """(p, where from); None where neither scipy nor enumeration has the exact answer."""
    used = sample[sample != 0]
    if len(used) == 0:
        return 1.0, "nothing left"
    has_ties = len(np.unique(np.abs(used))) < len(used)
    if len(used) > EXACT_LIMIT:
        return stats.wilcoxon(used, mode="approx", correction=False).pvalue, "scipy approx"
    if not has_ties:
        return stats.wilcoxon(used, mode="exact").pvalue, "scipy exact"
    if len(used) <= BRUTE_FORCE_LIMIT:
        return brute_force_p(used), "enumeration"
    return None, "none"


class Comparison:
    def __init__(self):
        self.failures = []
        self.counts = {}

    def check(self, what, sample_name, ours, theirs, relative, absolute):
        self.counts[what] = self.counts.get(what, 0) + 1
        if not math.isclose(ours, theirs, rel_tol=relative, abs_tol=absolute):
            self.failures.append(f"{sample_name}: {what}: ours {ours!r}, theirs {theirs!r}")


def compare(comparison, name, sample, ours):
    comparison.check("median", name, ours["median"], np.median(sample), 1e-13, 1e-14)
    comparison.check("iqr", name, ours["iqr"], stats.iqr(sample), 1e-13, 1e-14)

    used = sample[sample != 0]
    ranks = stats.rankdata(np.abs(used))
    comparison.check("rank sum", name, ours["rank_sum_positive"], ranks[used > 0].sum(), 0, 1e-9)
    if len(used):
        effect = (ranks[used > 0].sum() - ranks[used < 0].sum()) / ranks.sum()
        comparison.check("rank-biserial", name, ours["rank_biserial"], effect, 1e-12, 1e-14)
    method = "exact" if len(used) <= EXACT_LIMIT else "normal approximation"
    if ours["wilcoxon_method"] != method:
        comparison.failures.append(f"{name}: method {ours['wilcoxon_method']}, expected {method}")
    p, source = expected_wilcoxon_p(sample)
    if p is not None:
        comparison.check(f"wilcoxon p ({source})", name, ours["wilcoxon_p"], p, 1e-9, 1e-300)

    if np.ptp(sample) > 0:
        # scipy up to 1.10 sums W in single precision, and 1 - W, which p lives on, is small: the longer the sample, the
        # fewer digits are left to compare.
        long = len(sample) > LONG_SAMPLE
        w, shapiro_p = stats.shapiro(sample)
        comparison.check("shapiro W", name, ours["shapiro_w"], w, 0, 5e-5 if long else 1e-5)
        comparison.check("shapiro p", name, ours["shapiro_p"], shapiro_p, 0.2 if long else 2e-3, 1e-6)


def main():
    named = list(samples())
    request = json.dumps({"samples": [sample.tolist() for _, sample in named]})
    done = subprocess.run([sys.argv[1]], input=request, capture_output=True, text=True, check=True)
    answers = json.loads(done.stdout)
    comparison = Comparison()
    for (name, sample), ours in zip(named, answers, strict=True):
        compare(comparison, name, sample, ours)
    for what, count in sorted(comparison.counts.items()):
        print(f"{what}: {count} compared")
    for failure in comparison.failures:
        print("DIFFERS", failure)
    return 1 if comparison.failures else 0


if __name__ == "__main__":
    sys.exit(main())
