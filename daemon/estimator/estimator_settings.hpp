// What can be set about an estimator. Whitened weights as in daemon/estimator/README.md; units in the names.
#pragma once

#include <optional>
#include <string_view>

#include "daemon/estimator/paper_settings.hpp"
#include "daemon/image/image_likelihood_form.hpp"

namespace tubed {

enum class EstimatorMode {
  kEm,      ///< EM coils only: weighted MAP of Eq. (14)
  kPaper,   ///< the method of Tran et al. as printed where it can be: for comparison
  kJoint,   ///< EM and image lines in one MAP a frame
  kFilter,  ///< recursive: what was known before, moved on, with EM and image lines of now
};

std::string_view name_of(EstimatorMode mode);

/// The mode of that name, "em", "paper", "joint" or "filter"; nothing for another word.
std::optional<EstimatorMode> mode_named(std::string_view name);

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
  double em_stale_ms = 150;     ///< EM_STALE is said by this age of the newest EM measurement: see EmPatience
  double em_stuck_ms = 150;     ///< bit-equal values for as long are EM_STUCK
  int iterations = 8;           ///< at most, of Gauss-Newton
  PaperSettings paper;          ///< of mode "paper" alone
};

}  // namespace tubed
