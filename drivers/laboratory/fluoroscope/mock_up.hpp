// A silicone mock-up of an aorta in air, as such models stand on a laboratory's table.
#pragma once

#include "drivers/laboratory/fluoroscope/attenuation_volume.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"

namespace tubed {

/// A tube with a wall of 2.5 mm of silicone along `aorta`, filled with water, nothing around it; voxels
/// of 1.25 mm, attenuation at about 65 keV. The branches are left out. Room frame as in make_thorax(). Throws
/// std::invalid_argument for a course without points or with another number of radii.
AttenuationVolume make_mock_up(const VesselCourse& aorta);

}  // namespace tubed
