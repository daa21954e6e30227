#include "daemon/estimator/paper/paper_gap_cubics.hpp"

#include <algorithm>
#include <cmath>

#include "idl/geometry/precondition.hpp"

namespace tubed {

namespace {

const double kGaussOffset = 0.5 / std::sqrt(3.0);  // two-point Gauss-Legendre on [0, 1] around 0.5

}  // namespace

GapCubics::GapCubics(std::vector<double> nodes_s_mm) : s_mm_(std::move(nodes_s_mm)) {
  require(s_mm_.size() >= 2, "cubics between coils need at least two coils");
  for (std::size_t i = 1; i < s_mm_.size(); ++i) {
    require(s_mm_[i] > s_mm_[i - 1], "coils must stand in order from the tip");
  }
}

GapBasis GapCubics::basis(double s_mm) const {
  GapBasis basis;
  const auto after = std::upper_bound(s_mm_.begin() + 1, s_mm_.end() - 1, s_mm);
  basis.gap = static_cast<int>(after - s_mm_.begin()) - 1;
  const double from = *(after - 1);
  const double h = *after - from;
  const double t = (s_mm - from) / h;
  basis.value = {(1 + 2 * t) * (1 - t) * (1 - t), h * t * (1 - t) * (1 - t), t * t * (3 - 2 * t),
                 h * t * t * (t - 1)};
  basis.first_derivative = {6 * t * (t - 1) / h, (1 - t) * (1 - 3 * t), 6 * t * (1 - t) / h, t * (3 * t - 2)};
  basis.second_derivative = {(12 * t - 6) / (h * h), (6 * t - 4) / h, (6 - 12 * t) / (h * h),
                             (6 * t - 2) / h};
  return basis;
}

Eigen::MatrixXd GapCubics::bending(double length_mm) const {
  std::vector<double> ends = s_mm_;
  ends.front() = std::min(0.0, ends.front());
  ends.back() = std::max(length_mm, ends.back());
  Eigen::MatrixXd G = Eigen::MatrixXd::Zero(2 * node_count(), 2 * node_count());
  for (std::size_t gap = 0; gap + 1 < ends.size(); ++gap) {
    const double h = ends[gap + 1] - ends[gap];
    for (const double place : {0.5 - kGaussOffset, 0.5 + kGaussOffset}) {
      const GapBasis at = basis(ends[gap] + place * h);
      const Eigen::Map<const Eigen::Vector4d> weights(at.second_derivative.data());
      G.block<4, 4>(2 * at.gap, 2 * at.gap) += h / 2 * weights * weights.transpose();
    }
  }
  return G;
}

}  // namespace tubed
