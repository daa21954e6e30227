// The figures of the second experiment over all draws, beside the paper's Table 1, right half.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <vector>

#include "bench/accuracy/bench_experiment.hpp"

namespace tubed {

/// Tables in Markdown. Errors: of each draw the median over its positions; of these the median, least and
/// greatest. Pairs: improvement, p of Wilcoxon's test with the positions of one draw (exact; five pairs: at
/// least 0.0625, and 0.31 by Bonferroni for five metrics) and with the medians of all draws, effect size.
void print_bench(const std::vector<BenchDraw>& draws, const std::vector<Method>& methods, std::ostream& out);

/// Rows "accuracy/bench/<method>/<metric>", over draws, and what was drawn: "accuracy/bench/markers/..",
/// "accuracy/bench/coils/..", "accuracy/bench/truth".
nlohmann::json bench_rows(const std::vector<BenchDraw>& draws, const std::vector<Method>& methods);

}  // namespace tubed
