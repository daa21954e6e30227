#include "drivers/laboratory/fluoroscope/pixel_rays.hpp"

#include <stdexcept>

namespace tubed {

PixelRays::PixelRays(const CameraCalibration& calibration)
    : camera_(calibration),
      width_(calibration.width),
      height_(calibration.height),
      source_room_mm_(calibration.T_camera_world.inverse().translation()),
      R_room_camera_(calibration.T_camera_world.inverse().linear()),
      pixel_slope_(1 / calibration.fx, 1 / calibration.fy) {
  if (width_ < 1 || height_ < 1) {
    throw std::invalid_argument("radiograph: camera \"" + calibration.name + "\" has no pixels");
  }
  if (!(calibration.fx > 0 && calibration.fy > 0)) {
    throw std::invalid_argument("radiograph: camera \"" + calibration.name +
                                "\" needs focal lengths above 0 px");
  }
  slopes_.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      slopes_.emplace_back(camera_.ray_camera({x, y}).head<2>().cast<float>());
    }
  }
}

}  // namespace tubed
