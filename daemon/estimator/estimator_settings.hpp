// What can be set about an estimator, and the keys of [estimator]. Whitened weights as in
// daemon/estimator/README.md; units in the names.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/estimator/coils/coil_fault_model.hpp"
#include "daemon/estimator/paper/paper_settings.hpp"
#include "daemon/image/image_likelihood_form.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

enum class EstimatorMode {
  kEm,      ///< EM coils only: weighted MAP of Eq. (14)
  kPaper,   ///< the method of Tran et al. as printed where it can be: for comparison
  kJoint,   ///< EM and image lines in one MAP a frame
  kFilter,  ///< recursive: what was known before, moved on, with EM and image lines of now
};

/// A mode as configuration, command lines, benchmarks and tests know it.
struct EstimatorModeRow {
  EstimatorMode mode;
  std::string_view name;
  std::string_view meaning;  ///< for a person
  bool needs_camera;  ///< images are half of it: without a camera it would be EM alone under another name
  bool is_for_comparison;  ///< not offered for what a room is run with
  /// What it is compared with as its EM alone: another mode, or "<name>-em", itself with images withheld.
  std::string_view em_alone;
};

/// All modes, in the order in which they are listed. A new one is a row here, a line in make_estimator.cpp
/// and its own source.
inline constexpr std::array kEstimatorModes{
    EstimatorModeRow{EstimatorMode::kEm, "em", "coils only", false, false, ""},
    EstimatorModeRow{EstimatorMode::kPaper, "paper", "as published, for comparison", true, true, "paper-em"},
    EstimatorModeRow{EstimatorMode::kJoint, "joint", "coils and images of one instant", true, false, "em"},
    EstimatorModeRow{EstimatorMode::kFilter, "filter", "with what was known before", false, false,
                     "filter-em"}};

static_assert(std::all_of(kEstimatorModes.begin(), kEstimatorModes.end(),
                          [](const EstimatorModeRow& row) {
                            return &row - kEstimatorModes.data() == static_cast<int>(row.mode);
                          }),
              "rows in the order of the enumeration");

/// The row of a mode.
constexpr const EstimatorModeRow& row_of(EstimatorMode mode) {
  return kEstimatorModes.at(static_cast<std::size_t>(mode));
}

constexpr std::string_view name_of(EstimatorMode mode) { return row_of(mode).name; }

/// The mode of that name; nothing for another word.
constexpr std::optional<EstimatorMode> mode_named(std::string_view name) {
  for (const EstimatorModeRow& row : kEstimatorModes) {
    if (row.name == name) {
      return row.mode;
    }
  }
  return std::nullopt;
}

/// The names of all modes, or of those that a room may be run with.
enum class ModeUse { kAny, kRoom };
inline std::vector<std::string> mode_names(ModeUse use = ModeUse::kAny) {
  std::vector<std::string> names;
  for (const EstimatorModeRow& row : kEstimatorModes) {
    if (use == ModeUse::kAny || !row.is_for_comparison) {
      names.emplace_back(row.name);
    }
  }
  return names;
}

/// "em: coils only; paper: ...": what the modes mean, for a person.
inline std::string mode_meanings() {
  std::string text;
  for (const EstimatorModeRow& row : kEstimatorModes) {
    text += (text.empty() ? "" : "; ") + std::string(row.name) + ": " + std::string(row.meaning);
  }
  return text;
}

struct EstimatorSettings {
  EstimatorMode mode = EstimatorMode::kFilter;
  int coefficient_count = 26;           ///< of the B-spline, 8 .. 48
  double sigma_position_mm = 2.31;      ///< of one coil, an axis: 4 mm amplitude / sqrt(3), Eq. (19)
  double sigma_tangent = 0.030;         ///< of one coil's unit tangent, an axis: 3 deg, Eq. (20)
  double sigma_strain_sqrt_mm = 0.022;  ///< of (|zeta'| - 1) over 1 mm of arc length
  double bending_q_per_mm = 7e-4;       ///< expected curvature density: sigma^2 of zeta'' times mm
  ImageLikelihoodForm image_likelihood = ImageLikelihoodForm::kVesselness;  ///< of modes "joint" and "filter"
  double sigma_image_px = 0.5;  ///< of one correspondence line's offset, beside its own variance
  double image_search_px = 14;  ///< half length of the correspondence lines
  double image_temper = 6;      ///< pixels are not independent: variance of the image is multiplied by this
  double em_stale_ms = 150;     ///< EM_STALE is said by this age of the newest EM measurement: see EmTimeout
  double em_stuck_ms = 150;     ///< bit-equal values for as long are EM_STUCK
  int iterations = 8;           ///< at most, of Gauss-Newton
  CoilFaultModel coil_faults;   ///< of modes "em", "joint" and "filter"
  PaperSettings paper;          ///< of mode "paper" alone
};

/// "mode", of [estimator] or of one instrument.
inline BoundKey<EstimatorSettings> mode_key(std::string meaning = mode_meanings()) {
  std::vector<NamedValue<EstimatorMode>> modes;
  for (const EstimatorModeRow& row : kEstimatorModes) {
    modes.push_back({row.mode, row.name});
  }
  return key::word("mode", &EstimatorSettings::mode, std::move(modes), std::move(meaning));
}

/// The keys of [estimator], those of [estimator.paper] aside.
inline BoundKeys<EstimatorSettings> estimator_keys() {
  using S = EstimatorSettings;
  const KeyRange age_ms{20, 5000};
  return {
      mode_key(),
      key::number("coefficient_count", &S::coefficient_count, "", {8, 48}, "coefficients of the B-spline"),
      key::number("sigma_position_mm", &S::sigma_position_mm, "mm", {0.01, 50},
                  "standard deviation of a coil's position, an axis"),
      key::number("sigma_tangent", &S::sigma_tangent, "", {0.0005, 1},
                  "standard deviation of a coil's unit tangent, an axis"),
      key::number("sigma_strain_sqrt_mm", &S::sigma_strain_sqrt_mm, "sqrt(mm)", {1e-4, 1},
                  "standard deviation of the strain over 1 mm of arc length"),
      key::number("bending_q_per_mm", &S::bending_q_per_mm, "1/mm", {1e-8, 1},
                  "expected squared curvature times mm"),
      key::word("image_likelihood", &S::image_likelihood,
                {kImageLikelihoodForms.begin(), kImageLikelihoodForms.end()},
                "what speaks for the tube in an image: ridges; histograms of grey value and vesselness; "
                "those over all pixels near it"),
      key::number("sigma_image_px", &S::sigma_image_px, "px", {0.05, 20},
                  "standard deviation of a correspondence line's offset, beside its own"),
      key::number("image_search_px", &S::image_search_px, "px", {2, 24},
                  "half length of the correspondence lines"),
      key::number("image_temper", &S::image_temper, "", {1, 1000},
                  "the images' variance is multiplied by this: pixels are not independent"),
      key::number("em_stale_ms", &S::em_stale_ms, "ms", age_ms,
                  "EM_STALE when two EM measurements in a row are missing, at the latest after this"),
      key::number("em_stuck_ms", &S::em_stuck_ms, "ms", age_ms,
                  "bit-equal measurements for so long mean EM_STUCK"),
      key::number("iterations", &S::iterations, "", {1, 50}, "Gauss-Newton iterations, at most")};
}

}  // namespace tubed
