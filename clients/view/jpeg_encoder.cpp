#include "clients/view/jpeg_encoder.hpp"

#include <turbojpeg.h>

#include <stdexcept>
#include <string>
#include <utility>

namespace tubed {

JpegEncoder::JpegEncoder() : encoder_(tjInitCompress()) {
  if (encoder_ == nullptr) throw std::runtime_error(std::string("libjpeg-turbo: ") + tjGetErrorStr());
}

JpegEncoder::~JpegEncoder() {
  tjFree(buffer_);
  tjDestroy(encoder_);
}

std::span<const std::uint8_t> JpegEncoder::encode(const GreyPicture& picture, int quality) {
  // The most a picture of that size can take: the library never allocates.
  const unsigned long most = tjBufSize(picture.width, picture.height, TJSAMP_GRAY);
  if (most > capacity_ && most != static_cast<unsigned long>(-1)) {
    tjFree(std::exchange(buffer_, nullptr));
    buffer_ = tjAlloc(static_cast<int>(most));
    capacity_ = buffer_ == nullptr ? 0 : most;
  }
  unsigned long bytes = capacity_;
  if (tjCompress2(encoder_, picture.pixels.data(), picture.width, picture.width, picture.height, TJPF_GRAY,
                  &buffer_, &bytes, TJSAMP_GRAY, quality, TJFLAG_NOREALLOC) != 0) {
    throw std::runtime_error(std::string("libjpeg-turbo: ") + tjGetErrorStr2(encoder_));
  }
  return {buffer_, bytes};
}

}  // namespace tubed
