// Mode "filter": what was known of the tube a moment ago, moved on, with the coils and image lines of now.
#pragma once

#include <array>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/single_frame_solver.hpp"

namespace tubed {

/// See Estimator for thread and promises. State: the coefficients as a Gaussian. Motion: the catheter follows
/// itself when it is pushed (sliding along itself, one unknown length) and moves sideways a little, most at
/// the tip. Every EM measurement is an update in the order of time, every image another one. Begins, and
/// begins again after a loss, from SingleFrameSolver.
class RecursiveEstimator final : public Estimator {
 public:
  RecursiveEstimator(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                     const RoomDescription& room);

  void estimate(const Observation& observation, TubeEstimate& estimate) noexcept override;
  void reset() noexcept override;

 private:
  /// How long a coil has contradicted the prediction.
  struct GatedCoil {
    int times = 0;
    MonotonicTime since{};
  };

  CoilObservations observe(const EmFrame* frame, const EmHistory& history) const;
  bool initialise(const Observation& observation, CoilObservations& coils, const EmFrame& frame,
                  TubeEstimate& estimate);
  void advance(const Observation& observation, const EmFrame& newest, CoilObservations& coils,
               TubeEstimate& estimate);
  void predict(MonotonicTime time);
  bool update(const CoilObservations& coils, std::span<const ViewConstraints> lines, TubeEstimate& estimate);
  void update_image(const Observation& observation, TubeEstimate& estimate);
  void judge_images(const Observation& observation, bool looked, TubeEstimate& estimate);
  void gate(CoilObservations& coils, MonotonicTime time, double interval_s);
  [[nodiscard]] bool is_lost(MonotonicTime now) const;
  [[nodiscard]] Eigen::Matrix3d covariance_at(double s_mm) const;
  bool refresh_information();

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  SingleFrameSolver start_;  ///< with the weights of one frame
  TubeMap map_;              ///< with the weights of one of many frames
  TubeViews views_;
  Eigen::Matrix3Xd C_;         ///< mean
  Eigen::MatrixXd P_;          ///< covariance, mm^2
  GaussianPrior prior_;        ///< the prediction as the solver wants it
  Eigen::MatrixXd factor_;     ///< scratch
  Eigen::MatrixXd sideways_;   ///< process noise of one second between coefficients, mm^2 (n x n)
  Eigen::VectorXd departure_;  ///< scratch
  Eigen::VectorXd information_times_departure_;  ///< scratch
  Eigen::VectorXd sliding_;  ///< change of the coefficients when the tube slides 1 mm forward
  std::array<GatedCoil, kMaxCoils> gated_{};
  double restlessness_ = 0;  ///< smoothed chi^2 of the coils' positions per degree of freedom
  int images_without_tube_ = 0;
  ImageVerdict images_ = ImageVerdict::kNone;  ///< of this instant
  bool has_state_ = false;
  bool has_covariance_ = false;
  bool converged_ = true;
  MonotonicTime state_time_{};
  MonotonicTime newest_em_{};  ///< measurement time of the newest EM frame used
  MonotonicTime shape_time_{};
};

}  // namespace tubed
