// When the recursive estimator learns how much its tube bends.
#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

constexpr double kBendingWithoutImages_s = 0.2;

}  // namespace

// Of the shape C whose covariance is known.
void RecursiveEstimator::learn_bending(const Eigen::Matrix3Xd& C) {
  if (covariance_ != &image_map_) {
    return;
  }
  learnt_bending_.learn(image_map_, C, seconds_between(state_.bending_learnt, state_.time), state_.bending);
  state_.bending_learnt = state_.time;
}

// Where images do not do so. It takes a shape, which between images nobody has asked for yet.
void RecursiveEstimator::learn_bending_from_coils(TubeEstimate& estimate) {
  if (!state_.begun || seconds_between(state_.bending_learnt, state_.time) < kBendingWithoutImages_s) {
    return;
  }
  shape_ = state_.C;
  if (settle(shape_, estimate)) {
    know_covariance({});
    learn_bending(shape_);
  }
}

}  // namespace tubed
