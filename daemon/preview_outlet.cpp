#include "daemon/preview_outlet.hpp"

#include "daemon/publishing/clock_pair.hpp"

namespace tubed {

namespace {

std::uint32_t word_of(Origin origin) {
  switch (origin) {
    case Origin::kDevice:
      return TUBED_SHM_DEVICE;
    case Origin::kSimulated:
      return TUBED_SHM_SIMULATED;
    case Origin::kReplayed:
      return TUBED_SHM_REPLAYED;
  }
  return 0;
}

}  // namespace

tubed_shm_image described(const ImageFrame& frame) {
  tubed_shm_image image{};
  image.exposure_ns = to_ns(frame.exposure);
  image.frame_number = frame.frame_number;
  image.origin = word_of(frame.origin);
  image.fluoroscopy_on = frame.fluoroscopy_on ? 1 : 0;
  image.depth_bits = frame.depth == PixelDepth::kGrey8 ? 8 : 16;
  image.width = static_cast<std::uint32_t>(frame.width);
  image.height = static_cast<std::uint32_t>(frame.height);
  return image;
}

ShmPreviewOutlet::ShmPreviewOutlet(const Configuration& configuration) {
  for (const CameraCalibration& camera : configuration.room.cameras) {
    publishers_.push_back(std::make_unique<ShmImagePublisher>(
        configuration.shm, PreviewedCamera{camera.name, camera.width, camera.height},
        read_clocks().monotonic_ns));
  }
}

void ShmPreviewOutlet::put(std::size_t camera, const ImageFrame& frame) noexcept {
  const tubed_shm_image image = described(frame);
  const std::size_t bytes =
      image.fluoroscopy_on == 0 ? 0 : std::size_t{image.width} * image.height * (image.depth_bits / 8);
  publishers_[camera]->publish(image, std::as_bytes(std::span(frame.pixels)).first(bytes),
                               read_clocks().monotonic_ns);
}

void ShmPreviewOutlet::beat() noexcept {
  for (const auto& publisher : publishers_) publisher->beat(read_clocks().monotonic_ns);
}

}  // namespace tubed
