// The patient in one view: line integrals for every pixel, cast once and kept.
#pragma once

#include <span>
#include <vector>

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"
#include "drivers/laboratory/fluoroscope/body_motion.hpp"
#include "drivers/laboratory/fluoroscope/pixel_rays.hpp"

namespace tubed {

/// Line integrals of a patient at rest and at the phases of his movements. A posture between two phases is
/// interpolated linearly; beat and breath add up. Used by one thread; allocates in the constructor only.
class ProjectedBody {
 public:
  ProjectedBody(const PixelRays& rays, const AttenuationVolume& volume, const MotionSettings& motion);

  /// At rest, one value a pixel, row by row.
  [[nodiscard]] std::span<const float> at_rest() const { return rest_; }
  /// At `posture`, into `integrals`.
  void at(const Posture& posture, std::span<float> integrals) const;

 private:
  void add_phase(const std::vector<std::vector<float>>& phases, float amount,
                 std::span<float> integrals) const;

  std::vector<float> rest_;
  std::vector<std::vector<float>> systole_;      ///< differences to rest, at 1/n, 2/n, ... 1 of the way
  std::vector<std::vector<float>> inspiration_;  ///< likewise
};

}  // namespace tubed
