#include "clients/tubectl/run/grab_video.hpp"

#include <iostream>
#include <memory>
#include <stdexcept>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/v4l2/linux_video_device.hpp"
#include "drivers/v4l2/v4l2_image_source.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kBeat{50};
constexpr std::chrono::milliseconds kBetweenTries{200};

/// Each sentence once, until another one comes.
class Teller {
 public:
  void say(std::string_view words) {
    if (words != last_) {
      last_ = words;
      std::cerr << "tubectl: " << (words.empty() ? "pictures come" : printable_text(words)) << '\n';
    }
  }

 private:
  std::string last_;
};

class VideoGrab {
 public:
  VideoGrab(const VideoGrabArguments& arguments, const volatile std::sig_atomic_t& is_asked_to_end)
      : arguments_(arguments),
        is_asked_to_end_(is_asked_to_end),
        settings_(v4l2_settings_of(arguments.settings)) {
    settings_.request.path = arguments.device;
  }

  std::uint64_t run() {
    std::uint64_t written = 0;
    if (const PictureSize card = wait_for_card(); card.width > 0) {
      written = write_all(card);
    }
    return written;
  }

 private:
  [[nodiscard]] bool has_ended() const { return is_asked_to_end_ != 0 || monotonic_now() >= arguments_.end; }

  /// The size of its pictures; 0 x 0 when it did not come in time.
  PictureSize wait_for_card() {
    while (!has_ended()) {
      CardStream stream(std::make_unique<LinuxVideoDevice>(), settings_.request);
      if (stream.start()) {
        return stream.picture().size;
      }
      teller_.say(stream.trouble().text());
      const MonotonicTime next = monotonic_now() + kBetweenTries;
      sleep_until(next, next);
    }
    return {};
  }

  /// The camera of the daemon has this size from now on, and so has what is asked of the card.
  CameraCalibration camera_of(PictureSize card) {
    settings_.request.size = card;
    const PictureSize size = delivered_size(settings_.shape, card);
    if (size.width == 0) {
      throw std::runtime_error("--crop reaches beyond the card's " + std::string(describe(card).text()) +
                               " pixels");
    }
    CameraCalibration camera;
    camera.name = arguments_.camera;
    camera.width = size.width;
    camera.height = size.height;
    return camera;
  }

  std::uint64_t write_all(PictureSize card) {
    const CameraCalibration camera = camera_of(card);
    ShmImageWriter writer({.socket = arguments_.socket,
                           .camera = arguments_.camera,
                           .max_width = static_cast<std::uint32_t>(camera.width),
                           .max_height = static_cast<std::uint32_t>(camera.height),
                           .max_depth_bits = 16,
                           .group = arguments_.group});
    std::cerr << "tubectl: camera " << printable_text(camera.name) << ' ' << camera.width << " x "
              << camera.height << " at " << printable_text(arguments_.socket) << '\n';
    V4l2ImageSource source(camera, settings_, std::make_unique<LinuxVideoDevice>());
    ImageFrame frame;
    frame.reserve(camera.width, camera.height);
    source.open();
    std::uint64_t written = 0;
    while (!has_ended()) {
      if (source.read(frame) == ReadOutcome::kFrame) {
        written += put(frame, writer) ? 1 : 0;
      } else {
        writer.beat();
        source.wait(monotonic_now() + kBeat);
      }
      teller_.say(source.condition().words.text());
    }
    const auto& counts = source.counts();
    std::cerr << "tubectl: " << counts.lost << " pictures lost by the card, " << counts.refused
              << " refused, " << counts.overtaken << " overtaken\n";
    return written;
  }

  static bool put(const ImageFrame& frame, ShmImageWriter& writer) {
    tubed_shm_image image{};
    image.exposure_ns = to_ns(frame.exposure);
    image.frame_number = frame.frame_number;
    image.origin = frame.origin == Origin::kDevice ? TUBED_SHM_DEVICE : TUBED_SHM_SIMULATED;
    image.fluoroscopy_on = frame.fluoroscopy_on ? 1 : 0;
    image.depth_bits = frame.depth == PixelDepth::kGrey8 ? 8 : 16;
    image.width = static_cast<std::uint32_t>(frame.width);
    image.height = static_cast<std::uint32_t>(frame.height);
    return writer.put(image, frame.pixels.data());
  }

  const VideoGrabArguments& arguments_;
  const volatile std::sig_atomic_t& is_asked_to_end_;
  V4l2Settings settings_;
  Teller teller_;
};

}  // namespace

std::uint64_t grab_video(const VideoGrabArguments& arguments,
                         const volatile std::sig_atomic_t& is_asked_to_end) {
  if (const std::string fault = fault_of(arguments.settings); !fault.empty()) {
    throw std::runtime_error(fault);
  }
  return VideoGrab(arguments, is_asked_to_end).run();
}

}  // namespace tubed
