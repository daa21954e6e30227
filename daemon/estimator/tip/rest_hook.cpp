#include "daemon/estimator/tip/rest_hook.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tubed {

namespace {

constexpr double kEdge_mm = 1.5;  // over which curvature changes: nothing is bent from one point to the next
constexpr int kRounds = 4;
constexpr double kMinOpening = 0.05;  // a hook that is straight has no plane

// Gauss-Legendre's nodes and weights on [0, 1], six points: the hook's curvature begins within a segment.
constexpr std::array<double, 6> kNodes{0.033765242898424, 0.169395306766868, 0.380690406958402,
                                       0.619309593041598, 0.830604693233132, 0.966234757101576};
constexpr std::array<double, 6> kWeights{0.085662246189585, 0.180380786524069, 0.233956967286346,
                                         0.233956967286346, 0.180380786524069, 0.085662246189585};

}  // namespace

RestHook::RestHook(const UniformCubicBSpline& spline, RestCurve curve)
    : curve_(std::move(curve)),
      length_mm_(curve_.length_mm()),
      segment_count_(std::min(spline.coefficient_count() - 3,
                              static_cast<int>(std::ceil((length_mm_ + kEdge_mm) / spline.spacing_mm())))),
      beginning_(spline.basis(length_mm_)) {
  const double spacing_mm = spline.spacing_mm();
  for (int segment = 0; segment < segment_count_; ++segment) {
    for (std::size_t k = 0; k < kNodes.size(); ++k) {
      const double s_mm = (segment + kNodes[k]) * spacing_mm;
      nodes_.push_back({spline.basis(s_mm), s_mm, kWeights[k] * spacing_mm, curvature_per_mm(s_mm),
                        2 * segment + (kNodes[k] > 0.5 ? 1 : 0)});
    }
  }
  weights_.assign(nodes_.size(), 1);
}

double RestHook::curvature_per_mm(double s_mm) const {
  return curve_.turn_rad(s_mm - kEdge_mm / 2, s_mm + kEdge_mm / 2) / kEdge_mm;
}

void RestHook::weigh(double bending_q_per_mm, const Eigen::VectorXd& factors) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    weights_[i] = nodes_[i].length_mm / (bending_q_per_mm * kSoftness * factors[nodes_[i].bending_node]);
  }
}

Eigen::Vector3d RestHook::fitted_binormal(const Eigen::Matrix3Xd& C) const {
  Eigen::Vector3d binormal = binormal_;
  // r = sqrt(w) (zeta'' - kappa0 b x zeta') = sqrt(w) (zeta'' + kappa0 [zeta']x b) is linear in b.
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    const Eigen::Matrix3d by_b =
        node.curvature_per_mm * cross_with(combine(C, node.basis.first, node.basis.first_derivative));
    information.noalias() += weights_[i] * by_b.transpose() * by_b;
    pull.noalias() -=
        weights_[i] * by_b.transpose() * combine(C, node.basis.first, node.basis.second_derivative);
  }
  const Eigen::Vector3d tangent = combine(C, beginning_.first, beginning_.first_derivative);
  information.noalias() += tangent * tangent.transpose() / (kSigmaOfPlane * kSigmaOfPlane);
  for (int round = 0; round < kRounds; ++round) {
    // (|b| - 1) / sigma, linearised at b: its gradient is b / |b|.
    const double opening = std::max(binormal.norm(), kMinOpening);
    const Eigen::Vector3d outward = binormal / opening;
    constexpr double kWeight = 1 / (kSigmaOfOpening * kSigmaOfOpening);
    const Eigen::Matrix3d all = information + kWeight * outward * outward.transpose();
    const Eigen::LLT<Eigen::Matrix3d> factored(all);
    if (factored.info() != Eigen::Success) {
      break;
    }
    binormal = factored.solve(pull + kWeight * outward);
  }
  return binormal;
}

}  // namespace tubed
