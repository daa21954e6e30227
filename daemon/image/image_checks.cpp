#include "daemon/image/image_checks.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <numeric>

namespace tubed {

namespace {

constexpr int kMinSquare_px =
    4;  // whose noise tells a linear detector; two measured pixels where those are large
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

template <typename Pixel>
Pixel pixel_at(const std::uint8_t* bytes, std::size_t index) {
  Pixel pixel = 0;
  std::memcpy(&pixel, bytes + index * sizeof(Pixel), sizeof(Pixel));
  return pixel;
}

/// More than half of `count` pixels.
template <typename Pixel>
bool is_saturated(const std::uint8_t* bytes, std::size_t count, float white) {
  std::size_t saturated = 0;
  for (std::size_t i = 0; i < count; ++i) {
    saturated += static_cast<float>(pixel_at<Pixel>(bytes, i)) >= white ? 1 : 0;
  }
  return 2 * saturated > count;
}

/// Words that a grey level is divided into: what averaging has gained, as far as 16 bits hold it.
float words_per_level(float white, int binning) {
  float words = 1;
  while (words < static_cast<float>(binning * binning) && 2 * words * white <= LogTable::kMaxWord) {
    words *= 2;
  }
  return words;
}

}  // namespace

ImageRejection ImageDoor::take_geometry(const ImageFrame& frame, ImageMeasurement& measurement) {
  measurement.geometry = looks_from_;
  measurement.brought_geometry = false;
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
  measurement.geometry = binned(*frame.geometry, binning_);
  measurement.brought_geometry = true;
  return ImageRejection::kNone;
}

bool ImageDoor::has_size_of_camera(const ImageFrame& frame, const ImageMeasurement& measurement) const {
  const bool is_told = camera_.width > 0;
  return frame.width == (is_told ? camera_.width : measurement.width) &&
         frame.height == (is_told ? camera_.height : measurement.height);
}

ImageRejection ImageDoor::take(const ImageFrame& frame, ImageMeasurement& measurement) {
  if (!has_size_of_camera(frame, measurement)) {
    return ImageRejection::kWrongSize;
  }
  const ImageRejection of_geometry = take_geometry(frame, measurement);
  if (of_geometry != ImageRejection::kNone) {
    return of_geometry;
  }
  const std::size_t pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  const std::uint64_t sum = sum_of(frame.pixels.data(), pixels * (frame.depth == PixelDepth::kGrey8 ? 1 : 2));
  if (sum == previous_sum_) {
    return ImageRejection::kFrozen;
  }
  previous_sum_ = sum;
  return frame.depth == PixelDepth::kGrey8 ? take_pixels<std::uint8_t>(frame, measurement)
                                           : take_pixels<std::uint16_t>(frame, measurement);
}

template <typename Pixel>
ImageRejection ImageDoor::take_pixels(const ImageFrame& frame, ImageMeasurement& measurement) {
  std::vector<float>& grey = measurement.grey;
  const std::size_t pixels = static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  const GreyRange range =
      binning_ == 1 ? copy<Pixel>(frame, measurement) : average<Pixel>(frame, measurement);
  if (camera_.mirrored) {
    mirror(grey, measurement.width);
  }
  learnt_ = std::max(learnt_, *std::lower_bound(kWhiteLevels.begin(), kWhiteLevels.end(), range.greatest));
  const float white = white_level();
  if (range.greatest >= white && is_saturated<Pixel>(frame.pixels.data(), pixels, white)) {
    return ImageRejection::kSaturated;
  }
  if (range.greatest - range.least < white / 255.0F) {
    return ImageRejection::kBlack;
  }
  if (sizeof(Pixel) == 2 && !finder_.is_known()) {
    finder_.look_at(frame.pixels, frame.width, frame.height, std::max(kMinSquare_px, 2 * binning_));
  }
  if (camera_.time_averaging == TimeAveraging::kUndo) {
    undo_averaging(white, measurement);
  }
  if (is_linear()) {
    take_logarithms(white, measurement);
  }
  return ImageRejection::kNone;
}

template <typename Pixel>
ImageDoor::GreyRange ImageDoor::copy(const ImageFrame& frame, ImageMeasurement& measurement) {
  const std::uint8_t* const bytes = frame.pixels.data();
  Pixel least = std::numeric_limits<Pixel>::max();
  Pixel greatest = 0;
  for (std::size_t i = 0; i < measurement.grey.size(); ++i) {
    const Pixel pixel = pixel_at<Pixel>(bytes, i);
    measurement.grey[i] = static_cast<float>(pixel);
    least = std::min(least, pixel);
    greatest = std::max(greatest, pixel);
  }
  measurement.darkest = static_cast<float>(least);
  measurement.brightest = static_cast<float>(greatest);
  return {measurement.darkest, measurement.brightest};
}

template <typename Pixel>
ImageDoor::GreyRange ImageDoor::average(const ImageFrame& frame, ImageMeasurement& measurement) {
  const std::uint8_t* const bytes = frame.pixels.data();
  const auto binning = static_cast<std::size_t>(binning_);
  const auto width = static_cast<std::size_t>(measurement.width);
  // What does not fill a square is left over at the right of what is measured, which a mirror has turned
  // round.
  const std::size_t left = camera_.mirrored ? static_cast<std::size_t>(frame.width) % binning : 0;
  const float share = 1 / static_cast<float>(binning * binning);
  Pixel least = std::numeric_limits<Pixel>::max();
  Pixel greatest = 0;
  std::uint32_t min_sum = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t max_sum = 0;
  for (std::size_t row = 0; row < static_cast<std::size_t>(measurement.height); ++row) {
    std::fill(sums_.begin(), sums_.end(), 0U);
    for (std::size_t y = row * binning; y < (row + 1) * binning; ++y) {
      const std::size_t from = y * static_cast<std::size_t>(frame.width) + left;
      for (std::size_t x = 0; x < sums_.size(); ++x) {
        const Pixel pixel = pixel_at<Pixel>(bytes, from + x);
        sums_[x] += pixel;
        least = std::min(least, pixel);
        greatest = std::max(greatest, pixel);
      }
    }
    for (std::size_t column = 0; column < width; ++column) {
      const auto first = sums_.begin() + static_cast<std::ptrdiff_t>(column * binning);
      const std::uint32_t sum = std::accumulate(first, first + binning_, 0U);
      measurement.grey[row * width + column] = share * static_cast<float>(sum);
      min_sum = std::min(min_sum, sum);
      max_sum = std::max(max_sum, sum);
    }
  }
  measurement.darkest = share * static_cast<float>(min_sum);
  measurement.brightest = share * static_cast<float>(max_sum);
  return {static_cast<float>(least), static_cast<float>(greatest)};
}

void ImageDoor::undo_averaging(float white, ImageMeasurement& measurement) {
  averaging_.look_at(measurement.grey, measurement.exposure, 1.0 / binning_);
  if (averaging_.filter().any()) {
    undoing_.undo(averaging_.filter(), averaging_.ghosts(), averaging_.exposures_between(), white,
                  measurement);
  } else {
    undoing_.forget();
  }
}

void ImageDoor::take_logarithms(float white, ImageMeasurement& measurement) {
  const float words = words_per_level(white, binning_);
  logs_.set(white, words);
  const auto log_of = [&](float grey) {
    return logs_[static_cast<std::uint32_t>(std::min<float>(grey * words, LogTable::kMaxWord))];
  };
  std::transform(measurement.grey.begin(), measurement.grey.end(), measurement.grey.begin(), log_of);
  measurement.darkest = log_of(measurement.darkest);
  measurement.brightest = log_of(measurement.brightest);
}

}  // namespace tubed
