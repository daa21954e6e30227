// The door of the image half: what cannot be an X-ray image is refused before it is measured.
#pragma once

#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// Copies the pixels of `frame` into `measurement.grey` (reserved for the camera's size) and says whether
/// they can be used: size as configured, not all black (spread below 1 grey level of 8 bit at the bottom),
/// not saturated (more than half at the top). `previous_sum` carries a sum over the previous image to find
/// bit-equal repeats; it is updated. Never allocates.
ImageRejection take_image(const ImageFrame& frame, ImageMeasurement& measurement,
                          std::uint64_t& previous_sum);

}  // namespace tubed
