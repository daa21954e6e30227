// The curve of a simulated catheter: circular arcs, parametrised by arc length from the tip.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <utility>

namespace tubed {

/// Where the catheter is at one arc length, and its unit tangent toward the tip.
struct ShapePoint {
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d tangent_world = Eigen::Vector3d::UnitZ();
};

/// The smooth curve that a chain of nodes stands for: around each node an arc that touches both of its edges,
/// `spacing_mm` long; half a spacing at the tip is straight. So the curve has the material's length, whatever
/// its bends, and its tangent is continuous. Nodes of a chain whose edges have the lengths that
/// half_edge_mm() gives join without gap. Immutable, callable from any thread, at() never allocates.
class CatheterShape {
 public:
  CatheterShape() = default;
  /// `nodes_world_mm`: 3 x n, tip first, n >= 3.
  CatheterShape(Eigen::Matrix3Xd nodes_world_mm, double spacing_mm)
      : nodes_(std::move(nodes_world_mm)), spacing_mm_(spacing_mm) {}

  /// `s_mm` from the tip; below 0 and beyond the last arc the curve goes straight on.
  [[nodiscard]] ShapePoint at(double s_mm) const;
  [[nodiscard]] double length_mm() const { return spacing_mm_ * (static_cast<double>(nodes_.cols()) - 1.5); }
  [[nodiscard]] const Eigen::Matrix3Xd& nodes_world_mm() const { return nodes_; }
  [[nodiscard]] double spacing_mm() const { return spacing_mm_; }

  /// From a node to where its arc touches the edge, for edges that turn by `turn_rad` there: the arc is
  /// `spacing_mm` long.
  static double half_edge_mm(double turn_rad, double spacing_mm) {
    const double half = turn_rad / 2;
    return half < 1e-6 ? spacing_mm / 2 : spacing_mm / 2 * std::tan(half) / half;
  }

 private:
  Eigen::Matrix3Xd nodes_;
  double spacing_mm_ = 1;
};

}  // namespace tubed
