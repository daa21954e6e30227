// Driver "v4l2": a fluoroscope's signal at a capture card or USB grabber (Video4Linux).
#pragma once

#include <memory>
#include <string>

#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// This driver as the registry has it.
DriverDescription v4l2_driver();

/// The card at `device` for a camera of these delivered pictures.
std::unique_ptr<ImageSource> make_v4l2_image_source(const CameraCalibration& camera,
                                                    const DriverSettings& settings,
                                                    const std::string& device);

}  // namespace tubed
