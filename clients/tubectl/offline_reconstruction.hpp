// The pipeline's measurements and estimates without its threads: every instant of a sequence folder in turn.
#pragma once

#include <functional>
#include <vector>

#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// One instant of a sequence: all rows of frames.csv with the same t_s.
struct SequenceInstant {
  std::uint32_t frame = 0;  ///< number of the last of its rows
  double t_s = 0;
  std::vector<std::size_t> rows;  ///< indices in sequence.frames
};

/// The instants in order of time.
std::vector<SequenceInstant> instants_of(const Sequence& sequence);

/// Called after each instant with its estimate.
using OnEstimate = std::function<void(const SequenceInstant&, const TubeEstimate&)>;

/// Estimates every instant from what was measured until then: EM measurements with t <= t_s, the images of
/// the instant. Deterministic. Throws SequenceError for an image that cannot be read.
void reconstruct(const Sequence& sequence, const EstimatorSettings& settings, const FrangiSettings& frangi,
                 const OnEstimate& on_estimate);

}  // namespace tubed
