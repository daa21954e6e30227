// The ways of estimating that are compared, and one of them run over a whole sequence.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/evaluation/evaluation.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

/// One line of the tables.
struct Method {
  std::string name;  ///< "filter"; "filter-em" without images
  EstimatorSettings settings;
  bool images_withheld = false;  ///< the same estimator with fluoroscopy off throughout
};

/// The methods of these modes, EM alone before EM and images: em | paper-em, paper | joint | filter-em,
/// filter. Throws std::invalid_argument for a mode there is none of.
std::vector<Method> methods_of(const std::vector<std::string>& modes, const EstimatorSettings& settings);

/// Which of them are compared as the two groups of the paper's Table 1: {EM alone, EM and images}.
struct ComparedPair {
  std::size_t em;
  std::size_t fused;
};
std::vector<ComparedPair> pairs_among(const std::vector<Method>& methods);

/// The sequence as the method gets it: without its images where they are withheld.
Sequence as_given(const Sequence& sequence, const Method& method);

/// One method over one sequence.
struct MethodRun {
  MethodEvaluation all;
  MethodEvaluation in_view;
  std::vector<double> solve_ms;  ///< an instant, wall clock: reading, Frangi and estimating together
};

/// Told of each instant done.
using OnInstant = std::function<void(std::size_t done, std::size_t total)>;

/// Estimates every instant into the file `csv` (as `tubectl reconstruct`) and judges what stands there.
MethodRun run_method(const Sequence& sequence, const Method& method, const ShapeErrorSettings& judged,
                     const std::filesystem::path& csv, const OnInstant& on_instant);

}  // namespace tubed
