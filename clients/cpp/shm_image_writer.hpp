// Images from a frame grabber's program into the daemon on the same machine, through shared memory. Needs no
// DDS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "idl/shm_writer.hpp"

namespace tubed {

struct ShmImageWriterSettings {
  std::string socket;           ///< path; what `device` of the daemon's [[camera]] says
  std::string camera;           ///< name of that [[camera]]
  std::uint32_t max_width = 0;  ///< px, the largest image that will come
  std::uint32_t max_height = 0;
  std::uint32_t max_depth_bits = 16;
  std::optional<gid_t> group;  ///< the daemon is a member of; none: root and this user only
};

/// One thread. Never waits for a reader, and does not know whether there is one; after construction nothing
/// allocates or throws. Call something at least every 100 ms, or the daemon takes the writer for dead after
/// 200.
class ShmImageWriter {
 public:
  /// Throws ShmError.
  explicit ShmImageWriter(const ShmImageWriterSettings& settings);

  /// Where the next image's pixels go, to be filled in place: row by row, no padding, 16 bit in host order.
  std::uint8_t* begin() noexcept;
  /// Publishes what was filled in. False, and nothing is published, for a depth other than 8 or 16, an
  /// unknown origin, or an image larger than the largest.
  bool commit(const tubed_shm_image& image) noexcept;
  /// begin, copy, commit. `pixels` may be null when fluoroscopy is off; false when it is null otherwise.
  bool put(const tubed_shm_image& image, const void* pixels) noexcept;
  /// Shows that the program works though there is no image.
  void beat() noexcept;

 private:
  [[nodiscard]] std::optional<std::size_t> pixel_bytes(const tubed_shm_image& image) const noexcept;
  void publish(const tubed_shm_image& image, std::size_t bytes) noexcept;

  ShmWriter writer_;
};

}  // namespace tubed
