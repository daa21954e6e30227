// Grey pictures as a browser takes them.
#pragma once

#include <cstdint>
#include <span>

#include "clients/pictures/grey_picture.hpp"

namespace tubed {

/// libjpeg-turbo, with a buffer that is kept. One thread.
class JpegEncoder {
 public:
  /// Throws std::runtime_error.
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// The picture as JPEG, grey; valid until the next call. `quality`: 1 .. 100. Throws std::runtime_error for
  /// a picture without pixels.
  std::span<const std::uint8_t> encode(const GreyPicture& picture, int quality);

 private:
  void* encoder_;
  unsigned char* buffer_ = nullptr;
  unsigned long capacity_ = 0;
};

}  // namespace tubed
