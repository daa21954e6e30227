// The runs of one preset and mistake over all seeds, pooled: a line of the tables.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/geometry/study.hpp"

namespace tubed {

struct PooledRuns {
  std::size_t due = 0;
  std::size_t valid = 0;
  std::vector<double> rms_mm;         ///< of the instants with a shape in view
  std::vector<double> tip_mm;         ///< how far the tip is off, at these instants
  std::vector<double> median_rms_mm;  ///< of rms_mm, one a seed that has any
  MisleadingCount of_valid;
  MisleadingCount of_all;
  SigmaCoverage coverage;
  std::vector<std::optional<double>> first_s;  ///< one a seed
  Reasons first_reasons;
  std::size_t doubted = 0;
  std::map<std::string, std::size_t> reasons;

  /// One seed more.
  void add(const MistakeRuns::Outcome& outcome, const Said& said);
};

/// 100 part / whole; 0 of nothing.
double percent(std::size_t part, std::size_t whole);

}  // namespace tubed
