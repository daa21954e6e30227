// Pre-shaped tips: simulated catheters with a hook, reconstructed with and without knowing of it.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "clients/evaluation/evaluation.hpp"
#include "clients/evaluation/simulated_run.hpp"

namespace tubed {

/// The catheter that is simulated.
struct TipCase {
  std::string preset = "preshaped";
  double hook_radius_mm = 8;           ///< 0: a straight tip
  double tip_coil_mm = 10;             ///< from the tip to the first coil
  int second_view_every = 0;           ///< 0: one view
  std::vector<double> hook_arcs_mm{};  ///< instead of the hook: as RestCurve::from_pairs() takes them
};

/// What the estimator is told of the rest shape.
enum class ToldTip {
  kNothing,   ///< rest_shape left out
  kAsItIs,    ///< a hook of the right radius and length, or a straight tip
  kStraight,  ///< a straight tip
  kHook,      ///< a hook of 8 mm, whatever it is
};

/// One run of one seed.
struct TipOutcome {
  std::vector<double> tip_mm;                   ///< error of the tip at each instant judged
  std::size_t valid = 0;                        ///< of those
  std::size_t valid_beyond_3_sigma = 0;         ///< VALID, and the tip off by more than 3 sigma on an axis
  std::size_t valid_beyond_3_sigma_and_mm = 0;  ///< and by more than 3 mm
  std::size_t beyond_3_sigma = 0;               ///< of all
  std::vector<double> rms_in_view_mm;
  std::vector<double> em_rms_in_view_mm;  ///< of coils alone
  std::map<std::string, std::size_t> reasons;
  double cpu_s = 0;  ///< of the reconstruction, images and all
};

/// Throws in words for a catheter that cannot be simulated.
void check_tip(const TipCase& simulated, std::int64_t seed);

/// Instants judged: those whose tip is in view of the first camera. Sequence folders are written into
/// `folder`, and taken from there where they are already.
TipOutcome run_tip(const TipCase& simulated, ToldTip told, std::int64_t seed, int every,
                   const std::filesystem::path& folder);

}  // namespace tubed
