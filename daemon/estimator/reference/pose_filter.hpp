// A pose that hardly moves, from noisy measurements of it: first-order filter on SE(3).
#pragma once

#include "drivers/interface/timestamps.hpp"
#include "idl/geometry/sensor_pose.hpp"

namespace tubed {

/// With measurement T_m the estimate T turns and shifts by the share k of their difference e (the
/// innovation),
///   T <- T moved by k e,   k = max(1 - exp(-dt / time constant), 1 / n),
/// n the measurements since the beginning, so that it begins as their mean. This is the Kalman filter of a
/// pose that performs a random walk, once its gain has settled. Of white noise R an estimate keeps k / (2 -
/// k) R; a step is followed to 63, 95 and 99 % after one, three and 4.6 time constants; a pose that moves at
/// v is (1 - k) v dt / k behind, which is v times the time constant where dt is short. How far it is behind
/// is seen in the mean of the innovations and is part of the covariance. A value of one thread; never
/// allocates.
class PoseFilter {
 public:
  explicit PoseFilter(double time_constant_s) : time_constant_s_(time_constant_s) {}

  /// Forgets the past.
  void begin(const SensorPose& measured, MonotonicTime time);
  /// The next measurement. Precondition: begin().
  void update(const SensorPose& measured, MonotonicTime time);
  /// None came at `time`: the pose stays, its covariance grows by the random walk's, k^2 / (1 - k) R.
  void miss(MonotonicTime time);

  [[nodiscard]] PoseError innovation(const SensorPose& measured) const {
    return difference_of(pose_, measured.T_em_body);
  }
  [[nodiscard]] const RigidTransform& pose() const { return pose_; }
  /// Of noise, and of what the filter is behind by: its outer product.
  [[nodiscard]] PoseCovariance covariance() const;

 private:
  [[nodiscard]] double settled_gain(MonotonicTime time) const;

  double time_constant_s_;
  MonotonicTime time_{};
  double count_ = 0;
  RigidTransform pose_ = RigidTransform::Identity();
  PoseCovariance noise_ = PoseCovariance::Zero();         ///< of the estimate
  PoseCovariance newest_noise_ = PoseCovariance::Zero();  ///< R of the newest measurement
  PoseError mean_innovation_ = PoseError::Zero();
  double gain_ = 1;
};

}  // namespace tubed
