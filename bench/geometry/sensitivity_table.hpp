// How far each error of whoever sets a room up moves the shape.
#pragma once

#include <string>
#include <vector>

#include "bench/geometry/pooled_runs.hpp"

namespace tubed {

/// Mistakes of room_mistakes.hpp, one at a time and each in sizes that people make; "none" first.
std::vector<std::string> operator_errors();

/// A table in Markdown, `runs[i]` being those of `mistakes[i]`: median RMS in view and what it is more than
/// that of "none" (when it is among them), its least and greatest median of a seed, median error of the tip,
/// share VALID, shares misleading.
std::string sensitivity_table(const std::vector<std::string>& mistakes, const std::vector<PooledRuns>& runs);

}  // namespace tubed
