// How a tube may have moved since it was last seen, and what that does to what is known of it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// Motion model of the recursive estimator. A catheter follows itself when it is pushed: zeta(s) becomes
/// zeta(s - v dt), v its speed along itself, which is estimated. Long stretches of it drift: they keep moving
/// to a side for a while, with velocities that are estimated at nodes along the tube, linear in between. And
/// it moves sideways a little everywhere, most at the tip. Columns of every C: coefficients, others that do
/// not move, the nodes' velocities (mm/s, world frame), last the speed (mm/s in its first component, the
/// other two mean nothing). Memory is taken in the constructor.
class TubeMotion {
 public:
  static constexpr int kMaxNodes = 8;
  static constexpr double kUsualDrift_mm_s = 7;  ///< of a stretch of which nothing is known yet

  /// How fast the stretch around each node drifts: variance of its velocity, (mm/s)^2 an axis.
  class DriftVariances {
   public:
    DriftVariances() { values_.fill(kUsualDrift_mm_s * kUsualDrift_mm_s); }
    double& operator[](Eigen::Index node) { return values_[static_cast<std::size_t>(node)]; }
    double operator[](Eigen::Index node) const { return values_[static_cast<std::size_t>(node)]; }

   private:
    std::array<double, kMaxNodes> values_{};
  };

  /// How free the tube is to move otherwise than it is expected to.
  struct Freedom {
    double sideways = 1;  ///< multiplies the variance of the sideways motion
    DriftVariances drift;
  };

  TubeMotion(const UniformCubicBSpline& spline, int column_count);

  /// The velocities and the speed: what a C needs behind its other columns for a tube of this length.
  [[nodiscard]] static int column_count_of_motion(double length_mm);

  /// The speed along itself, toward the tip, of a tube with these columns.
  [[nodiscard]] static double speed_mm_s(const Eigen::Matrix3Xd& C) { return C(0, C.cols() - 1); }

  /// Sets the velocities and the speed to unknown.
  void begin(Eigen::Matrix3Xd& C, Eigen::MatrixXd& P) const;

  /// Moves both means C and m (of the same state; speed and velocities are m's) and their covariance P (3
  /// column_count squared) on by `dt_s`.
  void predict(double dt_s, const Freedom& freedom, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m,
               Eigen::MatrixXd& P);

  /// The covariance of a tube that may have moved sideways by the square root of `variance_at_mm2(s_mm)` an
  /// axis at the place s_mm from the tip, neighbours together as in predict().
  template <class VarianceAt>
  void loosen(VarianceAt variance_at_mm2, Eigen::MatrixXd& P) const {
    const auto times = [&](Eigen::Index i) {
      const double s_mm = std::max(0.0, (static_cast<double>(i) - 1) * spacing_mm_);
      return std::sqrt(variance_at_mm2(s_mm) / sideways_(i, i));
    };
    for (Eigen::Index i = 0; i < coefficient_count_; ++i) {
      const double times_i = times(i);
      if (!(times_i > 0)) continue;
      for (Eigen::Index j = 0; j < coefficient_count_; ++j) {
        P.block<3, 3>(3 * i, 3 * j).diagonal().array() += times_i * times(j) * sideways_(i, j);
      }
    }
  }

  /// Learns from m and P, after a measurement taken `interval_s` after the last, how fast each stretch
  /// drifts: one that is seen to move across the view moves in depth as well, one that rests in it rests. No
  /// stretch becomes slower than `least` times the usual variance.
  void learn_drift(double interval_s, double least, const Eigen::Matrix3Xd& m, const Eigen::MatrixXd& P,
                   DriftVariances& drift) const;

 private:
  /// zeta(s) becomes zeta(s - slid_mm): a column becomes weights of four others.
  struct Shift {
    Eigen::Index first = 0;
    std::array<double, 4> weights{};
  };

  /// Between which nodes a coefficient is.
  struct Between {
    Eigen::Index column = 0;  ///< of the node nearer to the tip
    double share = 0;         ///< of the next one
  };

  [[nodiscard]] Shift shift_of(Eigen::Index coefficient, double slid_mm) const;
  [[nodiscard]] Between nodes_of(Eigen::Index coefficient) const;
  void shift(double slid_mm, Eigen::Matrix3Xd& C);
  void drift(double way_s, const Eigen::Matrix3Xd& m, Eigen::Matrix3Xd& C) const;
  void move_columns(double slid_mm, double way_s, Eigen::MatrixXd& P);
  void add_noise(double dt_s, double freedom, const Eigen::Matrix3Xd& C, Eigen::MatrixXd& P);
  void forget_speed(double dt_s, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m, Eigen::MatrixXd& P) const;
  void forget_drift(double dt_s, const DriftVariances& drift, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m,
                    Eigen::MatrixXd& P) const;

  Eigen::Index coefficient_count_;
  Eigen::Index drift_count_;  ///< nodes that have a velocity
  Eigen::Index speed_;        ///< row of the speed
  Eigen::Index drift_;        ///< row of the first velocity
  double spacing_mm_;
  Eigen::MatrixXd sideways_;    ///< variance of one second between coefficients, mm^2 (n x n)
  Eigen::MatrixXd drifting_;    ///< shares of the nodes in the coefficients (n x nodes)
  Eigen::VectorXd sliding_;     ///< change of C when the tube slides 1 mm forward
  Eigen::Matrix3Xd shifted_;    ///< scratch
  Eigen::MatrixXd columns_;     ///< scratch
  Eigen::VectorXd with_speed_;  ///< scratch
};

}  // namespace tubed
