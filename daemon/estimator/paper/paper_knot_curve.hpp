// The paper's centreline (KnotPointSpline, Eq. (1)-(4)) as a linear function of its knot points at given arc
// lengths.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "daemon/model/knot_point_spline.hpp"

namespace tubed {

/// n knot points at equal arc lengths over [0, length_mm]. The place at arc length s is the parameter at
/// which the spline through equally spaced points of a straight line has gone s: what the clamp does to the
/// parameter at the ends (see KnotPointSpline) is taken back. Allocates in the constructor and for its
/// results.
class KnotCurve {
 public:
  /// Precondition: count >= 4, length_mm > 0.
  KnotCurve(int count, double length_mm);

  /// b(s) = K * weights(s): n weights of sum 1. s is clamped to [0, length].
  [[nodiscard]] Eigen::VectorXd weights(double s_mm) const;

  [[nodiscard]] int count() const { return static_cast<int>(bases_.size()); }
  [[nodiscard]] double length_mm() const { return length_mm_; }
  /// Arc length of knot point `index`.
  [[nodiscard]] double knot_point_s_mm(int index) const { return length_mm_ * index / (count() - 1); }

 private:
  double length_mm_;
  KnotPointSpline straight_;
  std::vector<KnotPointSpline> bases_;  ///< element j: knot point j at 1, the others at 0
};

}  // namespace tubed
