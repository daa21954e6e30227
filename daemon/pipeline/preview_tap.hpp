// Images for people to look at, beside those that are measured.
#pragma once

#include <algorithm>

#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/image_rate_limit.hpp"
#include "daemon/pipeline/triple_buffer.hpp"
#include "drivers/interface/image_source.hpp"

namespace tubed {

/// A person sees no difference to 30, and a browser has half the work.
inline constexpr double kPreviewRate_hz = 15;

/// The Frangi stage's end: copies one image in two, once its measurement is with the optimizer, and waits for
/// nobody. A stage without a real-time priority takes it from there.
class PreviewTap {
 public:
  /// `to` and `bell` outlive it; the slots of `to` are reserved for the camera's size.
  PreviewTap(TripleBuffer<ImageFrame>& to, Doorbell& bell) : to_(to), bell_(bell), limit_(kPreviewRate_hz) {}

  /// Never allocates: an image that is larger than its slot goes without pixels, as if fluoroscopy were off.
  void offer(const ImageFrame& frame, MonotonicTime now) noexcept {
    if (!limit_.lets_through(now)) return;
    ImageFrame& copy = to_.back();
    copy.exposure = frame.exposure;
    copy.received = frame.received;
    copy.frame_number = frame.frame_number;
    copy.origin = frame.origin;
    copy.width = frame.width;
    copy.height = frame.height;
    copy.depth = frame.depth;
    copy.geometry = frame.geometry;
    const std::size_t bytes = bytes_of(frame);
    copy.fluoroscopy_on = frame.fluoroscopy_on && bytes <= std::min(frame.pixels.size(), copy.pixels.size());
    if (copy.fluoroscopy_on) std::copy_n(frame.pixels.begin(), bytes, copy.pixels.begin());
    to_.publish();
    bell_.ring();
  }

 private:
  static std::size_t bytes_of(const ImageFrame& frame) noexcept {
    return static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height) *
           (frame.depth == PixelDepth::kGrey16 ? 2 : 1);
  }

  TripleBuffer<ImageFrame>& to_;
  Doorbell& bell_;
  ImageRateLimit limit_;
};

/// Where previews go.
class PreviewOutlet {
 public:
  virtual ~PreviewOutlet() = default;
  PreviewOutlet() = default;
  PreviewOutlet(const PreviewOutlet&) = delete;
  PreviewOutlet& operator=(const PreviewOutlet&) = delete;

  /// The newest image of a camera of the room. Called by the preview thread.
  virtual void put(std::size_t camera, const ImageFrame& frame) noexcept = 0;
  /// At least every 100 ms: there is a daemon, though perhaps no image.
  virtual void beat() noexcept = 0;
};

}  // namespace tubed
