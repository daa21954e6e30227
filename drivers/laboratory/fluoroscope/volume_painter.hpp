// Shapes into voxels, with soft borders.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"

namespace tubed {

/// Paints into a volume whose axes are the room's. A shape is a signed distance in mm, negative inside; a
/// voxel that its border crosses is mixed.
class VolumePainter {
 public:
  explicit VolumePainter(AttenuationVolume& volume)
      : volume_(volume), origin_(volume.T_room_volume().translation()), spacing_(volume.spacing_mm().x()) {}

  /// Mixes into every voxel of the box between `low` and `high` (room frame, mm) what `paint(p, was)` says:
  /// {signed distance, attenuation}, given the voxel's centre and the attenuation that was there.
  template <class Paint>
  void fill(const Eigen::Vector3d& low, const Eigen::Vector3d& high, Paint paint) {
    const Eigen::Vector3d last = (volume_.size() - Eigen::Vector3i::Ones()).cast<double>();
    const Eigen::Vector3i from = index(low).cwiseMax(0).cwiseMin(last).array().floor().cast<int>();
    const Eigen::Vector3i to = index(high).cwiseMax(-1).cwiseMin(last).array().floor().cast<int>();
    for (int k = from.z(); k <= to.z(); ++k) {
      for (int j = from.y(); j <= to.y(); ++j) {
        for (int i = from.x(); i <= to.x(); ++i) {
          const float was = volume_.at(i, j, k);
          const std::pair<double, float> stroke = paint(centre(i, j, k), was);
          const double covered = std::clamp(0.5 - stroke.first / spacing_, 0.0, 1.0);
          if (covered > 0) {
            volume_.set(i, j, k, was + static_cast<float>(covered) * (stroke.second - was));
          }
        }
      }
    }
  }

  /// A cylinder with round ends.
  void capsule(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, float attenuation);
  /// A capsule of cortical bone with marrow inside.
  void bone(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, double cortex);
  /// An ellipsoid with half axes `radii` along the columns of `axes`.
  void ellipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& radii, const Eigen::Matrix3d& axes,
                 float attenuation);
  void ellipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& radii, float attenuation) {
    ellipsoid(centre, radii, Eigen::Matrix3d::Identity(), attenuation);
  }

  [[nodiscard]] Eigen::Vector3d centre(int i, int j, int k) const {
    return origin_ + spacing_ * Eigen::Vector3d(i, j, k);
  }

 private:
  [[nodiscard]] Eigen::Vector3d index(const Eigen::Vector3d& p) const { return (p - origin_) / spacing_; }

  AttenuationVolume& volume_;
  Eigen::Vector3d origin_;
  double spacing_;
};

/// From p to the segment a b, mm.
double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b);
/// Signed distance to an ellipse or ellipsoid, exact on its border: `scaled` are the coordinates over the
/// half axes, `steepness` the same over their squares.
template <class Vector>
double distance_to_ellipsoid(const Vector& p, const Vector& radii) {
  const double q = p.cwiseQuotient(radii).norm();
  const double steepness = p.cwiseQuotient(radii).cwiseQuotient(radii).norm();
  return steepness > 1e-9 ? q * (q - 1) / steepness : -radii.minCoeff();
}

}  // namespace tubed
