#include "daemon/estimator/tube_map.hpp"

#include <cmath>

namespace tubed {

namespace {

constexpr double kConvergedStep_mm = 0.05;
constexpr double kFirstDamping = 1e-6;
// Gauss-Legendre with two points integrates the squares of each cubic piece's second derivative exactly.
constexpr std::array<double, 2> kGaussNodes = {0.21132486540518713, 0.78867513459481287};

}  // namespace

TubeMap::TubeMap(const EstimatorSettings& settings, double length_mm, int coils_with_error,
                 int further_columns)
    : settings_(settings),
      spline_(settings.coefficient_count, length_mm),
      coils_with_error_(coils_with_error),
      further_columns_(further_columns),
      equations_(column_count()),
      step_(Eigen::Matrix3Xd::Zero(3, column_count())),
      trial_(step_),
      departure_(Eigen::VectorXd::Zero(step_.size())),
      sigma_position_mm_(settings.sigma_position_mm),
      sigma_tangent_(settings.sigma_tangent) {}

void TubeMap::add_coils(const CoilObservations& coils, const Eigen::Matrix3Xd& C) {
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used()) {
      add_coil(coil, i, C);
    }
  }
}

void TubeMap::add_coil(const CoilObservation& coil, int index, const Eigen::Matrix3Xd& C) {
  const CubicBasis basis = spline_.basis(coil.s_mm);
  const Eigen::Vector3d derivative = combine(C, basis.first, basis.first_derivative);
  const double speed = std::max(derivative.norm(), 1e-6);
  const Eigen::Vector3d direction = derivative / speed;
  Eigen::Vector3d off_mm = combine(C, basis.first, basis.value) - coil.p_world_mm;
  Eigen::Vector3d turned = -direction - coil.tangent_world;
  const double position_weight = 1 / sigma_position_mm_;
  const Eigen::Matrix3d turning =
      -(Eigen::Matrix3d::Identity() - direction * direction.transpose()) / (speed * sigma_tangent_);
  if (index >= coils_with_error_) {
    equations_.add_isotropic(basis.first, basis.value, position_weight, off_mm * position_weight);
    for (int axis = 0; axis < 3; ++axis) {
      equations_.add(basis.first, basis.first_derivative, turning.row(axis).transpose(),
                     turned[axis] / sigma_tangent_);
    }
    return;
  }
  off_mm += C.col(position_error_column(index));
  turned += C.col(tangent_error_column(index));
  equations_.add_with(basis.first, basis.value, position_weight * Eigen::Matrix3d::Identity(),
                      position_error_column(index), position_weight, off_mm * position_weight);
  equations_.add_with(basis.first, basis.first_derivative, turning, tangent_error_column(index),
                      1 / sigma_tangent_, turned / sigma_tangent_);
}

void TubeMap::add_bending(const Eigen::Matrix3Xd& C) {
  const double h = spline_.spacing_mm();
  const double weight = std::sqrt(bending_factor_ * h / 2 / settings_.bending_q_per_mm);
  for (int segment = 0; segment < spline_.coefficient_count() - 3; ++segment) {
    for (const double node : kGaussNodes) {
      const CubicBasis basis = spline_.basis((segment + node) * h);
      const Eigen::Vector3d second = combine(C, basis.first, basis.second_derivative);
      equations_.add_isotropic(basis.first, basis.second_derivative, weight, second * weight);
    }
  }
}

void TubeMap::add_strain(const Eigen::Matrix3Xd& C) {
  const double h = spline_.spacing_mm();
  const double weight = std::sqrt(h / 2) / (strain_sigma_factor_ * settings_.sigma_strain_sqrt_mm);
  for (int segment = 0; segment < spline_.coefficient_count() - 3; ++segment) {
    for (const double node : kGaussNodes) {
      const CubicBasis basis = spline_.basis((segment + node) * h);
      const Eigen::Vector3d derivative = combine(C, basis.first, basis.first_derivative);
      const double speed = std::max(derivative.norm(), 1e-6);
      equations_.add(basis.first, basis.first_derivative, derivative / speed * weight, (speed - 1) * weight);
    }
  }
}

void TubeMap::add_view(const ViewConstraints& view, const Eigen::Matrix3Xd& C) {
  for (int i = 0; i < view.count; ++i) {
    const LineConstraint& line = view.lines[i];
    const CubicBasis basis = spline_.basis(line.s_mm);
    const auto projection = view.camera->project(combine(C, basis.first, basis.value));
    if (!projection) {
      continue;
    }
    const double weight = 1 / std::sqrt(line.variance_px2);
    const double residual = line.normal.dot(projection->p_image_px - line.target_px) * weight;
    equations_.add(basis.first, basis.value, projection->J_image_world.transpose() * line.normal * weight,
                   residual);
  }
}

void TubeMap::linearise(const CoilObservations& coils, std::span<const ViewConstraints> views,
                        const GaussianPrior* prior, const Eigen::Matrix3Xd& C) {
  linearise_measurements(coils, views, prior, C);
  add_bending(C);
  add_strain(C);
}

void TubeMap::linearise_measurements(const CoilObservations& coils, std::span<const ViewConstraints> views,
                                     const GaussianPrior* prior, const Eigen::Matrix3Xd& C) {
  equations_.clear();
  add_coils(coils, C);
  for (const ViewConstraints& view : views) {
    add_view(view, C);
  }
  if (prior != nullptr) {
    Eigen::Map<Eigen::Matrix3Xd>(departure_.data(), 3, C.cols()) = C - prior->mean;
    equations_.add_prior(prior->information, departure_);
  }
}

bool TubeMap::solve_linear(const CoilObservations& coils, Eigen::Matrix3Xd& C) {
  if (coils.used_count() < 2) {
    return false;
  }
  C.setZero();
  equations_.clear();
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used()) {
      const CubicBasis basis = spline_.basis(coil.s_mm);
      const double position_weight = 1 / settings_.sigma_position_mm;
      const double tangent_weight = 1 / settings_.sigma_tangent;
      equations_.add_isotropic(basis.first, basis.value, position_weight, -coil.p_world_mm * position_weight);
      equations_.add_isotropic(basis.first, basis.first_derivative, tangent_weight,
                               coil.tangent_world * tangent_weight);
    }
  }
  add_bending(C);
  if (!equations_.solve(0, step_)) {
    return false;
  }
  C = step_;
  return true;
}

int TubeMap::refine(const CoilObservations& coils, std::span<const ViewConstraints> views,
                    const GaussianPrior* prior, int most_iterations, Eigen::Matrix3Xd& C, bool& converged) {
  converged = false;
  double damping = kFirstDamping;
  linearise(coils, views, prior, C);
  double cost_here = equations_.cost();
  for (int iteration = 1; iteration <= most_iterations; ++iteration) {
    if (!equations_.solve(damping, step_)) {
      damping = std::max(damping, 1e-4) * 10;
      continue;
    }
    trial_ = C + step_;
    linearise(coils, views, prior, trial_);
    const double longest = step_.colwise().norm().maxCoeff();
    if (equations_.cost() <= cost_here) {
      C = trial_;
      cost_here = equations_.cost();
      damping = std::max(damping * 0.1, 1e-9);
      if (longest < kConvergedStep_mm) {
        converged = true;
        return iteration;
      }
    } else {
      if (longest < 1e-6) {
        converged = true;
        return iteration;
      }
      damping = std::max(damping * 10, 1e-4);
      linearise(coils, views, prior, C);
    }
  }
  return most_iterations;
}

double TubeMap::contradiction(const CoilObservations& coils, const Eigen::Matrix3Xd& C) {
  equations_.clear();
  add_coils(coils, C);
  add_strain(C);
  return equations_.cost();
}

bool TubeMap::invert_at(const CoilObservations& coils, std::span<const ViewConstraints> views,
                        const GaussianPrior* prior, const Eigen::Matrix3Xd& C) {
  linearise(coils, views, prior, C);
  return equations_.invert();
}

bool TubeMap::condense(const CoilObservations& coils, std::span<const ViewConstraints> views,
                       const GaussianPrior& prior, const Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& mean) {
  linearise_measurements(coils, views, &prior, C);
  if (!equations_.solve(0, step_) || !equations_.invert()) {
    return false;
  }
  mean = C + step_;
  return true;
}

Eigen::Matrix3d TubeMap::covariance(double s_mm) const {
  const CubicBasis basis = spline_.basis(s_mm);
  return equations_.covariance(basis.first, basis.value);
}

}  // namespace tubed
