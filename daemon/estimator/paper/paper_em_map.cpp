#include "daemon/estimator/paper/paper_em_map.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "daemon/model/dense_solver.hpp"
#include "daemon/model/gauss_legendre.hpp"

namespace tubed {

namespace {

constexpr int kMaxIterations = 100;
constexpr double kTolerance = 1e-8;          // of cost and parameters, relative
constexpr double kDepthDifference_mm = 0.5;  // half the base of the depth step's difference quotients

/// Square roots of the weights of Eq. (14).
struct Weights {
  double position = 1;
  double tangent = 1;
  double length = 1;
  double bending = 1;
};

Weights weights_of(const EstimatorSettings& settings) {
  if (settings.paper.weights == PaperWeights::kPrinted) {
    return {};
  }
  return {1 / settings.sigma_position_mm, 1 / settings.sigma_tangent, 1 / settings.paper.sigma_length_mm,
          1 / std::sqrt(settings.bending_q_per_mm)};
}

std::vector<double> places_of(const std::vector<const CoilObservation*>& coils) {
  std::vector<double> s_mm;
  for (const CoilObservation* coil : coils) s_mm.push_back(coil->s_mm);
  return s_mm;
}

/// Square root of the bending matrix, upper triangular or trapezoid: G = R' R. G is singular (straight lines
/// do not bend): rounded up by a relative 1e-12.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& G) {
  const double small = 1e-12 * std::max(G.trace(), 1e-300);
  return upper_factor(G + small * Eigen::MatrixXd::Identity(G.rows(), G.cols()));
}

/// Eq. (12), the differences between the lengths along the curve and those along the catheter, for all pairs
/// of coils: lengths_mm[i] is that of gap i.
double* write_lengths(const std::vector<const CoilObservation*>& coils, const std::vector<double>& lengths_mm,
                      double weight, double* r) {
  for (std::size_t i = 1; i < coils.size(); ++i) {
    double along_mm = 0;
    for (std::size_t k = i; k > 0; --k) {
      along_mm += lengths_mm[k - 1];
      *r++ = weight * (along_mm - (coils[i]->s_mm - coils[k - 1]->s_mm));
    }
  }
  return r;
}

double* write(const Eigen::Vector3d& residual, double* r) {
  Eigen::Map<Eigen::Vector3d>{r} = residual;
  return r + 3;
}

int pair_count(std::size_t coils) { return static_cast<int>(coils * (coils - 1) / 2); }

/// Residuals of Eq. (14): the parameters are the nodes of the cubics.
struct SpaceResiduals {
  const std::vector<const CoilObservation*>& coils;
  const GapCubics& cubics;
  const Eigen::MatrixXd& bending_root;
  Weights weights;

  [[nodiscard]] int count() const {
    return 6 * static_cast<int>(coils.size()) + pair_count(coils.size()) +
           3 * static_cast<int>(bending_root.rows());
  }

  bool operator()(double const* const* parameters, double* r) const {
    const Eigen::Map<const Eigen::Matrix3Xd> nodes(parameters[0], 3, 2 * cubics.node_count());
    std::vector<double> lengths_mm;
    for (int i = 0; i < cubics.node_count(); ++i) {
      const CoilObservation& coil = *coils[static_cast<std::size_t>(i)];
      const Eigen::Vector3d q = nodes.col(2 * i);
      const Eigen::Vector3d v = nodes.col(2 * i + 1);
      r = write(weights.position * (q - coil.p_world_mm), r);
      // The paper's t_i runs with the curve; ours points toward the tip, against it.
      r = write(weights.tangent * (-v / std::max(v.norm(), 1e-9) - coil.tangent_world), r);
      if (i > 0) {
        lengths_mm.push_back(
            integrate_gauss_legendre(cubics.node_s_mm(i - 1), cubics.node_s_mm(i), [&](double s_mm) {
              const GapBasis at = cubics.basis(s_mm);
              return combine(nodes, at, at.first_derivative).norm();
            }));
      }
    }
    r = write_lengths(coils, lengths_mm, weights.length, r);
    Eigen::Map<Eigen::MatrixXd>(r, bending_root.rows(), 3) =
        weights.bending * bending_root * nodes.transpose();
    return true;
  }
};

/// The same with the nodes' depths as parameters.
struct DepthResiduals {
  const std::vector<const CoilObservation*>& coils;
  const GapCubics& cubics;
  const Eigen::MatrixXd& bending_root;
  Weights weights;
  bool lengths;
  double length_mm;
  const PointAtDepth& point;

  [[nodiscard]] int count() const {
    return 6 * static_cast<int>(coils.size()) + (lengths ? pair_count(coils.size()) : 0) +
           static_cast<int>(bending_root.rows());
  }

  [[nodiscard]] Eigen::Vector3d at(const Eigen::RowVectorXd& nodes, double s_mm) const {
    const GapBasis basis = cubics.basis(s_mm);
    return point(s_mm, combine(nodes, basis, basis.value)(0));
  }
  [[nodiscard]] Eigen::Vector3d derivative(const Eigen::RowVectorXd& nodes, double s_mm) const {
    const double from = std::max(0.0, s_mm - kDepthDifference_mm);
    const double to = std::min(length_mm, s_mm + kDepthDifference_mm);
    return (at(nodes, to) - at(nodes, from)) / (to - from);
  }

  bool operator()(double const* const* parameters, double* r) const {
    const Eigen::RowVectorXd nodes =
        Eigen::Map<const Eigen::RowVectorXd>(parameters[0], 2 * cubics.node_count());
    std::vector<double> lengths_mm;
    for (std::size_t i = 0; i < coils.size(); ++i) {
      r = write(weights.position * (at(nodes, coils[i]->s_mm) - coils[i]->p_world_mm), r);
      const Eigen::Vector3d v = derivative(nodes, coils[i]->s_mm);
      r = write(weights.tangent * (-v / std::max(v.norm(), 1e-9) - coils[i]->tangent_world), r);
      if (lengths && i > 0) {
        lengths_mm.push_back(integrate_gauss_legendre(
            coils[i - 1]->s_mm, coils[i]->s_mm, [&](double s_mm) { return derivative(nodes, s_mm).norm(); }));
      }
    }
    if (lengths) r = write_lengths(coils, lengths_mm, weights.length, r);
    Eigen::Map<Eigen::VectorXd>(r, bending_root.rows()) = weights.bending * bending_root * nodes.transpose();
    return true;
  }
};

ceres::Solver::Options solver_options() {
  ceres::Solver::Options options;
  options.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.max_num_iterations = kMaxIterations;
  options.function_tolerance = kTolerance;
  options.parameter_tolerance = kTolerance;
  options.logging_type = ceres::SILENT;
  return options;
}

/// Levenberg-Marquardt with central differences; `x` is start and result.
template <typename Residuals>
ceres::Solver::Summary solve(const Residuals& residuals, Eigen::VectorXd& x) {
  ceres::Problem problem;
  auto* function = new ceres::DynamicNumericDiffCostFunction<Residuals, ceres::CENTRAL>(
      &residuals, ceres::DO_NOT_TAKE_OWNERSHIP);
  function->AddParameterBlock(static_cast<int>(x.size()));
  function->SetNumResiduals(residuals.count());
  problem.AddResidualBlock(function, nullptr, x.data());
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(), &problem, &summary);
  return summary;
}

bool solved(const ceres::Solver::Summary& summary) { return summary.termination_type == ceres::CONVERGENCE; }

int iterations_of(const ceres::Solver::Summary& summary) {
  return summary.num_successful_steps + summary.num_unsuccessful_steps;
}

}  // namespace

Eigen::Matrix3Xd PaperEmShape::points(int count, double length_mm) const {
  Eigen::Matrix3Xd points_mm(3, count);
  for (int i = 0; i < count; ++i) {
    const GapBasis at = cubics.basis(length_mm * i / (count - 1));
    points_mm.col(i) = combine(nodes, at, at.value);
  }
  return points_mm;
}

std::vector<const CoilObservation*> coils_in_order(const CoilObservations& coils) {
  std::vector<const CoilObservation*> ordered;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used()) ordered.push_back(&coil);
  }
  std::stable_sort(ordered.begin(), ordered.end(), [](auto* a, auto* b) { return a->s_mm < b->s_mm; });
  const auto same_place = [](auto* a, auto* b) { return b->s_mm - a->s_mm < 1e-6; };
  ordered.erase(std::unique(ordered.begin(), ordered.end(), same_place), ordered.end());
  return ordered;
}

std::optional<PaperEmShape> solve_paper_em_map(const EstimatorSettings& settings, double length_mm,
                                               const CoilObservations& coils) {
  const std::vector<const CoilObservation*> ordered = coils_in_order(coils);
  if (ordered.size() < 2) {
    return std::nullopt;
  }
  GapCubics cubics(places_of(ordered));
  Eigen::Matrix3Xd nodes(3, 2 * cubics.node_count());
  for (int i = 0; i < cubics.node_count(); ++i) {
    nodes.col(2 * i) = ordered[static_cast<std::size_t>(i)]->p_world_mm;
    nodes.col(2 * i + 1) = -ordered[static_cast<std::size_t>(i)]->tangent_world;
  }
  const Eigen::MatrixXd bending_root = root_of(cubics.bending(length_mm));
  const SpaceResiduals residuals{ordered, cubics, bending_root, weights_of(settings)};
  Eigen::VectorXd x = nodes.reshaped();
  const ceres::Solver::Summary summary = solve(residuals, x);
  nodes.reshaped() = x;
  if (!nodes.allFinite()) {
    return std::nullopt;
  }
  return PaperEmShape{std::move(cubics), nodes, iterations_of(summary), solved(summary)};
}

std::optional<PaperDepths> solve_paper_depth_map(const EstimatorSettings& settings, double length_mm,
                                                 const CoilObservations& coils, const PointAtDepth& point,
                                                 const Eigen::RowVectorXd& start) {
  const std::vector<const CoilObservation*> ordered = coils_in_order(coils);
  if (ordered.size() < 2 || start.size() != 2 * static_cast<Eigen::Index>(ordered.size())) {
    return std::nullopt;
  }
  GapCubics cubics(places_of(ordered));
  const Eigen::MatrixXd bending_root = root_of(cubics.bending(length_mm));
  const bool lengths = settings.paper.depth_lengths == PaperDepthLengths::kPrinted;
  const DepthResiduals residuals{ordered, cubics,    bending_root, weights_of(settings),
                                 lengths, length_mm, point};
  Eigen::VectorXd x = start.transpose();
  const ceres::Solver::Summary summary = solve(residuals, x);
  if (!x.allFinite()) {
    return std::nullopt;
  }
  return PaperDepths{std::move(cubics), x.transpose(), iterations_of(summary), solved(summary)};
}

}  // namespace tubed
