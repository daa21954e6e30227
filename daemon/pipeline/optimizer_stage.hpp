#pragma once

#include <array>
#include <memory>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/area_prediction.hpp"
#include "daemon/estimator/images/image_timeout.hpp"
#include "daemon/image/view_watch.hpp"
#include "daemon/pipeline/em_acquisition_stage.hpp"
#include "daemon/pipeline/tick_schedule.hpp"
#include "daemon/pipeline/triple_buffer.hpp"
#include "daemon/pipeline/tube_beside_views.hpp"

namespace tubed {

/// Hand-overs of one camera, as the optimizer sees them.
struct CameraInlet {
  TripleBuffer<ImageMeasurement>* measurements = nullptr;
  TripleBuffer<MonotonicTime>* announcements = nullptr;
  /// To the Frangi stage: where the next image will be read. Both or neither; without them images come whole.
  TripleBuffer<PredictedArea>* predictions = nullptr;
  AreaPrediction* prediction = nullptr;
  /// From the view's watch: whether the camera is where its pose says. Without it nobody watches.
  TripleBuffer<ViewVerdict>* views = nullptr;
};

/// Makes the estimates of all instruments: at once when an image was measured or when the coils' measurements
/// have become stale, by the clock in the gaps. Measurements are taken into the history when they come, so
/// that an image finds them there. See Stage.
class OptimizerStage final : public Stage {
 public:
  /// `outlets[i]` takes the estimates of `estimators[i]`; `reference` is the patient's.
  OptimizerStage(std::vector<std::unique_ptr<Estimator>> estimators,
                 std::vector<TripleBuffer<TubeEstimate>*> outlets, std::vector<CameraInlet> cameras,
                 EmRing& em, const PipelineSettings& settings, Doorbell& own_bell, Doorbell& publisher_bell,
                 const std::optional<ReferenceDescription>& reference = std::nullopt);

  void wait(const Clock& clock) noexcept override;
  bool step(const Clock& clock) noexcept override;
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override;

 private:
  struct CameraState {
    bool unused = false;              ///< measured and not yet part of an estimate
    MonotonicTime announced{};        ///< exposure of the newest grabbed image
    MonotonicTime newest{};           ///< exposure of the newest measured or refused one, or off instant
    MonotonicTime newest_measured{};  ///< exposure of the newest with pixels that may be used
    MonotonicTime newest_left_out{};  ///< exposure of the newest that was left out because the view moved
    ViewVerdict view;                 ///< the newest
    bool is_moved = false;            ///< the camera is not, or may not be, where its pose says
    ImageState state = ImageState::kMeasured;
    bool seen_any = false;
  };

  void take_em() noexcept;
  void take_images(MonotonicTime now) noexcept;
  void take_view(std::size_t camera) noexcept;
  [[nodiscard]] MonotonicTime next_estimate() const noexcept;
  [[nodiscard]] MonotonicTime em_becomes_stale() const noexcept;
  [[nodiscard]] int oldest_unused() const noexcept;
  [[nodiscard]] bool is_waiting_for_second_view(int camera, MonotonicTime now) const noexcept;
  Observation observe(MonotonicTime instant, MonotonicTime now, bool is_image_instant) noexcept;
  void show(std::size_t camera, Observation& observation) noexcept;
  void begin_predictions(const Observation& observation) noexcept;
  void predict(const ImageNeed& need, const TubeEstimate& estimate) noexcept;
  void hand_over_predictions() noexcept;
  void ask_why(MonotonicTime now) noexcept;
  void make_estimates(const Observation& observation, const Clock& clock) noexcept;

  std::vector<std::unique_ptr<Estimator>> estimators_;
  std::vector<TripleBuffer<TubeEstimate>*> outlets_;
  std::vector<CameraInlet> cameras_;
  std::vector<CameraState> states_;
  EmRing& em_ring_;
  Doorbell& bell_;
  Doorbell& publisher_bell_;
  std::chrono::nanoseconds period_;
  TickSchedule schedule_;
  EmHistory em_;
  ImageTimeout image_timeout_;
  std::chrono::nanoseconds max_image_timeout_;
  std::chrono::nanoseconds max_em_timeout_;
  MonotonicTime asked_{};       ///< of the newest estimates
  MonotonicTime told_stale_{};  ///< newest measurement of which an estimate has said that it is stale
  EmFrame incoming_;
  std::vector<std::uint64_t> sequence_numbers_;
  std::uint64_t outputs_ = 0;
  bool overran_ = false;  ///< what estimators looked for after the newest estimates took longer than a period
  std::uint64_t superseded_ = 0;
  std::uint64_t late_images_ = 0;
  std::uint64_t backward_em_ = 0;
  Validity newest_validity_ = Validity::kNotAvailable;
  std::array<char, 256> why_{};  ///< what coils and images disagree about; empty: they agree
  MonotonicTime why_written_{};
  TubeBesideViews beside_views_;
};

}  // namespace tubed
