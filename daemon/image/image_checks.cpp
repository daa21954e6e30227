#include "daemon/image/image_checks.hpp"

#include <algorithm>
#include <cstring>

namespace tubed {

namespace {

// FNV-1a over 8-byte words: equal images give equal sums, and noise never repeats an X-ray image bit by bit.
std::uint64_t sum_of(const std::uint8_t* bytes, std::size_t count) {
  std::uint64_t sum = 1469598103934665603ULL;
  for (std::size_t i = 0; i + 8 <= count; i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes + i, sizeof word);
    sum = (sum ^ word) * 1099511628211ULL;
  }
  return sum;
}

template <typename Pixel>
ImageRejection copy_pixels(const std::uint8_t* bytes, float top, std::vector<float>& grey) {
  float least = top;
  float greatest = 0;
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    Pixel pixel = 0;
    std::memcpy(&pixel, bytes + i * sizeof(Pixel), sizeof(Pixel));
    const auto value = static_cast<float>(pixel);
    grey[i] = value;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
    saturated += value >= top ? 1U : 0U;
  }
  if (2 * saturated > grey.size()) {
    return ImageRejection::kSaturated;
  }
  return greatest - least < top / 255.0F ? ImageRejection::kBlack : ImageRejection::kNone;
}

}  // namespace

ImageRejection take_image(const ImageFrame& frame, ImageMeasurement& measurement,
                          std::uint64_t& previous_sum) {
  if (frame.width != measurement.width || frame.height != measurement.height) {
    return ImageRejection::kWrongSize;
  }
  const std::size_t bytes = measurement.grey.size() * (frame.depth == PixelDepth::kGrey8 ? 1 : 2);
  const std::uint64_t sum = sum_of(frame.pixels.data(), bytes);
  if (sum == previous_sum) {
    return ImageRejection::kFrozen;
  }
  previous_sum = sum;
  return frame.depth == PixelDepth::kGrey8
             ? copy_pixels<std::uint8_t>(frame.pixels.data(), 255.0F, measurement.grey)
             : copy_pixels<std::uint16_t>(frame.pixels.data(), 65535.0F, measurement.grey);
}

}  // namespace tubed
