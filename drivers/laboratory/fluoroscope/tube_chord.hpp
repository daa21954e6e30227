// The part of a ray that runs inside a piece of a tube.
#pragma once

#include <Eigen/Core>

namespace tubed {

/// A straight piece of a swept tube: an endless cylinder about `p` along `tangent`, cut by a plane at either
/// end. With mitre planes (normals halfway between neighbouring tangents) the pieces of a bent tube meet
/// without gap or overlap, so that their chords add up. Any frame, mm; tangent and normals are unit vectors.
struct TubePiece {
  Eigen::Vector3d begin = Eigen::Vector3d::Zero();
  Eigen::Vector3d end = Eigen::Vector3d::Zero();
  Eigen::Vector3d tangent = Eigen::Vector3d::UnitX();
  Eigen::Vector3d begin_normal = Eigen::Vector3d::UnitX();  ///< into the piece
  Eigen::Vector3d end_normal = Eigen::Vector3d::UnitX();    ///< out of it
};

/// Length, mm, of the ray from the origin along the unit vector `direction` inside `piece` of `radius_mm`.
/// Exact.
double chord_mm(const TubePiece& piece, double radius_mm, const Eigen::Vector3d& direction);

}  // namespace tubed
