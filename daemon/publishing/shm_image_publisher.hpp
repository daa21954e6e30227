// Writes the images of one camera into shared memory, for viewers. The preview thread alone uses it after
// construction.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "daemon/publishing/shm_settings.hpp"
#include "idl/shm_writer.hpp"

namespace tubed {

/// One camera whose images are shown.
struct PreviewedCamera {
  std::string name;
  int width = 0;  ///< px
  int height = 0;
};

class ShmImagePublisher {
 public:
  /// At ShmSettings::preview_folder/preview-NAME.sock, for the group of the settings. Throws ShmError: the
  /// socket cannot be served, no such group, no memory.
  ShmImagePublisher(const ShmSettings& settings, const PreviewedCamera& camera, std::int64_t now_ns);

  /// `pixels`: as `image` says, row by row; empty without fluoroscopy. Ignores an image that is larger than
  /// the camera's.
  void publish(const tubed_shm_image& image, std::span<const std::byte> pixels, std::int64_t now_ns) noexcept;
  /// At least every 100 ms; also lets readers in.
  void beat(std::int64_t now_ns) noexcept { writer_.beat(now_ns); }

 private:
  ShmWriter writer_;
};

}  // namespace tubed
