#include "drivers/laboratory/fluoroscope/thorax.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "drivers/laboratory/fluoroscope/thorax_parts.hpp"

namespace tubed {

VesselCourse mean_aorta() {
  // Centreline (x, y, z) and radius, from the bifurcation to the valve.
  Eigen::Matrix<double, 4, 24> points;
  points.transpose() << -25.9, -43.5, -363, 6.7, -25.8, -43.1, -343, 9, -25.5, -42.2, -323, 9, -25, -40.6,
      -303, 9, -24.3, -38.4, -283, 9, -23.4, -35.5, -263, 9.5, -22.3, -32, -244, 10.6, -21.1, -27.9, -224,
      11.6, -19.5, -23.3, -205, 12.2, -17.1, -18.6, -185, 12.2, -13.7, -13.9, -166, 12.2, -9.4, -9.2, -147,
      12.2, -4.2, -4.6, -129, 12.2, 1.9, -0.1, -110, 12.3, 7.8, 4.3, -91.5, 12.3, 12.9, 8.3, -72.6, 12.3,
      17.2, 12, -53.4, 12.3, 20.6, 15.4, -34, 12.3, 23.1, 18.4, -14.4, 12.3, 22.4, 19.5, 5.3, 12.7, 13.3,
      14.8, 22.2, 13.2, -1.5, 4.5, 30, 13.8, -15.8, -8.1, 25.1, 14.3, -23.4, -18.7, 10.4, 14.8;
  Eigen::Matrix<double, 4, 28> whole;
  whole.leftCols<24>() = points;
  whole.col(24) << -25.8, -26.2, -8, 15.3;
  whole.col(25) << -27.6, -32.3, -27, 14.8;
  whole.col(26) << -28.8, -37, -46.4, 14;
  whole.col(27) << -29.6, -40.2, -62, 13;
  return {whole.topRows<3>(), whole.row(3).transpose()};
}

AttenuationVolume make_thorax(const ThoraxSettings& settings) {
  if (!(settings.spacing_mm >= 0.5 && settings.spacing_mm <= 5)) {
    throw std::invalid_argument("thorax: spacing_mm is " + std::to_string(settings.spacing_mm) +
                                ", has to be 0.5 to 5");
  }
  if (!(settings.z_high_room_mm - settings.z_low_room_mm >= 2 * settings.spacing_mm &&
        settings.z_high_room_mm - settings.z_low_room_mm <= 2000)) {
    throw std::invalid_argument("thorax: z_low_room_mm has to be below z_high_room_mm, by at most 2000");
  }
  if (settings.aorta.centreline_room_mm.cols() != settings.aorta.radius_mm.size()) {
    throw std::invalid_argument("thorax: the aorta needs as many radii as points");
  }
  const Eigen::Vector3d low(-195, -165, settings.z_low_room_mm);
  const Eigen::Vector3d high(165, 125, settings.z_high_room_mm);
  RigidTransform T_room_volume = RigidTransform::Identity();
  T_room_volume.translation() = low;
  const Eigen::Vector3i size = ((high - low) / settings.spacing_mm).array().ceil().cast<int>() + 1;
  AttenuationVolume volume(size, Eigen::Vector3d::Constant(settings.spacing_mm), T_room_volume);

  const TissueTexture texture(settings.seed);
  VolumePainter painter(volume);
  paint_soft_tissue(volume, texture);
  paint_gas(painter, settings.seed);
  paint_heart(painter, texture);
  paint_great_vessels(painter, settings.aorta);
  paint_lung_vessels(painter, settings.seed);
  paint_airways(painter);
  paint_ribs(painter);
  paint_sternum_and_girdle(painter);
  paint_spine(painter, texture);
  return volume;
}

}  // namespace tubed
