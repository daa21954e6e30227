// The MAP of coils and image lines as one writes it with Ceres: the peer of our solver.
#pragma once

#include <ceres/ceres.h>

#include <span>
#include <vector>

#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// The same residuals as TubeMap's, with Ceres' automatic differentiation, each bound to its four
/// coefficients. The problem is built once, in the constructor; one thread.
class CeresMap {
 public:
  CeresMap(const EstimatorSettings& settings, const UniformCubicBSpline& spline,
           const CoilObservations& coils, const CameraCalibration& camera,
           std::span<const LineConstraint> lines, ceres::LinearSolverType linear_solver);

  /// ceres::Solve with its own tolerances, from `start`. Returns the sum of squared residuals.
  double solve(const Eigen::Matrix3Xd& start);

  /// Sum of squared residuals at coefficients that another solver found.
  double cost_at(const Eigen::Matrix3Xd& C);

  [[nodiscard]] const Eigen::Matrix3Xd& C() const { return C_; }

 private:
  void add(ceres::CostFunction* function, int first);

  Eigen::Matrix3Xd C_;
  ceres::Problem problem_;
  ceres::Solver::Options options_;
};

}  // namespace tubed
