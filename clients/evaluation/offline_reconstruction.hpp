// The pipeline's measurements and estimates without its threads: every instant of a sequence folder in turn.
#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// One instant of a sequence: all rows of frames.csv with the same t_s.
struct SequenceInstant {
  std::uint32_t frame = 0;  ///< number of the last of its rows
  double t_s = 0;
  std::vector<std::size_t> rows;  ///< indices in sequence.frames
};

/// A time of the sequence as observations and estimates of it have it: never 0 ns, which means "never".
MonotonicTime sequence_time(double t_s);

/// The exposure of a row with an image, as a source delivers it. Throws SequenceError where it cannot be
/// read.
ImageFrame image_frame_of(const Sequence& sequence, const SequenceFrame& row);

/// The instants in order of time.
std::vector<SequenceInstant> instants_of(const Sequence& sequence);

/// Takes the estimates of an instant, so that the next images are measured where they will be read.
class AreaPredictions {
 public:
  virtual ~AreaPredictions() = default;
  virtual void add(const Estimator& estimator, const TubeEstimate& estimate) = 0;
};

/// What was known at an instant; the observation and what it points at change with the next one. False: that
/// was the last one wanted.
using OnObservation = std::function<bool(const SequenceInstant&, const Observation&, AreaPredictions&)>;

/// That of a configuration which says nothing of it.
inline constexpr std::chrono::milliseconds kUsualMaxImageTimeout{500};

enum class Images { kLeftOut, kMeasured };

/// Measures every instant in turn as the pipeline does: EM measurements with t <= t_s, the images of the
/// instant (none when not asked for) checked and filtered, where the estimates before say that they will be
/// read and where they are. Images are stale after two of their periods, at the latest after
/// `max_image_timeout`. Throws SequenceError for an image that cannot be read.
void observe_in_turn(const Sequence& sequence, Images images, const FrangiSettings& frangi,
                     const OnObservation& on_observation,
                     std::chrono::nanoseconds max_image_timeout = kUsualMaxImageTimeout);

/// Called after each instant with its estimate.
using OnEstimate = std::function<void(const SequenceInstant&, const TubeEstimate&)>;

/// Estimates every instant from what was measured until then. Deterministic. Throws as observe_in_turn().
void reconstruct(const Sequence& sequence, const EstimatorSettings& settings, const FrangiSettings& frangi,
                 const OnEstimate& on_estimate,
                 std::chrono::nanoseconds max_image_timeout = kUsualMaxImageTimeout);

}  // namespace tubed
