#include "daemon/estimator/motion_freedom.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

// A jerk of the tube: coils further off the prediction than they usually are, by so much and more. In between
// freedom grows evenly: a rounded digit must not decide.
constexpr double kJerkFrom = 1.4;
constexpr double kCertainJerk = 1.6;
constexpr int kMinMeasurements = 10;  // until it is known what is usual
constexpr int kMaxMeasurements = 60;  // that the mean goes back
constexpr double kFreedomMemory_s = 0.5;
constexpr double kMinFreedom = 0.4;
constexpr double kMaxFreedom = 10;
constexpr double kMinSideways = 0.25;
constexpr double kMinDrift = 0.05;
// At kMinFreedom updates pull by less than is expected: motion is calmer than the filter lets it be, which
// would lag behind the next jerk otherwise.
constexpr double kCalmVariance = 0.71;

}  // namespace

double MotionFreedom::needed_for(double surprise) {
  if (!(surprise > 0)) {  // too few coils, or NaN
    return learnt_;
  }
  const double times = usual_.count < kMinMeasurements ? 1 : surprise / usual_.mean;
  usual_.count = std::min(usual_.count + 1, kMaxMeasurements);
  usual_.mean *= std::pow(std::min(surprise / usual_.mean, kCertainJerk), 1.0 / usual_.count);
  const double jerk = std::clamp((times - kJerkFrom) / (kCertainJerk - kJerkFrom), 0.0, 1.0);
  return std::max(learnt_, kFreedomOfAJerk * jerk);
}

void MotionFreedom::adapt(double pulled, double expected, double interval_s, double lasting_share) {
  if (expected < 1) {
    return;
  }
  const double ratio = std::clamp(pulled / expected, 0.1, 10.0);
  const double share = std::clamp(interval_s / kFreedomMemory_s, 0.0, 1.0);
  learnt_ =
      std::clamp(learnt_ * std::pow(ratio, share), std::clamp(lasting_share, kMinFreedom, 1.0), kMaxFreedom);
}

double MotionFreedom::variance_factor() const {
  const double calm = std::clamp((1 - std::max(learnt_, last_)) / (1 - kMinFreedom), 0.0, 1.0);
  return 1 - (1 - kCalmVariance) * calm;
}

double MotionFreedom::sideways(double learnt, double lasting_share) {
  return learnt * std::clamp(lasting_share, kMinSideways, 1.0);
}

double MotionFreedom::min_drift(double lasting_share) { return std::clamp(lasting_share, kMinDrift, 1.0); }

}  // namespace tubed
