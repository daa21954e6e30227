// An adult's chest and upper abdomen, built from formulas: no patient's images are in it.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"

namespace tubed {

/// A blood vessel: a tube of points and radii.
struct VesselCourse {
  Eigen::Matrix3Xd centreline_room_mm;  ///< 3 x n
  Eigen::VectorXd radius_mm;            ///< n
};

/// The aorta of the mean patient from the iliac bifurcation over the arch to the valve.
VesselCourse mean_aorta();

struct ThoraxSettings {
  double spacing_mm = 1.25;  ///< of the voxels, 0.5 .. 5
  std::int64_t seed = 0;     ///< texture, lung vessels, bowel gas
  double z_low_room_mm = -400, z_high_room_mm = 150;
  VesselCourse aorta = mean_aorta();  ///< drawn into the chest; may be empty
};

/// Spine with vertebrae, ribs, sternum, clavicles, shoulder blades, lungs with vessels and airways, heart,
/// great vessels, diaphragm, liver, gas, chest wall, soft-tissue texture. Room frame: x toward the patient's
/// left, y posterior, z superior, origin at the centre of the aortic arch; axes of the volume are the room's.
/// Attenuation at about 65 keV. Takes a second or two; the same settings give the same voxels. Throws
/// std::invalid_argument for a spacing or an extent that cannot be.
AttenuationVolume make_thorax(const ThoraxSettings& settings = {});

}  // namespace tubed
