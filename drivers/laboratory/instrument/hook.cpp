#include "drivers/laboratory/instrument/hook.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "drivers/laboratory/instrument/catheter_shape.hpp"

namespace tubed {

namespace {

Eigen::Vector3d edge_of(const Eigen::Matrix3Xd& nodes, Eigen::Index edge) {
  return (nodes.col(edge) - nodes.col(edge + 1)).normalized();
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

Eigen::Matrix3Xd with_hook(const Eigen::Matrix3Xd& nodes_world_mm, double spacing_mm, const Hook& hook,
                           const Eigen::Matrix3Xd& toward) {
  Eigen::Matrix3Xd nodes = nodes_world_mm;
  Eigen::Index last = 0;  // node that the hook turns
  while (last + 2 < nodes.cols() && (static_cast<double>(last) + 0.5) * spacing_mm < hook.length_mm()) {
    ++last;
  }
  if (last == 0) {
    return nodes;
  }
  // The arc around a node begins half_edge_mm() behind it: of the last one that place stays.
  Eigen::Vector3d behind = edge_of(nodes_world_mm, last);
  const double turned_before = angle_between(edge_of(nodes_world_mm, last - 1), behind);
  Eigen::Vector3d begin =
      nodes_world_mm.col(last) - CatheterShape::half_edge_mm(turned_before, spacing_mm) * behind;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();  // from the chain's frame to the hook's
  for (Eigen::Index node = last; node >= 1; --node) {
    // The circle's turn, about the chain's own binormal at the edge behind the node, comes before the
    // chain's.
    const Eigen::Vector3d chain_behind = edge_of(nodes_world_mm, node);
    const Eigen::Vector3d axis = chain_behind.cross(Eigen::Vector3d(toward.col(node)));
    turn = turn * Eigen::AngleAxisd(hook.turn_rad(static_cast<double>(node) * spacing_mm, spacing_mm), axis)
                      .toRotationMatrix();
    const Eigen::Vector3d ahead = turn * edge_of(nodes_world_mm, node - 1);
    const double half_mm = CatheterShape::half_edge_mm(angle_between(ahead, behind), spacing_mm);
    nodes.col(node) = begin + half_mm * behind;
    begin = nodes.col(node) + half_mm * ahead;
    behind = ahead;
  }
  nodes.col(0) = begin + spacing_mm / 2 * behind;
  return nodes;
}

}  // namespace tubed
