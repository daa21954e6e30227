// The seam between the pipeline and a fluoroscope: one camera (view) each.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/interface/source.hpp"
#include "drivers/interface/timestamps.hpp"
#include "idl/geometry/view_geometry.hpp"

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
  std::optional<ViewGeometry> geometry;  ///< that came with it, unchecked; nothing: the configuration's
  std::vector<std::uint8_t> pixels;      ///< row by row, no padding; 16 bit in host order

  /// Makes room for width x height pixels of 16 bit. The only call that allocates.
  void reserve(int reserved_width, int reserved_height) {
    width = reserved_width;
    height = reserved_height;
    pixels.resize(static_cast<std::size_t>(reserved_width) * static_cast<std::size_t>(reserved_height) * 2);
  }
};

/// A fluoroscope, one view of it. All calls come from that view's image grab thread: open(), then read()
/// until it gives kNothing, wait(), read() again.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  ImageSource() = default;
  ImageSource(const ImageSource&) = delete;
  ImageSource& operator=(const ImageSource&) = delete;

  /// Connects. May allocate and take seconds (a recording is decoded here). Called again after kLost, after
  /// close().
  virtual OpenResult open() = 0;
  /// Sleeps until read() may have something to do, but not beyond `deadline`; may come back early. Takes no
  /// image. Nothing ends it from outside: a thread that may be asked to stop gives near deadlines. Never
  /// allocates, locks, logs or throws.
  virtual void wait(MonotonicTime deadline) noexcept = 0;
  /// Copies the newest exposure that has come into `frame`, whose buffer has been reserved for the camera's
  /// size, without waiting for one. Never allocates, locks, logs or throws.
  virtual ReadOutcome read(ImageFrame& frame) noexcept = 0;
  /// Lets go of the device; harmless when not open.
  virtual void close() noexcept = 0;
};

}  // namespace tubed
