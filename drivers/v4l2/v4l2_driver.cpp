#include "drivers/v4l2/v4l2_driver.hpp"

#include "drivers/v4l2/linux_video_device.hpp"
#include "drivers/v4l2/v4l2_image_source.hpp"
#include "drivers/v4l2/v4l2_settings.hpp"

namespace tubed {

DriverDescription v4l2_driver() {
  DriverDescription driver{"v4l2",
                           "a capture card or USB grabber at /dev/video0, camera.device",
                           Origin::kDevice,
                           v4l2_settings(),
                           {},
                           [](const SourceContext& context, int camera_index) {
                             return make_v4l2_image_source(
                                 context.room.cameras.at(static_cast<std::size_t>(camera_index)),
                                 context.settings, context.device);
                           }};
  driver.needs_device = true;
  driver.deliver_camera = deliver_camera;
  return driver;
}

std::unique_ptr<ImageSource> make_v4l2_image_source(const CameraCalibration& camera,
                                                    const DriverSettings& settings,
                                                    const std::string& device) {
  V4l2Settings asked = v4l2_settings_of(settings);
  asked.request.path = device;
  return std::make_unique<V4l2ImageSource>(camera, asked, std::make_unique<LinuxVideoDevice>());
}

}  // namespace tubed
