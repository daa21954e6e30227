#include "daemon/estimator/tube_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "daemon/estimator/algebra/cost_sum.hpp"
#include "daemon/model/dense_solver.hpp"

namespace tubed {

namespace {

constexpr double kConvergedStep_mm = 0.05;
constexpr double kNegligibleStep_mm = 1e-6;
constexpr double kFirstDamping = 1e-6;
// Gauss-Legendre with two points integrates the squares of each cubic piece's second derivative exactly.
constexpr std::array<double, 2> kGaussNodes = {0.21132486540518713, 0.78867513459481287};

// How much of the second derivative's square at each node of the integral is there by the residuals of
// bending alone, all weighing the same, in units of what one axis has: 1 in the middle of a tube, more at its
// ends. The second derivative is a straight line between the ends of the `segments`.
Eigen::VectorXd bending_by_itself(Eigen::Index segments) {
  Eigen::MatrixXd at_nodes = Eigen::MatrixXd::Zero(2 * segments, segments + 1);
  for (Eigen::Index i = 0; i < at_nodes.rows(); ++i) {
    const double u = kGaussNodes[static_cast<std::size_t>(i % 2)];
    at_nodes(i, i / 2) = 1 - u;
    at_nodes(i, i / 2 + 1) = u;
  }
  const Eigen::MatrixXd mass = at_nodes.transpose() * at_nodes;
  return 2 * (at_nodes * inverse_of(mass)).cwiseProduct(at_nodes).rowwise().sum();
}

}  // namespace

TubeMap::TubeMap(const EstimatorSettings& settings, double length_mm, int coils_with_error,
                 int further_columns)
    : settings_(settings),
      spline_(settings.coefficient_count, length_mm),
      columns_{settings.coefficient_count, coils_with_error, further_columns},
      equations_(settings.coefficient_count, columns_.count() - settings.coefficient_count),
      step_(Eigen::Matrix3Xd::Zero(3, columns_.count())),
      trial_(step_),
      departure_(Eigen::VectorXd::Zero(step_.size())),
      sigma_{settings.sigma_position_mm, settings.sigma_tangent} {
  for (int segment = 0; segment < spline_.coefficient_count() - 3; ++segment) {
    for (const double node : kGaussNodes) {
      node_places_mm_.push_back((segment + node) * spline_.spacing_mm());
      nodes_.push_back(spline_.basis(node_places_mm_.back()));
    }
  }
  bending_.softness = bending_.factors = Eigen::VectorXd::Ones(bending_node_count());
  bending_.by_itself = bending_by_itself(spline_.coefficient_count() - 3);
}

void TubeMap::set_stiffness(const StiffnessProfile& stiffness) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    bending_.softness[static_cast<Eigen::Index>(i)] = 1 / stiffness.at(node_places_mm_[i]);
  }
  bending_.factors = bending_.softness;
}

template <typename Sum>
void TubeMap::add_coils(const CoilObservations& coils, const Eigen::Matrix3Xd& C, Sum& sum) const {
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used()) {
      add_coil(coil, i, C, sum);
    }
  }
}

template <typename Sum>
void TubeMap::add_coil(const CoilObservation& coil, int index, const Eigen::Matrix3Xd& C, Sum& sum) const {
  // Eq. (12), first two sums: r_p = (zeta(s_i) - p_i) / sigma_p and r_t = (-zeta' / |zeta'| - t_i) / sigma_t;
  // zeta runs from the tip away, t_i toward it.
  const CubicBasis basis = spline_.basis(coil.s_mm);
  const Eigen::Vector3d derivative = combine(C, basis.first, basis.first_derivative);
  const double speed = std::max(derivative.norm(), 1e-6);
  const Eigen::Vector3d direction = derivative / speed;
  Eigen::Vector3d off_mm = combine(C, basis.first, basis.value) - coil.p_world_mm;
  Eigen::Vector3d turned = -direction - coil.tangent_world;
  const double position_weight = 1 / sigma_.position_mm;
  // d(-zeta' / |zeta'|) / d zeta' = -(I - u u^T) / |zeta'| with u = zeta' / |zeta'|: only what is across u
  // turns it.
  const Eigen::Matrix3d turning =
      -(Eigen::Matrix3d::Identity() - direction * direction.transpose()) / (speed * sigma_.tangent);
  if (index >= columns_.coils_with_error) {
    sum.add_isotropic(basis.first, basis.value, position_weight, off_mm * position_weight);
    for (int axis = 0; axis < 3; ++axis) {
      sum.add(basis.first, basis.first_derivative, turning.row(axis).transpose(),
              turned[axis] / sigma_.tangent);
    }
    return;
  }
  // A coil's lasting error b_i is a state: r_p = (zeta(s_i) + b_i - p_i) / sigma_p, and the same for its
  // tangent.
  off_mm += C.col(columns_.position_error(index));
  turned += C.col(columns_.tangent_error(index));
  sum.add_with(basis.first, basis.value, position_weight * Eigen::Matrix3d::Identity(),
               columns_.position_error(index), position_weight, off_mm * position_weight);
  sum.add_with(basis.first, basis.first_derivative, turning, columns_.tangent_error(index),
               1 / sigma_.tangent, turned / sigma_.tangent);
}

template <typename Sum>
void TubeMap::add_bending(const Eigen::Matrix3Xd& C, RestHook::Binormal binormal, Sum& sum) {
  // Eq. (13): the integral of |zeta''|^2 / q ds. A segment of length h has two nodes of weight h / 2; a
  // residual a node is sqrt(h / (2 q f)) zeta'', f the factor learnt there.
  const double usual = spline_.spacing_mm() / 2 / settings_.bending_q_per_mm;
  const std::size_t begin = hook_ == nullptr ? 0 : 2 * static_cast<std::size_t>(hook_->segment_count());
  for (std::size_t i = begin; i < nodes_.size(); ++i) {
    const CubicBasis& basis = nodes_[i];
    const double weight = std::sqrt(usual / bending_.factors[static_cast<Eigen::Index>(i)]);
    const Eigen::Vector3d second = combine(C, basis.first, basis.second_derivative);
    sum.add_isotropic(basis.first, basis.second_derivative, weight, second * weight);
  }
  if (hook_ != nullptr) {
    hook_->weigh(settings_.bending_q_per_mm, bending_.factors);
    if (binormal == RestHook::Binormal::kFree) hook_->fit_binormal(C);
    hook_->add_bending(C, binormal, sum);
  }
}

template <typename Sum>
void TubeMap::add_strain(const Eigen::Matrix3Xd& C, Sum& sum) const {
  // Instead of the lengths L_ik of Eq. (12): the integral of (|zeta'| - 1)^2 / sigma_strain^2 ds, node by
  // node; its gradient by zeta' is the unit tangent.
  const double weight =
      std::sqrt(spline_.spacing_mm() / 2) / (sigma_.strain_factor * settings_.sigma_strain_sqrt_mm);
  for (const CubicBasis& basis : nodes_) {
    const Eigen::Vector3d derivative = combine(C, basis.first, basis.first_derivative);
    const double speed = std::max(derivative.norm(), 1e-6);
    sum.add(basis.first, basis.first_derivative, derivative / speed * weight, (speed - 1) * weight);
  }
}

template <typename Sum>
void TubeMap::add_measurements(const Measurements& measurements, const Eigen::Matrix3Xd& C, Sum& sum) {
  add_coils(measurements.coils, C, sum);
  lines_.add(C, sum);
  if (measurements.prior != nullptr) {
    departure_ = (C - measurements.prior->mean).reshaped();
    sum.add_prior(measurements.prior->information, departure_);
  }
}

void TubeMap::linearise(const Measurements& measurements, const Eigen::Matrix3Xd& C) {
  equations_.clear();
  add_measurements(measurements, C, equations_);
  add_bending(C, RestHook::Binormal::kFree, equations_);
  add_strain(C, equations_);
}

double TubeMap::cost_at(const Measurements& measurements, const Eigen::Matrix3Xd& C) {
  CostSum sum;
  add_measurements(measurements, C, sum);
  add_bending(C, RestHook::Binormal::kFree, sum);
  add_strain(C, sum);
  return sum.cost();
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
  add_bending(C, RestHook::Binormal::kHeld, equations_);
  if (!equations_.solve(0, step_)) {
    return false;
  }
  C = step_;
  return true;
}

int TubeMap::refine(const CoilObservations& coils, std::span<const ViewConstraints> views,
                    const GaussianPrior* prior, int max_iterations, Eigen::Matrix3Xd& C, bool& converged) {
  converged = false;
  double damping = kFirstDamping;
  const Measurements measurements{coils, prior};
  lines_.prepare(views, spline_);
  linearise(measurements, C);
  cost_ = equations_.cost();
  for (int iteration = 1; iteration <= max_iterations; ++iteration) {
    if (!equations_.solve(damping, step_)) {
      damping = std::max(damping, 1e-4) * 10;
      continue;
    }
    trial_ = C + step_;
    const double longest = step_.colwise().norm().maxCoeff();
    const bool is_last = longest < kConvergedStep_mm || iteration == max_iterations;
    double cost = 0;
    if (is_last) {  // nobody will ask for its derivatives
      cost = cost_at(measurements, trial_);
    } else {
      linearise(measurements, trial_);
      cost = equations_.cost();
    }
    if (cost <= cost_) {
      C = trial_;
      cost_ = cost;
      damping = std::max(damping * 0.1, 1e-9);
      if (longest < kConvergedStep_mm) {
        converged = true;
        return iteration;
      }
    } else {
      if (longest < kNegligibleStep_mm) {
        converged = true;
        return iteration;
      }
      damping = std::max(damping * 10, 1e-4);
      if (!is_last) linearise(measurements, C);
    }
  }
  return max_iterations;
}

double TubeMap::contradiction(const CoilObservations& coils, const Eigen::Matrix3Xd& C) const {
  CostSum sum;
  add_coils(coils, C, sum);
  add_strain(C, sum);
  return sum.cost();
}

bool TubeMap::invert_at(const CoilObservations& coils, std::span<const ViewConstraints> views,
                        const GaussianPrior* prior, const Eigen::Matrix3Xd& C) {
  lines_.prepare(views, spline_);
  linearise({coils, prior}, C);
  return equations_.invert();
}

// Across the tube alone: what strain leaves free along it is no bend. Of two axes there, curvature of
// variance q a length makes h |zeta''|^2 = 2 q in expectation, but for the ends.
void TubeMap::expect_bending(const Eigen::Matrix3Xd& C, Eigen::VectorXd& factors) const {
  const double scale = spline_.spacing_mm() / 2 / settings_.bending_q_per_mm;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const CubicBasis& basis = nodes_[i];
    const auto node = static_cast<Eigen::Index>(i);
    const Eigen::Vector3d along = combine(C, basis.first, basis.first_derivative).normalized();
    Eigen::Vector3d second = combine(C, basis.first, basis.second_derivative);
    if (hook_ != nullptr) {
      second -= hook_->curvature_per_mm(node_places_mm_[i]) *
                hook_->binormal().cross(combine(C, basis.first, basis.first_derivative));
    }
    const Eigen::Matrix3d covariance = equations_.covariance(basis.first, basis.second_derivative);
    const double part_along = along.dot(second);
    const double square =
        second.squaredNorm() - part_along * part_along + covariance.trace() - along.dot(covariance * along);
    factors[node] = scale * square / (bending_.by_itself[node] * bending_.softness[node]);
  }
}

bool TubeMap::condense(const CoilObservations& coils, std::span<const ViewConstraints> views,
                       const GaussianPrior& prior, const Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& mean) {
  lines_.prepare(views, spline_);
  equations_.clear();
  add_measurements({coils, &prior}, C, equations_);
  if (!equations_.invert_and_solve(step_)) {
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
