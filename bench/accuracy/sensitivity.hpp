// What the accuracy depends on: the coils of a sequence measured again from its truth, with one thing varied
// at a time. The images stay as they are.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bench/accuracy/method.hpp"
#include "bench/accuracy/plots.hpp"

namespace tubed {

/// How coils measure. The paper's Sec. 3.1 by default.
struct CoilStudy {
  std::vector<double> offsets_mm{10, 90, 170, 270, 370};
  double lambda_mm = 4;           ///< Eq. (19)
  double psi_rad = 0.0523598776;  ///< Eq. (20), 3 deg; about a random axis across the tangent
  unsigned seed = 1;
};

/// The sequence with its coils placed and measured anew at every frame that has a truth. Throws
/// std::runtime_error when it has none.
Sequence measured_again(const Sequence& sequence, const CoilStudy& study);

/// The same with T_world_em wrong by a translation of that length in a direction of the seed.
Sequence misregistered(Sequence sequence, double error_mm, unsigned seed);

/// Every `step`-th instant only.
Sequence thinned(const Sequence& sequence, std::size_t step);

/// Fluoroscopy of the cameras but the first in every `step`-th of their instants only; 0: never.
Sequence with_second_view_every(Sequence sequence, std::size_t step);

/// Told what is being run.
using OnStudy = std::function<void(const std::string& words)>;

/// The studies that the sequence allows and whose titles contain `wanted`, median RMS over points in view for
/// each method with images. Throws std::invalid_argument, naming them, when there is none.
std::vector<SensitivityPanel> study_sensitivity(const Sequence& sequence, const std::vector<Method>& methods,
                                                const ShapeErrorSettings& judged, const std::string& wanted,
                                                const std::filesystem::path& scratch,
                                                const OnStudy& on_study);

}  // namespace tubed
