#include "drivers/laboratory/instrument/catheter_shape.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace tubed {

ShapePoint CatheterShape::at(double s_mm) const {
  const auto nearest = static_cast<Eigen::Index>(std::floor(s_mm / spacing_mm_ + 0.5));
  const Eigen::Index node = std::clamp<Eigen::Index>(nearest, 0, nodes_.cols() - 2);
  if (node == 0) {
    const Eigen::Vector3d tangent = (nodes_.col(0) - nodes_.col(1)).normalized();
    return {nodes_.col(0) - s_mm * tangent, tangent};
  }
  const Eigen::Vector3d tipward = (nodes_.col(node - 1) - nodes_.col(node)).normalized();
  const Eigen::Vector3d baseward = (nodes_.col(node) - nodes_.col(node + 1)).normalized();
  const double turn = std::atan2(tipward.cross(baseward).norm(), tipward.dot(baseward));
  const Eigen::Vector3d joint = nodes_.col(node) + half_edge_mm(turn, spacing_mm_) * tipward;
  const double along = s_mm - (static_cast<double>(node) - 0.5) * spacing_mm_;
  if (turn < 1e-9) {
    return {joint - along * tipward, tipward};
  }
  const double within = std::clamp(along, 0.0, spacing_mm_);
  const double angle = turn * within / spacing_mm_;
  const Eigen::Vector3d side = (baseward - std::cos(turn) * tipward) / std::sin(turn);
  const Eigen::Vector3d tangent = std::cos(angle) * tipward + std::sin(angle) * side;
  const double radius = spacing_mm_ / turn;
  const Eigen::Vector3d on_arc = joint - radius * (std::sin(angle) * tipward + (1 - std::cos(angle)) * side);
  return {on_arc - (along - within) * tangent, tangent};
}

}  // namespace tubed
