// A phantom of steel balls at known places: what a fluoroscope is calibrated with.
//
//   format = 1
//   name = "helix-40"
//   T_world_phantom = [[1, 0, 0, 0], ...]   # may be left out: the phantom's frame is the world then
//   balls = [                               # name, x, y, z, diameter: mm, in the phantom's frame
//     ["L1", 70.0, 0.0, -70.0, 4.0],
//     ...
//   ]
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "clients/calibration/calibration_picture.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

struct PhantomBall {
  std::string name;
  Eigen::Vector3d p_phantom_mm;
  double diameter_mm = 0;
};

struct BallPhantom {
  std::string name;
  std::vector<PhantomBall> balls;
  RigidTransform T_world_phantom = RigidTransform::Identity();

  [[nodiscard]] Eigen::Vector3d p_world_mm(std::size_t ball) const {
    return T_world_phantom * balls[ball].p_phantom_mm;
  }
  /// Standard deviation of the balls' places along the phantom's three principal axes, largest first.
  [[nodiscard]] Eigen::Vector3d extents_mm() const;
  /// All balls in one plane, to 2 % of the phantom's size.
  [[nodiscard]] bool is_plane() const;
};

/// Reads a phantom's file. Throws PhantomError with file and ball: no TOML, fewer than 6 balls, one named
/// or placed twice, a ball within another, a size that is none in mm (metres, inches), a T_world_phantom that
/// is no rigid transform.
BallPhantom read_ball_phantom(const std::filesystem::path& file);
/// The same from text; `file` names it in messages.
BallPhantom parse_ball_phantom(std::string_view text, const std::string& file);

/// As read_ball_phantom() reads it.
std::string to_toml(const BallPhantom& phantom);

/// 12 large balls (4 mm) and 32 small ones (2 mm) on a helix of three turns around z, radius 65 mm, height
/// 150 mm. The large ones stand at uneven steps, so that no turn of the phantom and no mirror image of it
/// looks like itself.
BallPhantom helix_phantom();

}  // namespace tubed
