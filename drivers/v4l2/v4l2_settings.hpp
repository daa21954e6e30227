// The keys of the table [v4l2], and what they come to.
#pragma once

#include <string>
#include <vector>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/v4l2/card_stream.hpp"
#include "drivers/v4l2/grey_levels.hpp"
#include "drivers/v4l2/picture_shape.hpp"

namespace tubed {

struct V4l2Settings {
  CardRequest request;  ///< its path aside
  PictureShape shape;
  GreyCoding coding;
  std::chrono::nanoseconds held_after{};  ///< 0: every picture is taken for an exposure
  double held_noise_levels = 0.1;         ///< see HeldPictures
  bool camera_is_of_the_card = true;      ///< [[camera]] describes the card's picture, not the delivered one
};

std::vector<KeyDescription> v4l2_settings();

V4l2Settings v4l2_settings_of(const DriverSettings& settings);

/// Why the lists among them have another length than they need, in words; empty: they have not.
std::string fault_of(const DriverSettings& settings);

/// From what a file says of a camera to the camera of the delivered pictures, which it becomes; the size that
/// is asked of the card is added to `settings` where it follows. Why they do not go together, in words for
/// the file's message; empty: they do.
std::string deliver_camera(CameraCalibration& camera, DriverSettings& settings);

}  // namespace tubed
