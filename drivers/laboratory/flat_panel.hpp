// A flat panel detector instead of what a console shows.
#pragma once

#include <string>
#include <string_view>

#include "drivers/laboratory/fluoroscope/radiograph_settings.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// What a simulated panel delivers, as words of 16 bits.
struct FlatPanel {
  DetectorReadout readout = DetectorReadout::kIntensity;
  int bits = 12;                ///< 9 .. 16
  double pixel_mm = 1.5 / 7.0;  ///< a pixel's side where the patient is, 0.05 .. 3: here 3 mm are 14 px
};

/// "linear,12,0.2" or "log,14,0.1": readout, bits, pixel_mm. Throws std::invalid_argument for anything else.
FlatPanel parse_panel(std::string_view words);

/// The same field of view in pixels of `pixel_mm` at the depth of what the camera looks at; of more than 2048
/// pixels a side the middle.
CameraCalibration with_pixels(const CameraCalibration& camera, double pixel_mm);

/// What RadiographSettings say in pixels and a pixel holds for such a panel, where they are meant for pixels
/// of 0.6 mm: blurs and blades are as wide in mm, the dose is the same, and electronic noise is such that
/// pixels averaged to 0.6 mm have that of one.
RadiographSettings with_panel(RadiographSettings settings, const FlatPanel& panel);

}  // namespace tubed
