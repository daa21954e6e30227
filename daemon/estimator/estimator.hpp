// The seam between the pipeline and a way of estimating the tube. One object an instrument.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>

#include "daemon/estimator/coils/em_history.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/image/background_motion.hpp"
#include "daemon/image/image_measurement.hpp"
#include "drivers/interface/room.hpp"
#include "idl/estimate.hpp"

namespace tubed {

class ImageOnDemand;
class RestHook;

/// An image of a view that is not, or may not be, where its pose says, and what its watch says of that
/// (ViewVerdict).
struct MovedImage {
  ImageMeasurement* image = nullptr;  ///< kMeasured, with the geometry that no longer holds; nullptr: none
  ImageOnDemand* on_demand = nullptr;
  std::uint32_t moves = 0;
  bool has_settled = false;
  bool is_suspect_here = false;
  BackgroundMotion motion;
};

/// All that is known when a shape is due.
struct Observation {
  MonotonicTime instant{};        ///< the moment the shape is asked for: mid exposure, or the tick
  MonotonicTime now{};            ///< the moment of asking, for ages
  bool is_image_instant = false;  ///< an exposure (or an announced instant without radiation) is the reason
  const EmHistory* em = nullptr;  ///< never nullptr
  /// Per camera the image of this very instant; nullptr where there is none. Not const, because an estimator
  /// may filter more of it: ImageOnDemand::filter_missing(), which takes it by name, is all that changes it.
  std::array<ImageMeasurement*, kMaxCameras> images{};
  /// Of each image where not everything is measured: what filters more of it. nullptr where nothing does;
  /// what is not measured then is not in view.
  std::array<ImageOnDemand*, kMaxCameras> on_demand{};
  /// Per camera the image of this very instant that is left out of `images` because the view moved.
  std::array<MovedImage, kMaxCameras> moved{};
  /// Newest instant at which any camera delivered pixels that were measured; zero = never.
  MonotonicTime newest_image{};
  /// Images older than this are stale.
  std::chrono::nanoseconds image_timeout{0};
  bool fluoroscopy_off = false;  ///< the newest word of the image sources: no radiation
  bool image_rejected = false;   ///< the newest image was refused
  /// A camera is not, or may not be, where its pose says; its images are left out.
  bool geometry_changed = false;
  /// Exposure of the newest of those that were left out for it; zero = never.
  MonotonicTime newest_left_out{};
};

/// Did the image of that camera and exposure take part in the estimate?
inline bool uses(const TubeEstimate& estimate, std::size_t camera, MonotonicTime exposure) {
  const auto end = estimate.views.begin() + estimate.view_count;
  return std::any_of(estimate.views.begin(), end, [&](const ViewUsed& view) {
    return view.camera == camera && view.exposure_monotonic_ns == to_ns(exposure);
  });
}

/// What an estimator is going to read of the next image.
struct ImageNeed {
  enum class Kind {
    kNothing,
    kAroundTube,  ///< near the tube, which is trusted to be where the newest estimate has it
    kWhole,       ///< anything
  };
  Kind kind = Kind::kWhole;
  double reach_px = 0;       ///< from the tube to either side; of kAroundTube
  double beyond_tip_px = 0;  ///< further around the tip
};

/// Turns observations into estimates. Called by the optimizer thread only; update() and look_further() never
/// allocate, lock, log, throw or read a clock, and their results depend on nothing but the observations since
/// reset(). Mode `paper` alone allocates.
class Estimator {
 public:
  virtual ~Estimator() = default;
  Estimator() = default;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  /// Both of the below, for whoever has nobody waiting for the estimate.
  void estimate(const Observation& observation, TubeEstimate& estimate) noexcept {
    update(observation, estimate);
    look_further(observation);
  }

  /// Fills everything of `estimate` but instrument, sequence_number and the pipeline's own stamps.
  virtual void update(const Observation& observation, TubeEstimate& estimate) noexcept = 0;

  /// What can wait until that estimate has left, and counts from the next one on. Precondition: update() with
  /// the same observation was the last call before.
  virtual void look_further(const Observation& /*observation*/) noexcept {}

  /// What it will read of the next image, as things stand after the newest estimate.
  [[nodiscard]] virtual ImageNeed image_need() const noexcept { return {}; }

  /// What a tube is on the images of that camera (index in the room), where it has found that it is not what
  /// they are read for and `finds_polarity` says that they may be read otherwise.
  [[nodiscard]] virtual std::optional<RidgePolarity> polarity_of(std::size_t /*camera*/) const noexcept {
    return std::nullopt;
  }

  /// That coils and images contradict each other: one sentence for a person into `words`, zero-terminated and
  /// cut to its size. False, and nothing is written, while they agree or nobody looks.
  [[nodiscard]] virtual bool describe_disagreement(std::span<char> /*words*/) const noexcept { return false; }

  /// Where a view stands that moved without a word: one sentence, written as above. False while all stand
  /// where their poses say.
  [[nodiscard]] virtual bool describe_moved_view(std::span<char> /*words*/) const noexcept { return false; }

  /// That all coils have jumped at once, and what sigma has of it: one sentence, written as above. False
  /// while nothing is left of it.
  [[nodiscard]] virtual bool describe_jump(std::span<char> /*words*/) const noexcept { return false; }

  /// Forgets the past.
  virtual void reset() noexcept = 0;
};

/// One that can measure bending from a hook.
class RestShapedEstimator : public Estimator {
 public:
  /// From the next estimate on the tip's rest shape is this hook, in the plane of its binormal; it belongs to
  /// the caller, and the binormal follows the shape. nullptr: a straight tip. Whoever changes it resets.
  virtual void set_rest(RestHook* hook) noexcept = 0;
};

/// Makes the estimator of settings.mode for one instrument of the room as configured, with images as
/// measured_room() has them. Allocates; throws
/// std::invalid_argument for an instrument without coils or with more than kMaxCoils.
std::unique_ptr<Estimator> make_estimator(const EstimatorSettings& settings,
                                          const InstrumentDescription& instrument,
                                          const RoomDescription& room);

}  // namespace tubed
