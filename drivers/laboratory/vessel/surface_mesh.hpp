// A closed triangle surface, and how far points are from it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "drivers/laboratory/vessel/wall_field.hpp"

namespace tubed {

/// Triangles over shared corners, counter-clockwise seen from outside.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> corners_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// Enclosed volume, mm^3; negative for triangles that run clockwise.
  [[nodiscard]] double volume_mm3() const;
};

/// Reads STL, ASCII or binary; corners that are equal to the last bit are one. Throws std::invalid_argument
/// for what cannot be read.
SurfaceMesh read_stl(const std::filesystem::path& file);

/// Throws std::invalid_argument, its text beginning with `name`, unless the surface is closed, of one piece
/// and of a size that can be a vessel in mm. Turns triangles that all run the wrong way round.
void check_lumen(SurfaceMesh& mesh, const std::string& name);

/// Signed distances from the surface, positive inside, on a grid. Precondition: check_lumen() passed.
WallField wall_of(const SurfaceMesh& mesh, double spacing_mm = 1.5);

}  // namespace tubed
