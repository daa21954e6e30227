#include "daemon/image/detector_response.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tubed {

namespace {

constexpr float kDarkShare = 1.0F / 128;  // of white, where the logarithm flattens
constexpr double kMaxLogGrey = 11.1;      // of 65535
constexpr int kMinSamples = 50;           // of a grey value, to know its noise
constexpr int kMinBins = 5;               // of a quarter of an octave each, to know a slope
constexpr double kLinearSlope = 0.2;      // between 1/2 and what falls

}  // namespace

void LogTable::set(float white, float words_per_level) {
  if (white == white_ && words_per_level == words_per_level_) {
    return;
  }
  white_ = white;
  words_per_level_ = words_per_level;
  const double dark = kDarkShare * white;
  const double scale = kMaxWord / std::log1p(white / dark);
  for (std::size_t word = 0; word < logs_.size(); ++word) {
    const double x = std::min<double>(static_cast<double>(word) / words_per_level, white);
    logs_[word] = static_cast<float>(std::round(scale * std::log1p(x / dark)));
  }
}

// The second difference of three squares in a row is noise but for an even slope's share, which is 0.
void ResponseFinder::look_at(std::span<const std::uint8_t> words, int width, int height, int square_px) {
  bins_.fill({});
  const double pixels = square_px * square_px;
  const auto mean_at = [&](int left, int top) {
    int sum = 0;
    for (int y = top; y < top + square_px; ++y) {
      for (int x = left; x < left + square_px; ++x) {
        std::uint16_t grey = 0;
        std::memcpy(&grey,
                    &words[2 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x))],
                    sizeof grey);
        sum += grey;
      }
    }
    return sum / pixels;
  };
  for (int y = 0; y + square_px <= height; y += square_px) {
    for (int x = 0; x + 3 * square_px <= width; x += 3 * square_px) {
      const double left = mean_at(x, y);
      const double middle = mean_at(x + square_px, y);
      const double right = mean_at(x + 2 * square_px, y);
      add((left + middle + right) / 3, std::abs(left - 2 * middle + right));
    }
  }
  decide();
}

void ResponseFinder::add(double grey, double step) {
  if (grey < 1) return;
  const double log_grey = std::log(grey);
  Bin& of = bins_[static_cast<std::size_t>(log_grey * (kBins - 1) / kMaxLogGrey)];
  of.sum_of_steps += step;
  of.sum_of_logs += log_grey;
  ++of.count;
}

// Slope of log(noise) over log(grey), each grey value as often as it was seen.
void ResponseFinder::decide() {
  double n = 0;
  double x = 0;
  double y = 0;
  double xx = 0;
  double xy = 0;
  int used = 0;
  for (const Bin& bin : bins_) {
    if (bin.count < kMinSamples || bin.sum_of_steps <= 0) continue;
    const double log_grey = bin.sum_of_logs / bin.count;
    const double log_noise = std::log(bin.sum_of_steps / bin.count);
    ++used;
    n += bin.count;
    x += bin.count * log_grey;
    y += bin.count * log_noise;
    xx += bin.count * log_grey * log_grey;
    xy += bin.count * log_grey * log_noise;
  }
  const double spread = n * xx - x * x;
  if (used < kMinBins || !(spread > 0)) {
    return;
  }
  slope_ = (n * xy - x * y) / spread;
  is_known_ = true;
  is_linear_ = slope_ > kLinearSlope;
}

}  // namespace tubed
