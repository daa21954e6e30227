#include "drivers/laboratory/fluoroscope/pixel_kernels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "drivers/laboratory/fluoroscope/counted_noise.hpp"

namespace tubed {

void transmissions(std::span<const float> attenuation, std::span<float> out) {
  constexpr float kLog2E = 1.44269504F;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const float x = std::min(80.0F, std::max(-80.0F, attenuation[i])) * -kLog2E;
    // 2^x = 2^whole * 2^part, the latter by the Taylor series of exp about 0, part within +- 0.5.
    const auto whole = static_cast<std::int32_t>(x + (x < 0 ? -0.5F : 0.5F));
    const float part = (x - static_cast<float>(whole)) * 0.693147181F;
    const float series =
        1 + part * (1 + part * (0.5F +
                                part * (1.0F / 6 + part * (1.0F / 24 + part * (1.0F / 120 + part / 720)))));
    out[i] = series * std::bit_cast<float>((whole + 127) << 23);
  }
}

void negative_logs(std::span<float> values) {
  for (float& value : values) {
    const auto bits = std::bit_cast<std::int32_t>(std::max(value, 1e-30F));
    // value = 2^exponent * mantissa with the mantissa within sqrt(1/2) .. sqrt(2).
    constexpr std::int32_t kSqrtHalf = 0x3F3504F3;
    const std::int32_t exponent = (bits - kSqrtHalf) >> 23;
    const float mantissa = std::bit_cast<float>(bits - (exponent << 23));
    // log m = 2 artanh((m - 1) / (m + 1)).
    const float t = (mantissa - 1) / (mantissa + 1);
    const float t2 = t * t;
    const float log_mantissa = 2 * t * (1 + t2 * (1.0F / 3 + t2 * (1.0F / 5 + t2 * (1.0F / 7 + t2 / 9))));
    value = -(static_cast<float>(exponent) * 0.693147181F + log_mantissa);
  }
}

PointSpread::PointSpread(int width, int height, double sigma_px)
    : width_(width), height_(height), kernel_(1, 1.0F) {
  if (sigma_px <= 0) {
    return;
  }
  const int reach = std::max(1, static_cast<int>(std::ceil(4 * sigma_px)));
  // The average over a pixel of the normal density, so that narrow spreads keep their variance.
  const auto below = [&](double x) { return 0.5 * std::erfc(-x / (sigma_px * std::sqrt(2.0))); };
  std::vector<double> weights;
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    weights.push_back(below(i + 0.5) - below(i - 0.5));
    sum += (i == 0 ? 1 : 2) * weights.back();
  }
  kernel_.clear();
  for (const double weight : weights) {
    kernel_.push_back(static_cast<float>(weight / sum));
  }
  padded_.resize(static_cast<std::size_t>(width + 2 * reach));
  between_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

void PointSpread::apply(std::span<float> image) {
  const int reach = static_cast<int>(kernel_.size()) - 1;
  if (reach == 0) {
    return;
  }
  for (int y = 0; y < height_; ++y) {
    const float* const row = image.data() + std::ptrdiff_t{y} * width_;
    float* const padded = padded_.data() + reach;
    std::copy(row, row + width_, padded);
    std::fill(padded - reach, padded, row[0]);
    std::fill(padded + width_, padded + width_ + reach, row[width_ - 1]);
    float* const out = between_.data() + std::ptrdiff_t{y} * width_;
    for (int x = 0; x < width_; ++x) {
      out[x] = kernel_[0] * padded[x];
    }
    for (int i = 1; i <= reach; ++i) {
      const float weight = kernel_[static_cast<std::size_t>(i)];
      for (int x = 0; x < width_; ++x) {
        out[x] += weight * (padded[x - i] + padded[x + i]);
      }
    }
  }
  const auto row_at = [&](int y) {
    return between_.data() + std::ptrdiff_t{std::clamp(y, 0, height_ - 1)} * width_;
  };
  for (int y = 0; y < height_; ++y) {
    float* const out = image.data() + std::ptrdiff_t{y} * width_;
    const float* const middle = row_at(y);
    for (int x = 0; x < width_; ++x) {
      out[x] = kernel_[0] * middle[x];
    }
    for (int i = 1; i <= reach; ++i) {
      const float weight = kernel_[static_cast<std::size_t>(i)];
      const float* const above = row_at(y - i);
      const float* const below = row_at(y + i);
      for (int x = 0; x < width_; ++x) {
        out[x] += weight * (above[x] + below[x]);
      }
    }
  }
}

namespace {

/// The quantile of the standard normal distribution, by Newton's method on erfc; 0 < p < 0.5.
double lower_quantile(double p) {
  double x = -std::sqrt(-2 * std::log(p)) * 0.9;
  for (int round = 0; round < 60; ++round) {
    const double excess = 0.5 * std::erfc(-x / std::sqrt(2.0)) - p;
    const double density = std::exp(-x * x / 2) / 2.5066282746310002;
    x -= std::clamp(excess / density, -0.5, 0.5);
  }
  return x;
}

}  // namespace

NormalTable::NormalTable() : quantiles_(1 << 16) {
  const std::size_t half = quantiles_.size() / 2;
  double variance = 0;
  for (std::size_t i = 0; i < half; ++i) {
    const double x = lower_quantile((static_cast<double>(i) + 0.5) / static_cast<double>(quantiles_.size()));
    variance += x * x / static_cast<double>(half);
    quantiles_[i] = static_cast<float>(x);
  }
  for (std::size_t i = 0; i < half; ++i) {
    quantiles_[i] /= static_cast<float>(std::sqrt(variance));
    quantiles_[quantiles_.size() - 1 - i] = -quantiles_[i];
  }
}

void NormalTable::draw(std::uint64_t key, std::span<float> out) const {
  std::size_t i = 0;
  for (; i + 4 <= out.size(); i += 4) {
    const std::uint64_t bits = scattered_bits(key + i * 0x9E3779B97F4A7C15);
    out[i] = quantiles_[bits & 0xFFFF];
    out[i + 1] = quantiles_[(bits >> 16) & 0xFFFF];
    out[i + 2] = quantiles_[(bits >> 32) & 0xFFFF];
    out[i + 3] = quantiles_[bits >> 48];
  }
  std::uint64_t bits = scattered_bits(key + i * 0x9E3779B97F4A7C15);
  for (; i < out.size(); ++i, bits >>= 16) {
    out[i] = quantiles_[bits & 0xFFFF];
  }
}

void count_quanta(std::span<const float> deviates, std::span<float> quanta) {
  for (std::size_t i = 0; i < quanta.size(); ++i) {
    const float z = deviates[i];
    const float mean = quanta[i];
    quanta[i] = std::max(0.0F, mean + std::sqrt(mean) * z + (z * z - 1) * (1.0F / 6));
  }
}

namespace {

/// The share of the window, 0 dark .. 1 bright, times `full`, rounded.
struct GreyScale {
  GreyScale(float dark, float bright, float full_grey)
      : offset(0.5F), scale(full_grey / (bright - dark)), zero(dark), full(full_grey) {}
  [[nodiscard]] std::int32_t operator()(float value) const {
    return static_cast<std::int32_t>(std::min(full, std::max(0.0F, (value - zero) * scale)) + offset);
  }
  float offset, scale, zero, full;
};

}  // namespace

void to_grey8(std::span<const float> log_attenuation, float dark, float bright, std::span<std::uint8_t> out) {
  const GreyScale grey(dark, bright, 255);
  for (std::size_t i = 0; i < log_attenuation.size(); ++i) {
    out[i] = static_cast<std::uint8_t>(grey(log_attenuation[i]));
  }
}

void to_grey16(std::span<const float> log_attenuation, float dark, float bright, float full,
               std::span<std::uint8_t> out) {
  const GreyScale grey(dark, bright, full);
  for (std::size_t i = 0; i < log_attenuation.size(); ++i) {
    const auto value = static_cast<std::uint16_t>(grey(log_attenuation[i]));
    std::memcpy(out.data() + 2 * i, &value, sizeof value);
  }
}

}  // namespace tubed
