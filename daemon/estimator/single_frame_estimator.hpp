// Modes "em" and "joint": every instant is solved afresh from its own measurements; nothing is carried over
// but the image lines that bridge the gap to the next image.
#pragma once

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/report.hpp"
#include "daemon/estimator/single_frame_solver.hpp"

namespace tubed {

/// See Estimator for thread and promises, SingleFrameSolver for the method.
class SingleFrameEstimator final : public RestShapedEstimator {
 public:
  SingleFrameEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                       const RoomDescription& room);

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void reset() noexcept override;
  void set_rest(RestHook* hook) noexcept override { solver_.set_rest(hook); }
  [[nodiscard]] ImageNeed image_need() const noexcept override;

 private:
  LooseEnds find_loose_ends(const Observation& observation, const CoilObservations& coils, bool has_image);

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  SingleFrameSolver solver_;
  TubeViews views_;
  LostTube lost_tube_;
  bool has_shape_ = false;
  bool has_covariance_ = false;
  bool is_ambiguous_ = false;   ///< as the newest image that takes part left it
  MonotonicTime shape_time_{};  ///< the instant of the newest shape
};

}  // namespace tubed
