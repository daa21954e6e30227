#include "daemon/estimator/reference/pose_filter.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kMaxGainOfRandomWalk = 0.9;  // with 1 nothing would be known after a single miss

}  // namespace

void PoseFilter::begin(const SensorPose& measured, MonotonicTime time) {
  time_ = time;
  count_ = 1;
  pose_ = measured.T_em_body;
  noise_ = newest_noise_ = measured.covariance;
  mean_innovation_.setZero();
  gain_ = 1;
}

void PoseFilter::update(const SensorPose& measured, MonotonicTime time) {
  count_ += 1;
  gain_ = std::max(settled_gain(time), 1 / count_);
  time_ = time;
  const PoseError e = innovation(measured);
  pose_ = moved_by(gain_ * e, pose_);
  noise_ = (1 - gain_) * (1 - gain_) * noise_ + gain_ * gain_ * measured.covariance;
  newest_noise_ = measured.covariance;
  mean_innovation_ += gain_ * (e - mean_innovation_);
}

void PoseFilter::miss(MonotonicTime time) {
  const double k = std::min(settled_gain(time), kMaxGainOfRandomWalk);
  noise_ += k * k / (1 - k) * newest_noise_;
  time_ = time;
}

PoseCovariance PoseFilter::covariance() const {
  const PoseError behind = (1 - gain_) * mean_innovation_;
  return noise_ + behind * behind.transpose();
}

double PoseFilter::settled_gain(MonotonicTime time) const {
  const double dt_s = std::max(seconds_between(time_, time), 0.0);
  return time_constant_s_ > 0 ? 1 - std::exp(-dt_s / time_constant_s_) : 1;
}

}  // namespace tubed
