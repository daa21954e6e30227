// Mode "filter": what was known of the tube a moment ago, moved on, with the coils and image lines of now.
#pragma once

#include <span>

#include "daemon/estimator/agreement/coil_image_agreement.hpp"
#include "daemon/estimator/coils/em_update.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/image_update.hpp"
#include "daemon/estimator/images/shape_judge.hpp"
#include "daemon/estimator/learnt_bending.hpp"
#include "daemon/estimator/report.hpp"
#include "daemon/estimator/shape_beginning.hpp"
#include "daemon/estimator/state_motion.hpp"
#include "daemon/estimator/tube_state.hpp"

namespace tubed {

/// See Estimator for thread and promises. State: the coefficients, for each coil an error of its position and
/// its tangent that stays, the velocities of the drift and the speed, together a Gaussian. Every EM
/// measurement is an update in the order of time, every image another one; an image that arrives after
/// younger EM measurements is taken into the state of its own time, and the next estimate goes through those
/// measurements again. Begins, and begins again after a loss, from SingleFrameSolver.
class RecursiveEstimator final : public RestShapedEstimator {
 public:
  RecursiveEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                     const RoomDescription& room);

  void update(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void reset() noexcept override;
  void set_rest(RestHook* hook) noexcept override;
  [[nodiscard]] ImageNeed image_need() const noexcept override;
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override;
  [[nodiscard]] bool describe_jump(std::span<char> words) const noexcept override;

 private:
  /// What is published.
  struct Shape {
    Eigen::Matrix3Xd C;
    const TubeMap* covariance = nullptr;  ///< that knows the covariance of C; nullptr: nothing does
    MonotonicTime time{};
    bool converged = true;
    ImageVerdict images = ImageVerdict::kNone;  ///< of its instant
  };

  [[nodiscard]] CoilObservations observe(const EmFrame* frame, const EmHistory& history) const;
  ImageVerdict advance(const Observation& observation, const EmFrame& newest, CoilObservations& coils,
                       TubeEstimate& estimate);
  void take_measurements(const EmFrame& newest, const EmHistory& history, TubeEstimate& estimate);
  void update_coils(const EmFrame& frame, const EmHistory& history, double interval_s,
                    TubeEstimate& estimate);
  void notice_common_jump(const EmFrame& frame, const CoilObservations& coils, const EmHistory& history);
  void ask_alone(const EmFrame& frame, const EmHistory& history, double interval_s);
  ImageVerdict update_image(const Observation& observation, const CoilObservations& coils,
                            TubeEstimate& estimate);
  void learn_from(const ImageUpdate::Outcome& outcome, const Observation& observation,
                  const CoilObservations& coils);
  bool began_too_sure();
  bool settle(Eigen::Matrix3Xd& C, TubeEstimate& estimate);
  void learn_bending(const Eigen::Matrix3Xd& C);
  void learn_bending_from_coils(TubeEstimate& estimate);
  bool initialise(const Observation& observation, CoilObservations& coils, const EmFrame& frame,
                  ImageVerdict& verdict, TubeEstimate& estimate);

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RoomDescription room_;
  ShapeBeginning beginning_;
  StateMotion motion_;
  EmUpdate em_update_;
  ImageUpdate image_update_;
  ShapeJudge judge_;
  LearntBending learnt_bending_;
  TubeState state_;
  TubeState before_update_;
  StateHistory past_;
  Shape shape_;
  LostTube lost_tube_;
  CoilImageAgreement agreement_;
};

}  // namespace tubed
