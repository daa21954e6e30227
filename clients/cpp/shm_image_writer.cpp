#include "clients/cpp/shm_image_writer.hpp"

#include <ctime>
#include <span>

namespace tubed {

namespace {

// Of four slots a reader has three frames' time to copy the newest.
constexpr std::uint32_t kSlots = 4;

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<std::int64_t>(now.tv_sec) * 1'000'000'000 + now.tv_nsec;
}

ShmWriterSettings writer_settings(const ShmImageWriterSettings& settings) {
  const std::uint64_t pixels = std::uint64_t{settings.max_width} * settings.max_height;
  if (pixels == 0 || pixels > kShmMaxPayloadBytes / 4 ||
      (settings.max_depth_bits != 8 && settings.max_depth_bits != 16)) {
    throw ShmError("an image has 1 to " + std::to_string(kShmMaxPayloadBytes / 4) + " pixels of 8 or 16 bit");
  }
  return {.door = {settings.socket, settings.group},
          .geometry = {kSlots, sizeof(tubed_shm_image) + pixels * settings.max_depth_bits / 8},
          .identity = {TUBED_SHM_IMAGES, TUBED_SHM_IMAGES_VERSION, settings.camera, 0}};
}

}  // namespace

ShmImageWriter::ShmImageWriter(const ShmImageWriterSettings& settings)
    : writer_(writer_settings(settings), monotonic_ns()) {}

std::optional<std::size_t> ShmImageWriter::pixel_bytes(const tubed_shm_image& image) const noexcept {
  const bool is_known = image.origin >= TUBED_SHM_DEVICE && image.origin <= TUBED_SHM_REPLAYED;
  if (!is_known || (image.depth_bits != 8 && image.depth_bits != 16)) {
    return {};
  }
  if (image.fluoroscopy_on == 0) {
    return 0;
  }
  const std::uint64_t pixels = std::uint64_t{image.width} * image.height;
  const std::uint64_t most = (writer_.payload_bytes() - sizeof(image)) * 8 / image.depth_bits;
  return pixels <= most ? std::optional<std::size_t>(pixels * image.depth_bits / 8) : std::nullopt;
}

std::uint8_t* ShmImageWriter::begin() noexcept {
  return reinterpret_cast<std::uint8_t*>(writer_.begin() + sizeof(tubed_shm_image));
}

bool ShmImageWriter::commit(const tubed_shm_image& image) noexcept {
  const std::optional<std::size_t> bytes = pixel_bytes(image);
  if (bytes) {
    publish(image, *bytes);
  }
  return bytes.has_value();
}

bool ShmImageWriter::put(const tubed_shm_image& image, const void* pixels) noexcept {
  const std::optional<std::size_t> bytes = pixel_bytes(image);
  if (!bytes || (pixels == nullptr && *bytes > 0)) {
    return false;
  }
  writer_.begin();
  writer_.write(sizeof(image), {static_cast<const std::byte*>(pixels), *bytes});
  publish(image, *bytes);
  return true;
}

void ShmImageWriter::publish(const tubed_shm_image& image, std::size_t bytes) noexcept {
  writer_.write(0, std::as_bytes(std::span(&image, 1)));
  writer_.commit(sizeof(image) + bytes, monotonic_ns());
}

void ShmImageWriter::beat() noexcept { writer_.beat(monotonic_ns()); }

}  // namespace tubed
