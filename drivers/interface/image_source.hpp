// The seam between the pipeline and a fluoroscope: one camera (view) each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/interface/source.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

enum class PixelDepth { kGrey8, kGrey16 };

/// Size and name a source has to deliver; anything else is refused.
struct ImageFormat {
  std::string camera;  ///< name of the camera in the configuration
  int width = 0;       ///< px
  int height = 0;      ///< px
};

/// One fluoroscopic exposure. The pixel buffer is reserved once, for 16 bit, and reused.
struct ImageFrame {
  MonotonicTime exposure{};        ///< middle of the exposure
  MonotonicTime received{};        ///< when the host had all pixels
  std::uint32_t frame_number = 0;  ///< the source's own count
  Origin origin = Origin::kDevice;
  bool fluoroscopy_on = false;  ///< false: an instant without radiation; there are no pixels
  int width = 0;
  int height = 0;
  PixelDepth depth = PixelDepth::kGrey8;
  std::vector<std::uint8_t> pixels;  ///< row by row, no padding; 16 bit in host order

  /// Makes room for width x height pixels of 16 bit. The only call that allocates.
  void reserve(int reserved_width, int reserved_height) {
    width = reserved_width;
    height = reserved_height;
    pixels.resize(static_cast<std::size_t>(reserved_width) * static_cast<std::size_t>(reserved_height) * 2);
  }
};

/// A fluoroscope, one view of it. All calls come from that view's image grab thread.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;

  /// Connects. May allocate and take seconds (a recording is decoded here). Called again after kLost, after
  /// close().
  virtual OpenResult open() = 0;
  /// Waits for the next exposure until `deadline` and copies it into `frame`, whose buffer has been reserved
  /// for the camera's size. Never allocates, locks, logs or throws.
  virtual ReadOutcome read(ImageFrame& frame, MonotonicTime deadline) noexcept = 0;
  /// Lets go of the device; harmless when not open.
  virtual void close() noexcept = 0;
};

}  // namespace tubed
