#include "daemon/preview_outlet.hpp"

#include "daemon/publishing/clock_pair.hpp"
#include "drivers/interface/view_in_shm.hpp"

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

tubed_shm_image described(const ImageFrame& frame, const CameraCalibration& camera) {
  tubed_shm_image image{};
  image.exposure_ns = to_ns(frame.exposure);
  image.frame_number = frame.frame_number;
  image.origin = word_of(frame.origin);
  image.fluoroscopy_on = frame.fluoroscopy_on ? 1 : 0;
  image.depth_bits = frame.depth == PixelDepth::kGrey8 ? 8 : 16;
  image.width = static_cast<std::uint32_t>(frame.width);
  image.height = static_cast<std::uint32_t>(frame.height);
  if (frame.geometry && camera.geometry != GeometryUse::kConfiguration &&
      refusal_of(*frame.geometry, camera) == nullptr) {
    write_geometry(*frame.geometry, image);
  }
  return image;
}

ShmPreviewOutlet::ShmPreviewOutlet(const Configuration& configuration) {
  for (const CameraCalibration& camera : configuration.room.cameras) {
    previews_.push_back({std::make_unique<ShmImagePublisher>(
                             configuration.shm, PreviewedCamera{camera.name, camera.width, camera.height},
                             read_clocks().monotonic_ns),
                         camera});
  }
}

void ShmPreviewOutlet::put(std::size_t camera, const ImageFrame& frame) noexcept {
  const tubed_shm_image image = described(frame, previews_[camera].camera);
  const std::size_t bytes =
      image.fluoroscopy_on == 0 ? 0 : std::size_t{image.width} * image.height * (image.depth_bits / 8);
  previews_[camera].publisher->publish(image, std::as_bytes(std::span(frame.pixels)).first(bytes),
                                       read_clocks().monotonic_ns);
}

void ShmPreviewOutlet::beat() noexcept {
  for (const Preview& preview : previews_) preview.publisher->beat(read_clocks().monotonic_ns);
}

}  // namespace tubed
