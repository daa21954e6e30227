// One EM measurement taken into the state of the recursive estimator.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// Kalman's update in covariance form: five coils are at most 30 residuals, far fewer than the state has
/// unknowns. Residuals as TubeMap's, Eq. (12), with the errors that stay. Where the mean is stretched or
/// squeezed beyond what the spline needs, a direction's part along itself, which says nothing, gives way to
/// the strain: nothing else holds |zeta'| between two images, and where it comes near to zero a direction
/// turns about at a touch. Memory is taken in the constructor.
class CoilUpdate {
 public:
  CoilUpdate(int max_coils, int column_count);

  /// How far the measurement pulled, and how far it should have: chi^2 and its expectation.
  struct Pull {
    double chi_squared = 0;
    double expected = 0;
  };

  /// Linearises at C, updates mean m and covariance P, moves C with m. Columns as map.columns().count() says.
  /// Nothing happens without a used coil. False, with m and P as they were, when P is not positive definite.
  bool apply(const CoilObservations& coils, const TubeMap& map, double sigma_position_mm,
             double sigma_tangent, Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& m, Eigen::MatrixXd& P);

  [[nodiscard]] const Pull& pull() const { return pull_; }

 private:
  /// Three whitened residuals: r = gradient * (sum of weights * columns) + further_gradient * further column
  /// - measured.
  struct Rows {
    int first = 0;
    std::array<double, 4> weights{};
    Eigen::Matrix3d gradient;
    int further = 0;
    Eigen::Matrix3d further_gradient;
  };

  void add(const Rows& rows, const Eigen::Vector3d& residual_at_C, const Eigen::Matrix3Xd& C,
           const Eigen::Matrix3Xd& m, const Eigen::MatrixXd& P);
  void fill_innovation_covariance(Eigen::Index n);

  std::array<Rows, 2 * kMaxCoils> rows_;
  Eigen::Index count_ = 0;  ///< of rows_ in use
  Eigen::MatrixXd PHt_;     ///< covariance between state and residuals
  Eigen::MatrixXd S_;       ///< of the innovation
  Eigen::MatrixXd Y_;       ///< L^-1 H P, S = L L^T
  Eigen::VectorXd innovation_;
  Eigen::VectorXd step_;
  Pull pull_;
};

}  // namespace tubed
