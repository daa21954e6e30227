// How a tube may have moved since it was last seen, and what that does to what is known of it.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// Motion model of the recursive estimator. A catheter follows itself when it is pushed: zeta(s) becomes
/// zeta(s - v dt), v its speed along itself, which is estimated. And it moves sideways a little everywhere,
/// most at the tip. Columns of every C: coefficients, others that do not move, last the speed (mm/s in its
/// first component, the other two mean nothing). Memory is taken in the constructor.
class TubeMotion {
 public:
  TubeMotion(const UniformCubicBSpline& spline, int column_count);

  /// Sets the speed to unknown.
  void begin(Eigen::Matrix3Xd& C, Eigen::MatrixXd& P) const;

  /// Moves both means C and m (of the same state; the speed is m's) and their covariance P (3 column_count
  /// squared) on by `dt_s`. `freedom` multiplies the variance of the sideways motion.
  void predict(double dt_s, double freedom, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m, Eigen::MatrixXd& P);

 private:
  /// zeta(s) becomes zeta(s - slid_mm): a column becomes weights of four others.
  struct Shift {
    Eigen::Index first = 0;
    std::array<double, 4> weights{};
  };

  [[nodiscard]] Shift shift_of(Eigen::Index coefficient, double slid_mm) const;
  void shift(double slid_mm, Eigen::Matrix3Xd& C);
  void shift_columns(double slid_mm, Eigen::MatrixXd& P);
  void add_noise(double dt_s, double freedom, const Eigen::Matrix3Xd& C, Eigen::MatrixXd& P);

  Eigen::Index coefficient_count_;
  Eigen::Index speed_;  ///< row of the speed
  double spacing_mm_;
  Eigen::MatrixXd sideways_;    ///< variance of one second between coefficients, mm^2 (n x n)
  Eigen::VectorXd sliding_;     ///< change of C when the tube slides 1 mm forward
  Eigen::Matrix3Xd shifted_;    ///< scratch
  Eigen::MatrixXd columns_;     ///< scratch
  Eigen::VectorXd with_speed_;  ///< scratch
};

}  // namespace tubed
