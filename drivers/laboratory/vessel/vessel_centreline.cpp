#include "drivers/laboratory/vessel/vessel_centreline.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace tubed {

VesselCentreline::VesselCentreline(const Eigen::Vector3d& start_mm, const Eigen::Vector3d& tangent,
                                   const Eigen::Vector3d& normal, const std::vector<VesselPiece>& pieces) {
  VesselPoint end{start_mm, tangent};
  Eigen::Vector3d carried_normal = normal;
  double u_mm = 0;
  for (const VesselPiece& piece : pieces) {
    const Eigen::Vector3d binormal = end.tangent_world.cross(carried_normal);
    const Eigen::Vector3d toward_centre =
        std::cos(piece.bend_direction_rad) * carried_normal + std::sin(piece.bend_direction_rad) * binormal;
    pieces_.push_back({u_mm, piece.curvature_per_mm, end.p_world_mm, end.tangent_world, toward_centre});

    const Eigen::Vector3d axis = end.tangent_world.cross(toward_centre);
    carried_normal = Eigen::AngleAxisd(piece.curvature_per_mm * piece.length_mm, axis) * carried_normal;
    end = along(pieces_.back(), piece.length_mm);
    u_mm += piece.length_mm;
  }
  pieces_.push_back({u_mm, 0, end.p_world_mm, end.tangent_world, carried_normal});
}

VesselPoint VesselCentreline::at(double u_mm) const {
  if (u_mm < 0) {
    const PlacedPiece& first = pieces_.front();
    return {first.start_mm + u_mm * first.tangent, first.tangent};
  }
  std::size_t piece = 0;
  while (piece + 1 < pieces_.size() && pieces_[piece + 1].u_start_mm <= u_mm) {
    ++piece;
  }
  return along(pieces_[piece], u_mm - pieces_[piece].u_start_mm);
}

VesselPoint VesselCentreline::along(const PlacedPiece& piece, double length_mm) {
  const double curvature = piece.curvature_per_mm;
  if (curvature == 0) {
    return {piece.start_mm + length_mm * piece.tangent, piece.tangent};
  }
  const double angle = curvature * length_mm;
  return {piece.start_mm + std::sin(angle) / curvature * piece.tangent +
              (1 - std::cos(angle)) / curvature * piece.toward_centre,
          std::cos(angle) * piece.tangent + std::sin(angle) * piece.toward_centre};
}

}  // namespace tubed
