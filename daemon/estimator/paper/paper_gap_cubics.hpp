// Assumption (ii) of Sec. 2.2.1: one cubic a gap between two successive coils.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace tubed {

/// Weights of the two ends of a gap in the curve at one s: value and derivative there.
struct GapBasis {
  int gap = 0;                               ///< between nodes gap and gap + 1
  std::array<double, 4> value{};             ///< of q_gap, v_gap, q_gap+1, v_gap+1
  std::array<double, 4> first_derivative{};  ///< by s
  std::array<double, 4> second_derivative{};
};

/// A piecewise cubic curve over arc length from the tip, by its points q and derivatives v at nodes: once
/// continuously differentiable. Beyond the first and the last node the end cubics go on. Nodes' columns are q
/// and v in turn: q_0 v_0 q_1 v_1 ...
class GapCubics {
 public:
  /// Precondition: at least 2 nodes, rising.
  explicit GapCubics(std::vector<double> nodes_s_mm);

  [[nodiscard]] GapBasis basis(double s_mm) const;
  [[nodiscard]] int node_count() const { return static_cast<int>(s_mm_.size()); }
  [[nodiscard]] double node_s_mm(int node) const { return s_mm_[static_cast<std::size_t>(node)]; }

  /// The integral of the products of second derivatives over [0, length_mm], (2 m) x (2 m) for m nodes:
  /// Eq. (13) of one coordinate is x' G x. Exact.
  [[nodiscard]] Eigen::MatrixXd bending(double length_mm) const;

 private:
  std::vector<double> s_mm_;
};

/// sum of weights times the four columns of the basis's gap; `nodes` has 2 m columns.
template <typename Nodes>
auto combine(const Nodes& nodes, const GapBasis& basis, const std::array<double, 4>& weights) {
  const int first = 2 * basis.gap;
  return (nodes.col(first) * weights[0] + nodes.col(first + 1) * weights[1] +
          nodes.col(first + 2) * weights[2] + nodes.col(first + 3) * weights[3])
      .eval();
}

}  // namespace tubed
