#include "daemon/image/detector_response.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tubed {

namespace {

constexpr float kDarkShare = 1.0F / 128;  // of white, where the logarithm flattens
constexpr int kEvery = 3;                 // row and pixel is looked at: enough, and none twice
constexpr int kMinSamples = 200;          // of a grey value, to know its noise
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

// The second difference of three pixels in a row is noise but for an even slope's share, which is 0.
void ResponseFinder::look_at(std::span<const std::uint8_t> words, int width, int height) {
  bins_.fill({});
  for (int y = 0; y < height; y += kEvery) {
    const std::uint8_t* row = words.data() + static_cast<std::ptrdiff_t>(y) * width * 2;
    for (int x = 0; x + 2 < width; x += kEvery) {
      std::array<std::uint16_t, 3> grey{};
      std::memcpy(grey.data(), row + 2 * static_cast<std::ptrdiff_t>(x), sizeof grey);
      const int sum = grey[0] + grey[1] + grey[2];
      if (sum == 0) continue;
      const double log_grey = std::log(sum / 3.0);
      // 64 bins over log(1/3) .. log(65535).
      const auto bin = static_cast<std::size_t>((log_grey + 1.1) * (kBins - 1) / 12.2);
      Bin& of = bins_[bin];
      of.sum_of_steps += std::abs(grey[0] - 2 * grey[1] + grey[2]);
      of.sum_of_logs += log_grey;
      ++of.count;
    }
  }
  decide();
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
