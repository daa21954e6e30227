#include "daemon/publishing/shm_image_publisher.hpp"

#include <filesystem>

#include "daemon/publishing/shm_group.hpp"

namespace tubed {

namespace {

// Of four slots a reader has three images' time, 200 ms, to copy the newest.
constexpr std::uint32_t kSlots = 4;
constexpr std::uint64_t kMaxBytesAPixel = 2;

ShmWriterSettings writer_settings(const ShmSettings& settings, const PreviewedCamera& camera) {
  const std::filesystem::path folder(settings.preview_folder);
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
  return {.door = {(folder / ("preview-" + camera.name + ".sock")).string(), group_of(settings.group)},
          .geometry = {kSlots, sizeof(tubed_shm_image) + kMaxBytesAPixel * pixels},
          .identity = {TUBED_SHM_IMAGES, TUBED_SHM_IMAGES_VERSION, camera.name, 0}};
}

}  // namespace

ShmImagePublisher::ShmImagePublisher(const ShmSettings& settings, const PreviewedCamera& camera,
                                     std::int64_t now_ns)
    : writer_(writer_settings(settings, camera), now_ns) {}

void ShmImagePublisher::publish(const tubed_shm_image& image, std::span<const std::byte> pixels,
                                std::int64_t now_ns) noexcept {
  if (sizeof(image) + pixels.size() > writer_.payload_bytes()) return;
  writer_.begin();
  writer_.write(0, std::as_bytes(std::span(&image, 1)));
  writer_.write(sizeof(image), pixels);
  writer_.commit(sizeof(image) + pixels.size(), now_ns);
}

}  // namespace tubed
