#include "daemon/image/image_checks.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace tubed {

namespace {

constexpr std::array kWhiteLevels = {255.0F, 1023.0F, 4095.0F, 16383.0F, 65535.0F};

// FNV-1a over 8-byte words in four lanes: equal images give equal sums, and noise never repeats an X-ray
// image bit by bit. A chain of multiplications waits for itself; four of them do not wait for each other.
std::uint64_t sum_of(const std::uint8_t* bytes, std::size_t count) {
  constexpr std::uint64_t kPrime = 1099511628211ULL;
  std::array<std::uint64_t, 4> lanes;
  lanes.fill(1469598103934665603ULL);
  for (std::size_t i = 0; i + 32 <= count; i += 32) {
    std::array<std::uint64_t, 4> words{};
    std::memcpy(words.data(), bytes + i, sizeof words);
    for (std::size_t k = 0; k < 4; ++k) {
      lanes[k] = (lanes[k] ^ words[k]) * kPrime;
    }
  }
  std::uint64_t sum = count;
  for (const std::uint64_t lane : lanes) {
    sum = (sum ^ lane) * kPrime;
  }
  for (std::size_t i = count / 32 * 32; i < count; ++i) {
    sum = (sum ^ bytes[i]) * kPrime;
  }
  return sum;
}

// Each row of `width` pixels from right to left.
void mirror(std::vector<float>& grey, int width) {
  for (auto row = grey.begin(); row != grey.end(); row += width) {
    std::reverse(row, row + width);
  }
}

struct GreyRange {
  float least = 0;
  float greatest = 0;
};

template <typename Pixel>
GreyRange copy_pixels(const std::uint8_t* bytes, std::vector<float>& grey) {
  Pixel least = std::numeric_limits<Pixel>::max();
  Pixel greatest = 0;
  for (std::size_t i = 0; i < grey.size(); ++i) {
    Pixel pixel = 0;
    std::memcpy(&pixel, bytes + i * sizeof(Pixel), sizeof(Pixel));
    grey[i] = static_cast<float>(pixel);
    least = std::min(least, pixel);
    greatest = std::max(greatest, pixel);
  }
  return {static_cast<float>(least), static_cast<float>(greatest)};
}

}  // namespace

ImageRejection ImageDoor::take_geometry(const ImageFrame& frame, ImageMeasurement& measurement) {
  measurement.geometry = looks_from_;
  if (camera_.geometry == GeometryUse::kConfiguration) {
    return ImageRejection::kNone;
  }
  if (!frame.geometry) {
    return camera_.geometry == GeometryUse::kRequired ? ImageRejection::kNoGeometry : ImageRejection::kNone;
  }
  if (const char* fault = refusal_of(*frame.geometry, camera_)) {
    geometry_fault_ = fault;
    return ImageRejection::kWrongGeometry;
  }
  measurement.geometry = frame.geometry;
  return ImageRejection::kNone;
}

ImageRejection ImageDoor::take(const ImageFrame& frame, ImageMeasurement& measurement) {
  if (frame.width != measurement.width || frame.height != measurement.height) {
    return ImageRejection::kWrongSize;
  }
  const ImageRejection of_geometry = take_geometry(frame, measurement);
  if (of_geometry != ImageRejection::kNone) {
    return of_geometry;
  }
  std::vector<float>& grey = measurement.grey;
  const std::size_t bytes = grey.size() * (frame.depth == PixelDepth::kGrey8 ? 1 : 2);
  const std::uint64_t sum = sum_of(frame.pixels.data(), bytes);
  if (sum == previous_sum_) {
    return ImageRejection::kFrozen;
  }
  previous_sum_ = sum;
  const GreyRange range = frame.depth == PixelDepth::kGrey8
                              ? copy_pixels<std::uint8_t>(frame.pixels.data(), grey)
                              : copy_pixels<std::uint16_t>(frame.pixels.data(), grey);
  if (camera_.mirrored) {
    mirror(grey, measurement.width);
  }
  measurement.darkest = range.least;
  measurement.brightest = range.greatest;
  learnt_ = std::max(learnt_, *std::lower_bound(kWhiteLevels.begin(), kWhiteLevels.end(), range.greatest));
  const float white = white_level();
  if (range.greatest >= white) {
    const auto saturated = std::count_if(grey.begin(), grey.end(), [white](float v) { return v >= white; });
    if (2 * static_cast<std::size_t>(saturated) > grey.size()) {
      return ImageRejection::kSaturated;
    }
  }
  return range.greatest - range.least < white / 255.0F ? ImageRejection::kBlack : ImageRejection::kNone;
}

}  // namespace tubed
