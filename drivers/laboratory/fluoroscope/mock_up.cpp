#include "drivers/laboratory/fluoroscope/mock_up.hpp"

#include <algorithm>
#include <stdexcept>

#include "drivers/laboratory/fluoroscope/volume_painter.hpp"

namespace tubed {

namespace {

constexpr double kWall_mm = 2.5;
constexpr double kSpacing_mm = 1.25;
constexpr Eigen::Index kStep = 3;  ///< of the course's points, about a millimetre apart
constexpr double kLow_mm = -330;   ///< what lies below no view of the arch sees
/// 1/mm: NIST XCOM, water 0.0201 at 65 keV; silicone rubber of 1.1 g/cm3.
constexpr float kWater = 0.0201F;
constexpr float kSilicone = 0.0240F;

void paint_tube(VolumePainter& painter, const VesselCourse& course, double more_mm, float attenuation) {
  const Eigen::Index last = course.radius_mm.size() - 1;
  for (Eigen::Index i = 0; i < last; i += kStep) {
    const Eigen::Index next = std::min(i + kStep, last);
    const Eigen::Vector3d a = course.centreline_room_mm.col(i);
    const Eigen::Vector3d b = course.centreline_room_mm.col(next);
    if (std::max(a.z(), b.z()) < kLow_mm) continue;
    painter.capsule(a, b, (course.radius_mm[i] + course.radius_mm[next]) / 2 + more_mm, attenuation);
  }
}

}  // namespace

AttenuationVolume make_mock_up(const VesselCourse& aorta) {
  if (aorta.radius_mm.size() < 2 || aorta.centreline_room_mm.cols() != aorta.radius_mm.size()) {
    throw std::invalid_argument("mock-up: the aorta needs two points or more, and as many radii");
  }
  const Eigen::Array3d margin_mm = Eigen::Array3d::Constant(aorta.radius_mm.maxCoeff() + 2 * kWall_mm);
  Eigen::Vector3d low = aorta.centreline_room_mm.rowwise().minCoeff().array() - margin_mm;
  const Eigen::Vector3d high = aorta.centreline_room_mm.rowwise().maxCoeff().array() + margin_mm;
  low.z() = std::max(low.z(), kLow_mm);
  RigidTransform T_room_volume = RigidTransform::Identity();
  T_room_volume.translation() = low;
  const Eigen::Vector3i size = ((high - low) / kSpacing_mm).array().ceil().cast<int>() + 1;
  AttenuationVolume volume(size, Eigen::Vector3d::Constant(kSpacing_mm), T_room_volume);
  VolumePainter painter(volume);
  paint_tube(painter, aorta, kWall_mm, kSilicone);
  paint_tube(painter, aorta, 0, kWater);
  return volume;
}

}  // namespace tubed
