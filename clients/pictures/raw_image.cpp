#include "clients/pictures/raw_image.hpp"

#include <span>

namespace tubed {

namespace {

constexpr std::uint32_t kMaxSide = 1U << 14U;

std::size_t pixel_bytes(const tubed_shm_image& head) {
  return head.fluoroscopy_on == 0 ? 0 : std::size_t{head.width} * head.height * (head.depth_bits / 8);
}

bool is_sound(const tubed_shm_image& head, std::size_t payload_bytes) {
  return head.origin >= TUBED_SHM_DEVICE && head.origin <= TUBED_SHM_REPLAYED &&
         (head.depth_bits == 8 || head.depth_bits == 16) && head.width > 0 && head.height > 0 &&
         head.width <= kMaxSide && head.height <= kMaxSide &&
         payload_bytes >= sizeof(head) + pixel_bytes(head);
}

}  // namespace

std::optional<RawImage> take_image(ShmReader& reader) {
  const ShmSample sample = reader.take_newest();
  RawImage image;
  if (!sample.copy(0, std::as_writable_bytes(std::span(&image.head, 1))) || !sample.whole() ||
      !is_sound(image.head, sample.bytes())) {
    return {};
  }
  image.pixels.resize(pixel_bytes(image.head));
  const auto pixels = std::as_writable_bytes(std::span(image.pixels));
  if (!sample.copy(sizeof(image.head), pixels) || !sample.whole()) return {};
  return image;
}

}  // namespace tubed
