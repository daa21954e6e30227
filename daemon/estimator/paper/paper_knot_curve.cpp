#include "daemon/estimator/paper/paper_knot_curve.hpp"

#include <algorithm>

#include "idl/geometry/precondition.hpp"

namespace tubed {

namespace {

/// `count` points on the x axis at x(0), x(1), ...
template <typename Place>
Eigen::Matrix3Xd on_axis(int count, const Place& x) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, count);
  for (int i = 0; i < count; ++i) points(0, i) = x(i);
  return points;
}

}  // namespace

KnotCurve::KnotCurve(int count, double length_mm)
    : length_mm_(length_mm), straight_(on_axis(count, [&](int i) { return length_mm * i / (count - 1); })) {
  require(length_mm > 0, "a catheter needs a length");
  for (int j = 0; j < count; ++j) {
    bases_.emplace_back(on_axis(count, [&](int i) { return i == j ? 1.0 : 0.0; }));
  }
}

Eigen::VectorXd KnotCurve::weights(double s_mm) const {
  const double parameter = straight_.parameter_at_arc_length(std::clamp(s_mm, 0.0, length_mm_));
  Eigen::VectorXd weights(count());
  for (int j = 0; j < count(); ++j) {
    weights(j) = bases_[static_cast<std::size_t>(j)].point(parameter).x();
  }
  return weights;
}

}  // namespace tubed
