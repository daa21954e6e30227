#include "bench/grab/consumers.hpp"

#include <stdexcept>

#include "drivers/interface/condition.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/v4l2/v4l2_driver.hpp"
#include "drivers/v4l2/v4l2_settings.hpp"

namespace tubed {

const std::vector<Consumer>& consumers() {
  static const std::vector<Consumer> all{
      {"driver v4l2", "", read_by_driver},
#ifdef TUBED_BENCH_OPENCV_VIDEO
      {"OpenCV VideoCapture", "", read_by_opencv},
#else
      {"OpenCV VideoCapture", "libopencv-videoio-dev", nullptr},
#endif
#ifdef TUBED_BENCH_GSTREAMER
      {"GStreamer v4l2src", "", read_by_gstreamer},
#else
      {"GStreamer v4l2src", "libgstreamer1.0-dev libgstreamer-plugins-base1.0-dev gstreamer1.0-plugins-good",
       nullptr},
#endif
  };
  return all;
}

/// As the image grab stage does: waits, then reads into one frame.
void read_by_driver(const CardFormat& format, const OnPicture& on_picture) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& key : v4l2_settings()) values[key.name] = key.default_value;
  CameraCalibration camera;
  camera.name = "A";
  camera.width = format.width;
  camera.height = format.height;
  DriverSettings settings =
      DriverSettings(values).with("format", std::string(format.fourcc == "MJPG" ? "mjpg" : "y16"));
  if (const std::string fault = deliver_camera(camera, settings); !fault.empty())
    throw std::runtime_error(fault);
  const auto source = make_v4l2_image_source(camera, settings, format.device);
  ImageFrame frame;
  frame.reserve(format.width, format.height);
  source->open();
  const MonotonicTime give_up = monotonic_now() + std::chrono::seconds(10);
  for (bool has_any = false;;) {
    source->wait(monotonic_now() + std::chrono::milliseconds(100));
    if (source->read(frame) == ReadOutcome::kFrame) {
      has_any = true;
      const std::size_t bytes = static_cast<std::size_t>(frame.width) *
                                static_cast<std::size_t>(frame.height) *
                                (frame.depth == PixelDepth::kGrey8 ? 1 : 2);
      if (!on_picture(frame.pixels.data(), bytes)) return;
    } else if (!has_any && monotonic_now() > give_up) {
      auto* const has_condition = dynamic_cast<HasCondition*>(source.get());
      const SourceCondition condition =
          has_condition == nullptr ? SourceCondition{} : has_condition->condition();
      throw std::runtime_error("no picture within 10 s; it says: " + std::string(condition.words.text()));
    }
  }
}

}  // namespace tubed
