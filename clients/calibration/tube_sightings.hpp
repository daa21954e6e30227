// Where images show the tube beside its coils, and where it ends: what a clock is compared by.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "clients/evaluation/configured_sequence.hpp"

namespace tubed {

/// One place that one image shows: the tube across itself beside a coil, or its end along itself.
struct TubeSighting {
  double t_s = 0;         ///< the image's stamp, nothing taken off
  std::size_t frame = 0;  ///< index in sequence.frames
  std::size_t coil = 0;   ///< of the instrument, beside which it was seen; 0 for the end
  bool is_end = false;    ///< the tube's end, not its middle beside the coil
  Eigen::Vector2d p_image_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d direction = Eigen::Vector2d::UnitX();  ///< unit: along it the place is known
};

/// How the images are read.
struct SightingSearch {
  int camera = 0;       ///< index in room.cameras
  double offset_s = 0;  ///< what the images' stamps are taken to be late by
  int reach_px = 24;    ///< of the lines to either side of where coils have the tube
};

/// Lines are laid across the tube as the coils of the instant `stamp - offset_s` have it (mode "em"), and
/// searched as the estimator does; the end is looked for along what they found. A coil is seen where at least
/// half of the lines within 6 mm agree. Ordered by time. Throws SequenceError for an image that cannot be
/// read.
std::vector<TubeSighting> sight_tube(const ConfiguredSequence& run, const SightingSearch& search);

}  // namespace tubed
