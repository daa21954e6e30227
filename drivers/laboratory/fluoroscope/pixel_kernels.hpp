// What is done for every pixel of every exposure, written so that compilers vectorise it. All spans of one
// call have the same size. Nothing here allocates.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tubed {

/// out = exp(-attenuation), to 3e-7 of its value; attenuation within -80 .. 80.
void transmissions(std::span<const float> attenuation, std::span<float> out);

/// values = -log(values), to 2e-6; values below 1e-30 count as 1e-30.
void negative_logs(std::span<float> values);

/// Symmetric point spread of `sigma_px`, separable, cut at four sigma; beyond the border the last pixel goes
/// on.
class PointSpread {
 public:
  PointSpread(int width, int height, double sigma_px);
  /// In place.
  void apply(std::span<float> image);

 private:
  int width_;
  int height_;
  std::vector<float> kernel_;  ///< from the middle outward; one element: nothing to do
  std::vector<float> padded_;  ///< one row, or a few columns' worth of rows
  std::vector<float> between_;
};

/// Normal deviates from 16 random bits each by a table of quantiles: within +- 4.3 standard deviations, mean
/// 0 and variance 1 exactly.
class NormalTable {
 public:
  NormalTable();
  /// out[i] is a function of `key` and i.
  void draw(std::uint64_t key, std::span<float> out) const;

 private:
  std::vector<float> quantiles_;
};

/// Turns expected quanta into detected ones: `deviates` are standard normal, the result has the mean, the
/// variance (to 1/18) and the skewness of Poisson's distribution (Cornish and Fisher 1938) and is not
/// negative. Good to a few quanta.
void count_quanta(std::span<const float> deviates, std::span<float> quanta);

/// Grey values: 0 where `log_attenuation` is `dark` and more, `full` where it is `bright` and less.
void to_grey8(std::span<const float> log_attenuation, float dark, float bright, std::span<std::uint8_t> out);
void to_grey16(std::span<const float> log_attenuation, float dark, float bright, float full,
               std::span<std::uint8_t> out);

}  // namespace tubed
