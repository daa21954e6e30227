// Images of one camera as messages for the page.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "clients/pictures/grey_picture.hpp"
#include "clients/view/jpeg_encoder.hpp"
#include "clients/view/outbox.hpp"

namespace tubed {

/// How pictures are made.
struct PictureSettings {
  int max_side = 1024;  ///< px; larger ones are halved until they fit
  int quality = 80;     ///< of JPEG, 1 .. 100
};

/// Follows the grey values of one camera. Messages are binary: the length of the head (4 bytes,
/// little-endian), the head as JSON, {"type": "image", "camera", "n", "frame", "exposed_at" (ms,
/// CLOCK_MONOTONIC), "on", "origin" (1 device, 2 simulated, 3 replayed), "width", "height" (of the camera,
/// px), "shrunk", "black", "white" (grey values shown so), "received" (ms)}, then the JPEG; without
/// fluoroscopy there is none. One thread.
class ImageEncoder {
 public:
  explicit ImageEncoder(std::string camera, PictureSettings settings = {})
      : camera_(std::move(camera)), settings_(settings) {}

  /// `number`: of the message. `received_ns`: CLOCK_MONOTONIC of this host, now.
  SharedMessage encode(const RawImage& image, std::uint64_t number, std::int64_t received_ns);

 private:
  std::span<const std::uint8_t> jpeg_of(const RawImage& image, int& shrunk);

  std::string camera_;
  PictureSettings settings_;
  JpegEncoder encoder_;
  GreyFollower pictures_;
};

}  // namespace tubed
