// What is known of a tube at one time: a Gaussian of its coefficients and of what is estimated beside them.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/model/uniform_cubic_bspline.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Sum of weight[k] times column[k] of the state: a point of the curve, and with the fifth a coil's error.
struct ColumnSum {
  /// A point of the curve; the fifth column is the caller's, its weight zero until then.
  explicit ColumnSum(const CubicBasis& basis);
  std::array<Eigen::Index, 5> column{};
  std::array<double, 5> weight{};
};

/// Columns of C and m as TubeColumns says: coefficients (mm, world), for each coil an error of
/// its position (mm, world) and of its tangent that lasts, then the motion's (TubeMotion).
struct TubeGaussian {
  explicit TubeGaussian(int column_count);

  MonotonicTime time{};
  Eigen::Matrix3Xd C;  ///< the shape with the tube's stiffness
  Eigen::Matrix3Xd m;  ///< mean of what was measured, without stiffness
  Eigen::MatrixXd P;   ///< covariance of m; mm^2 and what the other columns' units make of it

  /// Covariance of two sums of columns, mm^2 where both are of positions.
  [[nodiscard]] Eigen::Matrix3d covariance_of(const ColumnSum& a, const ColumnSum& b) const;

  /// What a measurement of zero of this column would do, with this variance an axis. `scratch` is of P's
  /// size.
  void tighten(int column, double variance, Eigen::MatrixXd& scratch);
};

}  // namespace tubed
