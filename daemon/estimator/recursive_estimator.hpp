// Mode "filter": what was known of the tube a moment ago, moved on, with the coils and image lines of now.
#pragma once

#include <array>

#include "daemon/estimator/coil_noise.hpp"
#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/single_frame_solver.hpp"
#include "daemon/estimator/tube_motion.hpp"

namespace tubed {

/// See Estimator for thread and promises. State: the coefficients and, for each coil, an error of its
/// position and its tangent that stays, together a Gaussian. Every EM measurement is an update in the order
/// of time, every image another one. Begins, and begins again after a loss, from SingleFrameSolver.
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
  void listen(const Observation& observation, const EmFrame& newest);
  bool initialise(const Observation& observation, CoilObservations& coils, const EmFrame& frame,
                  TubeEstimate& estimate);
  void advance(const Observation& observation, const EmFrame& newest, CoilObservations& coils,
               TubeEstimate& estimate);
  void predict(MonotonicTime time);
  void forget_coil_errors();
  bool update(const CoilObservations& coils, std::span<const ViewConstraints> lines, double interval_s,
              TubeEstimate& estimate);
  void update_image(const Observation& observation, TubeEstimate& estimate);
  [[nodiscard]] double pull(const Eigen::Matrix3Xd& C);
  bool keep(const CoilObservations& coils, std::span<const ViewConstraints> lines, double interval_s);
  void adapt_freedom(double interval_s);
  void judge_images(const Observation& observation, bool looked, TubeEstimate& estimate);
  void gate(CoilObservations& coils, MonotonicTime time);
  [[nodiscard]] Eigen::Matrix3d innovation_covariance(const CoilObservation& coil, int index) const;
  [[nodiscard]] bool is_lost(MonotonicTime now) const;
  bool refresh_information();

  EstimatorSettings settings_;
  InstrumentDescription instrument_;
  RigidTransform T_world_em_;
  bool registered_;
  SingleFrameSolver start_;  ///< with the weights of one frame
  TubeMap map_;              ///< with the weights of one of many frames
  TubeViews views_;
  TubeMotion motion_;
  CoilNoise noise_;
  Eigen::Matrix3Xd C_;         ///< the shape: coefficients, position errors, tangent errors of the coils
  Eigen::Matrix3Xd C_before_;  ///< the shape before the images of this instant
  Eigen::Matrix3Xd m_;         ///< mean of what was measured, without stiffness; columns as in C
  Eigen::MatrixXd P_;          ///< covariance, mm^2 and what the tangents' unit 1 makes of it
  GaussianPrior prior_;        ///< the prediction as the solver wants it
  Eigen::MatrixXd factor_;     ///< scratch
  Eigen::VectorXd departure_;  ///< scratch
  Eigen::VectorXd information_times_departure_;              ///< scratch
  std::array<Eigen::Vector3d, kMaxCoils> coil_places_mm_{};  ///< on the tube, when errors last aged
  std::array<GatedCoil, kMaxCoils> gated_{};
  double freedom_ = 1;  ///< of the sideways motion, learnt from how far updates pull
  double lasting_position_mm_ = 0;
  double lasting_tangent_ = 0;
  bool began_with_known_noise_ = false;
  int images_without_tube_ = 0;
  ImageVerdict images_ = ImageVerdict::kNone;  ///< of this instant
  MonotonicTime confirmed_{};                  ///< newest image that showed the tube where it was expected
  bool has_state_ = false;
  bool has_covariance_ = false;
  bool converged_ = true;
  MonotonicTime state_time_{};
  MonotonicTime newest_em_{};  ///< measurement time of the newest EM frame used
  MonotonicTime heard_{};      ///< measurement time of the newest EM frame whose noise was looked at
  MonotonicTime shape_time_{};
};

}  // namespace tubed
