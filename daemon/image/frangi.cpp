#include "daemon/image/frangi.hpp"

#include <algorithm>
#include <cmath>

// The inner loops are compiled for several instruction sets and chosen when the program starts; the
// sanitizers cannot run that early.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define TUBED_SIMD_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define TUBED_SIMD_CLONES
#endif

namespace tubed {

namespace {

constexpr double kStencilVariance = 0.2;  // what the 3 x 3 second-derivative stencil adds to sigma^2
constexpr double kKernelReach = 4.0;      // Gaussian cut at 4 sigma

std::vector<float> half_gaussian(double sigma) {
  const int reach = std::max(1, static_cast<int>(std::ceil(kKernelReach * sigma)));
  std::vector<double> weights(static_cast<std::size_t>(reach) + 1);
  double sum = 0;
  for (int i = 0; i <= reach; ++i) {
    weights[static_cast<std::size_t>(i)] = std::exp(-0.5 * i * i / (sigma * sigma));
    sum += (i == 0 ? 1 : 2) * weights[static_cast<std::size_t>(i)];
  }
  std::vector<float> half;
  half.reserve(weights.size());
  for (const double weight : weights) {
    half.push_back(static_cast<float>(weight / sum));
  }
  return half;
}

// exp for arguments in [-88, 0] as polynomial and exponent: vectorised by the compiler, relative error below
// 2e-4.
inline float exp_negative(float x) {
  const float t = std::max(x, -80.0F) * 1.44269504F;
  const float whole = std::floor(t);
  const float rest = t - whole;
  const float mantissa = 1.0F + rest * (0.695556856F + rest * (0.226173572F + rest * 0.0781455737F));
  return mantissa * __builtin_bit_cast(float, (static_cast<std::int32_t>(whole) + 127) << 23);
}

}  // namespace

FrangiFilter::FrangiFilter(int width, int height, const FrangiSettings& settings)
    : width_(width),
      height_(height),
      beta_(static_cast<float>(settings.beta)),
      structureness_(static_cast<float>(settings.structureness)) {
  std::size_t longest = 0;
  for (const double sigma : settings.scales_px) {
    const double variance = sigma * sigma;
    scales_.push_back({static_cast<float>(variance),
                       half_gaussian(std::sqrt(std::max(variance - kStencilVariance, 0.04)))});
    longest = std::max(longest, scales_.back().half_kernel.size());
  }
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  padded_row_.resize(static_cast<std::size_t>(width) + 2 * longest);
  rows_.resize(pixels);
  smoothed_.resize(pixels);
  trace_.resize(pixels);
  spread_.resize(pixels);
}

TUBED_SIMD_CLONES void FrangiFilter::smooth(std::span<const float> grey, const Scale& scale) {
  const int reach = static_cast<int>(scale.half_kernel.size()) - 1;
  const float* weights = scale.half_kernel.data();
  for (int y = 0; y < height_; ++y) {
    const float* in = grey.data() + static_cast<std::ptrdiff_t>(y) * width_;
    float* padded = padded_row_.data();
    std::fill(padded, padded + reach, in[0]);
    std::copy(in, in + width_, padded + reach);
    std::fill(padded + reach + width_, padded + 2 * reach + width_, in[width_ - 1]);
    float* out = rows_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const float* __restrict centre = padded + reach;
    for (int x = 0; x < width_; ++x) {
      out[x] = weights[0] * centre[x];
    }
    for (int k = 1; k <= reach; ++k) {
      for (int x = 0; x < width_; ++x) {
        out[x] += weights[k] * (centre[x - k] + centre[x + k]);
      }
    }
  }
  for (int y = 0; y < height_; ++y) {
    float* out = smoothed_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const float* centre = rows_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    for (int x = 0; x < width_; ++x) {
      out[x] = weights[0] * centre[x];
    }
    for (int k = 1; k <= reach; ++k) {
      const float* above = rows_.data() + static_cast<std::ptrdiff_t>(std::max(y - k, 0)) * width_;
      const float* below = rows_.data() + static_cast<std::ptrdiff_t>(std::min(y + k, height_ - 1)) * width_;
      for (int x = 0; x < width_; ++x) {
        out[x] += weights[k] * (above[x] + below[x]);
      }
    }
  }
}

// Fills trace_ and spread_; returns the greatest squared Hessian norm l1^2 + l2^2. The outermost pixels stay
// 0.
TUBED_SIMD_CLONES float FrangiFilter::second_derivatives(float variance) {
  float greatest = 0;
  for (int y = 1; y + 1 < height_; ++y) {
    const float* __restrict centre = smoothed_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    const float* __restrict above = centre - width_;
    const float* __restrict below = centre + width_;
    float* __restrict trace = trace_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    float* __restrict spread = spread_.data() + static_cast<std::ptrdiff_t>(y) * width_;
    float row_greatest = 0;
    for (int x = 1; x + 1 < width_; ++x) {
      const float xx = centre[x - 1] - 2 * centre[x] + centre[x + 1];
      const float yy = above[x] - 2 * centre[x] + below[x];
      const float xy = 0.25F * (above[x - 1] - above[x + 1] - below[x - 1] + below[x + 1]);
      const float mean = 0.5F * (xx + yy) * variance;
      const float half_difference = 0.5F * (xx - yy) * variance;
      const float squared = half_difference * half_difference + xy * xy * variance * variance;
      trace[x] = mean;
      spread[x] = std::sqrt(squared);
      row_greatest = std::max(row_greatest, 2 * (mean * mean + squared));
    }
    greatest = std::max(greatest, row_greatest);
  }
  return greatest;
}

TUBED_SIMD_CLONES void FrangiFilter::add_response(float c, std::span<float> vesselness, bool first) const {
  const float per_c = -0.5F / (c * c);
  const float per_beta = -0.5F / (beta_ * beta_);
  const float* __restrict means = trace_.data();
  const float* __restrict spreads = spread_.data();
  float* __restrict out = vesselness.data();
  const auto pixels = static_cast<std::ptrdiff_t>(vesselness.size());
  const float keep = first ? 0.0F : 1.0F;
  for (std::ptrdiff_t i = 0; i < pixels; ++i) {
    // Dark ridges: the eigenvalue of greater magnitude is positive, so it is mean + spread and mean > 0.
    const float large = means[i] + spreads[i];
    const float small = means[i] - spreads[i];
    const float ratio = small / std::max(large, 1e-12F);
    const float blob = exp_negative(per_beta * ratio * ratio);
    const float strength = 1.0F - exp_negative(per_c * (large * large + small * small));
    const float response = means[i] > 0 ? blob * strength : 0.0F;
    out[i] = std::max(keep * out[i], response);
  }
}

void FrangiFilter::filter(std::span<const float> grey, std::span<float> vesselness) {
  bool first = true;
  for (const Scale& scale : scales_) {
    smooth(grey, scale);
    const float greatest = second_derivatives(scale.variance);
    const float c = structureness_ > 0 ? structureness_ : std::max(0.5F * std::sqrt(greatest), 1e-6F);
    add_response(c, vesselness, first);
    first = false;
  }
}

}  // namespace tubed
