// What an image line says to a solver.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "daemon/image/seen_tube.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// An image line as a residual: the projected point at s has to lie on the line through `target_px` normal to
/// `normal`, within `variance_px2`.
struct LineConstraint {
  double s_mm = 0;
  Eigen::Vector2d target_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double variance_px2 = 1;
};

/// Line constraints of one camera; a view into memory of the caller.
struct ViewConstraints {
  const Camera* camera = nullptr;
  const LineConstraint* lines = nullptr;
  int count = 0;
  PoseSigma pose_sigma{};  ///< of the camera: an error that all its lines share
  /// Where the greys along the tube step, at s = 0: nothing for a solver, which has the end of the ridge
  /// among its lines, but for whoever compares coils and image. Nothing where they do not step.
  std::optional<LineConstraint> end_by_greys{};
  const SeenTube* seen = nullptr;  ///< along which stretches the image shows the tube; nullptr: nobody asked

  static constexpr double kNearest_mm = 5;
  /// Is a line within kNearest_mm of the place s along the tube?
  [[nodiscard]] bool shows(double s_mm) const {
    return std::any_of(lines, lines + count, [s_mm](const LineConstraint& line) {
      return std::abs(line.s_mm - s_mm) <= kNearest_mm;
    });
  }
};

}  // namespace tubed
