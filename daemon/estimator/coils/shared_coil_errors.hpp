// What all coils share of their errors: a shift and a turn of all of them together.
#pragma once

#include <Eigen/Core>
#include <span>

#include "idl/estimate.hpp"

namespace tubed {

/// Errors of n coils, three numbers each (mm, world), are divided into a shift and a turn of all coils
/// together and what is each coil's own. A wrong registration is the first of them, and most of what a
/// distorted field does to a whole catheter; both stay where they are for as long as nobody moves anything,
/// while a coil's own part changes with the place in the field. With J of orthonormal columns that spans all
/// shifts and turns of coils that lie at these places (3n x 6),
///   x' = A x,  A = k_shared J J^T + (I - J J^T) D (I - J J^T),  D = diag(k_own),
/// ages them: ||A|| <= 1 as long as every k is within 0 .. 1, so that A (P - S) A^T + S, with the covariance
/// S = s^2 I of errors that nothing is known of, is a covariance where P is one. Used by the optimizer
/// thread; never allocates.
class SharedCoilErrors {
 public:
  /// `places_mm`: of the coils, at least one; world.
  explicit SharedCoilErrors(std::span<const Eigen::Vector3d> places_mm);

  /// Columns of X become A times themselves. `kept_own`: one a coil. `scratch`: at least 6 x X.cols().
  template <typename Derived>
  void age(double kept_shared, std::span<const double> kept_own, Eigen::MatrixBase<Derived>& X,
           Eigen::MatrixXd& scratch) const {
    auto Z = scratch.topLeftCorner(6, X.cols());
    Z.noalias() = J_.transpose() * X;
    X.noalias() -= J_ * Z;
    Z *= kept_shared;
    for (std::size_t coil = 0; coil < kept_own.size(); ++coil) {
      X.template middleRows<3>(3 * static_cast<Eigen::Index>(coil)) *= kept_own[coil];
    }
    // Of different k_own something is left that all share.
    Z.noalias() -= J_.transpose() * X;
    X.noalias() += J_ * Z;
  }

  [[nodiscard]] const auto& J() const { return J_; }

 private:
  Eigen::Matrix<double, Eigen::Dynamic, 6, 0, 3 * kMaxCoils, 6> J_;
};

}  // namespace tubed
