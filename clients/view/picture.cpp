#include "clients/view/picture.hpp"

#include <turbojpeg.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <utility>

namespace tubed {

namespace {

constexpr std::size_t kStep = 16;
constexpr double kCut = 0.005;
constexpr double kMinWidth = 16;
constexpr double kMargin = 0.35;  // noise fills the whole width otherwise

/// Index of the first bin beyond `share` of all.
double quantile(const std::vector<std::uint32_t>& histogram, double share, std::size_t total) {
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(total));
  std::size_t below = 0;
  for (std::size_t value = 0; value < histogram.size(); ++value) {
    below += histogram[value];
    if (below > rank) return static_cast<double>(value);
  }
  return static_cast<double>(histogram.size() - 1);
}

}  // namespace

GreyWindow window_of(std::span<const std::uint16_t> pixels) {
  std::vector<std::uint32_t> histogram(std::size_t{1} << 16U);
  std::size_t total = 0;
  for (std::size_t i = 0; i < pixels.size(); i += kStep, ++total) ++histogram[pixels[i]];
  const double black = quantile(histogram, kCut, total);
  const double width = std::max(quantile(histogram, 1 - kCut, total) - black, kMinWidth);
  return {black - kMargin * width, black + (1 + kMargin) * width};
}

GreyWindow between(const GreyWindow& from, const GreyWindow& to, double share) {
  return {from.black + share * (to.black - from.black), from.white + share * (to.white - from.white)};
}

void apply_window(std::span<const std::uint16_t> from, const GreyWindow& window, std::span<std::uint8_t> to) {
  const double gain = 255 / (window.white - window.black);
  std::transform(from.begin(), from.end(), to.begin(), [&](std::uint16_t value) {
    return static_cast<std::uint8_t>(std::clamp((value - window.black) * gain + 0.5, 0.0, 255.0));
  });
}

int shrink(GreyPicture& picture, int max_side) {
  int times = 1;
  for (; std::max(picture.width, picture.height) > max_side; times *= 2) {
    const int width = picture.width / 2;
    const int height = picture.height / 2;
    const auto at = [&](int x, int y) {
      return picture.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                            static_cast<std::size_t>(x)];
    };
    std::size_t next = 0;  // never ahead of what is still to be read
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int sum =
            at(2 * x, 2 * y) + at(2 * x + 1, 2 * y) + at(2 * x, 2 * y + 1) + at(2 * x + 1, 2 * y + 1);
        picture.pixels[next++] = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
    picture.width = width;
    picture.height = height;
    picture.pixels.resize(next);
  }
  return times;
}

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
