#include "clients/pictures/grey_picture.hpp"

#include <algorithm>
#include <cstring>

namespace tubed {

namespace {

constexpr std::size_t kStep = 16;
constexpr double kCut = 0.005;
constexpr double kMinWidth = 16;
constexpr double kWindowShare = 0.2;
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

GreyPicture& GreyFollower::take(const RawImage& image) {
  picture_.width = static_cast<int>(image.head.width);
  picture_.height = static_cast<int>(image.head.height);
  picture_.pixels.resize(std::size_t{image.head.width} * image.head.height);
  deep_.resize(picture_.pixels.size());
  if (image.head.depth_bits == 8) {
    std::copy(image.pixels.begin(), image.pixels.end(), deep_.begin());
  } else {
    std::memcpy(deep_.data(), image.pixels.data(), image.pixels.size());
  }
  const GreyWindow now = window_of(deep_);
  window_ = has_window_ ? between(window_, now, kWindowShare) : now;
  has_window_ = true;
  apply_window(deep_, window_, picture_.pixels);
  return picture_;
}

}  // namespace tubed
