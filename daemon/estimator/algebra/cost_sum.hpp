// The squares of residuals, for steps that nobody will ask for derivatives.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/algebra/normal_equations.hpp"
#include "daemon/estimator/algebra/shared_error.hpp"

namespace tubed {

/// Takes residuals as NormalEquations does and keeps their squares alone.
class CostSum {
 public:
  void add(int /*first*/, const std::array<double, 4>& /*weights*/, const Eigen::Vector3d& /*gradient*/,
           double residual) {
    cost_ += residual * residual;
  }
  void add_isotropic(int /*first*/, const std::array<double, 4>& /*weights*/, double /*scale*/,
                     const Eigen::Vector3d& residual) {
    cost_ += residual.squaredNorm();
  }
  void add_with(int /*first*/, const std::array<double, 4>& /*weights*/, const Eigen::Matrix3d& /*gradient*/,
                int /*further*/, double /*further_scale*/, const Eigen::Vector3d& residual) {
    cost_ += residual.squaredNorm();
  }
  void add_prior(const Eigen::MatrixXd& information, const Eigen::VectorXd& departure) {
    for (Eigen::Index j = 0; j < departure.size(); ++j) {
      cost_ += departure[j] * information.col(j).dot(departure);
    }
  }
  void add_block(int /*first*/, const NormalEquations::FourColumns& /*J*/, const Eigen::Vector3d& residual) {
    cost_ += residual.squaredNorm();
  }
  void add_shared_block(int /*first*/, const NormalEquations::FourColumns& /*J*/,
                        const Eigen::Vector3d& residual,
                        const Eigen::Matrix<double, 3, SharedError::kParts>& H) {
    for (int part = 0; part < 3; ++part) {
      shared_error_.add(H.row(part).transpose(), residual[part]);
    }
    cost_ += residual.squaredNorm();
  }
  void add_to_shared(double residual, const SharedError::Parts& shared) {
    shared_error_.add(shared, residual);
    cost_ += residual * residual;
  }
  void begin_shared() { shared_error_.clear(); }
  void add_shared(int /*first*/, const std::array<double, 4>& /*weights*/,
                  const Eigen::Vector3d& /*gradient*/, double residual, const SharedError::Parts& shared) {
    shared_error_.add(shared, residual);
  }
  void end_shared() {
    shared_error_.close();
    cost_ -= shared_error_.y().squaredNorm();
  }
  [[nodiscard]] double cost() const { return cost_; }

 private:
  double cost_ = 0;
  SharedError shared_error_;
};

}  // namespace tubed
