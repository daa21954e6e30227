#include "drivers/laboratory/fluoroscope/volume_painter.hpp"

#include "drivers/laboratory/fluoroscope/thorax_anatomy.hpp"

namespace tubed {

double distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d edge = b - a;
  const double length_squared = edge.squaredNorm();
  const double part = length_squared > 0 ? std::clamp((p - a).dot(edge) / length_squared, 0.0, 1.0) : 0.0;
  return (p - a - part * edge).norm();
}

void VolumePainter::capsule(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius,
                            float attenuation) {
  const double reach = radius + spacing_;
  fill(a.cwiseMin(b).array() - reach, a.cwiseMax(b).array() + reach, [&](const Eigen::Vector3d& p, float) {
    return std::pair(distance_to_segment(p, a, b) - radius, attenuation);
  });
}

void VolumePainter::bone(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, double cortex) {
  const double reach = radius + spacing_;
  fill(a.cwiseMin(b).array() - reach, a.cwiseMax(b).array() + reach, [&](const Eigen::Vector3d& p, float) {
    const double outside = distance_to_segment(p, a, b) - radius;
    const auto inside = static_cast<float>(std::clamp(0.5 - (outside + cortex) / spacing_, 0.0, 1.0));
    return std::pair(outside, anatomy::kCortical + inside * (anatomy::kMarrow - anatomy::kCortical));
  });
}

void VolumePainter::ellipsoid(const Eigen::Vector3d& centre, const Eigen::Vector3d& radii,
                              const Eigen::Matrix3d& axes, float attenuation) {
  const Eigen::Vector3d reach = ((axes * radii.asDiagonal()).rowwise().norm().array() + spacing_).matrix();
  fill(centre - reach, centre + reach, [&](const Eigen::Vector3d& p, float) {
    const Eigen::Vector3d local = axes.transpose() * (p - centre);
    return std::pair(distance_to_ellipsoid<Eigen::Vector3d>(local, radii), attenuation);
  });
}

}  // namespace tubed
