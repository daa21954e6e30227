// A tube whose tip leaves its plane, to either side, and whose image is the same.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace tubed {

/// The arc laid flat, whose tip leaves its plane at the second coil: to the side of the camera (-1) or away
/// from it (1), ever steeper. Arc length from the tip, unit speed; its image does not depend on the side.
class TiltedTip {
 public:
  static constexpr double kLoose_mm = 90;  ///< its tip, without a coil

  explicit TiltedTip(double side) {
    constexpr double kSteepest = 0.7;  // sine
    Eigen::Vector3d p_world_mm(-60, -60, 0);
    double heading = 0;
    points_.resize(static_cast<std::size_t>(380 / kStep_mm) + 1);
    for (std::size_t i = points_.size(); i-- > 0;) {
      const double s_mm = static_cast<double>(i) * kStep_mm;
      points_[i] = p_world_mm;
      const double steep = s_mm < kLoose_mm ? kSteepest * (1 - s_mm / kLoose_mm) : 0;
      const double flat = std::sqrt(1 - steep * steep);
      heading += flat * kStep_mm / 120;
      p_world_mm +=
          kStep_mm * Eigen::Vector3d(-flat * std::cos(heading), flat * std::sin(heading), side * steep);
    }
  }
  [[nodiscard]] Eigen::Vector3d point(double s_mm) const {
    const auto i = static_cast<std::size_t>(std::lround(std::clamp(s_mm, 0.0, 380.0) / kStep_mm));
    return points_[i] - points_[static_cast<std::size_t>(80 / kStep_mm)];
  }
  [[nodiscard]] Eigen::Vector3d tangent_to_tip(double s_mm) const {
    return (point(s_mm - 1) - point(s_mm + 1)).normalized();
  }

 private:
  static constexpr double kStep_mm = 0.25;
  std::vector<Eigen::Vector3d> points_;
};

}  // namespace tubed
