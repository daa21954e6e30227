// Pictures of a background that pans, zooms and breathes, for tests of the view's watch.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "daemon/image/view_picture.hpp"

namespace tubed::moving_background {

using std::chrono::milliseconds;

constexpr int kBackgroundSide = 256;
constexpr double kMmPerPx = 1.2;

/// A background of smooth random texture, larger than the picture, that can be looked at from anywhere.
class Background {
 public:
  explicit Background(unsigned seed) : canvas_(PixelGrid::Zero(kCanvas, kCanvas)) {
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    for (const double sigma_px : {2.5, 6.0}) {
      PixelGrid layer(kCanvas, kCanvas);
      for (Eigen::Index i = 0; i < layer.size(); ++i) layer.data()[i] = normal(random);
      BoxBlur(kCanvas, kCanvas, sigma_px).apply(layer);
      canvas_ += layer * (25 / std::sqrt(layer.square().mean()));
    }
  }

  /// Grey at a place of the picture, moved by (dx, dy) px; bilinear.
  [[nodiscard]] float at(double x, double y) const {
    const double cx = x + kMargin;
    const double cy = y + kMargin;
    const auto column = static_cast<Eigen::Index>(std::floor(cx));
    const auto row = static_cast<Eigen::Index>(std::floor(cy));
    const auto u = static_cast<float>(cx - std::floor(cx));
    const auto v = static_cast<float>(cy - std::floor(cy));
    return (1 - v) * ((1 - u) * canvas_(row, column) + u * canvas_(row, column + 1)) +
           v * ((1 - u) * canvas_(row + 1, column) + u * canvas_(row + 1, column + 1));
  }

 private:
  static constexpr Eigen::Index kCanvas = 400;
  static constexpr double kMargin = 72;
  PixelGrid canvas_;
};

/// How a picture is taken.
struct Shot {
  double pan_x_mm = 0;
  double pan_y_mm = 0;
  double zoom = 1;
  double breath_mm = 0;  ///< the lower half goes down by so much, the upper not at all
  double gain = 1;
  int blade_px = 0;         ///< behind it everything is 3
  unsigned noise_seed = 0;  ///< not 0: the noise of this exposure, which comes again with this number
};

/// A fluoroscope at 15 images a second.
class Fluoroscope {
 public:
  explicit Fluoroscope(unsigned seed = 1) : background_(seed), random_(seed + 1000) {
    frame_.reserve(kBackgroundSide, kBackgroundSide);
    frame_.pixels.resize(static_cast<std::size_t>(kBackgroundSide) * kBackgroundSide);
    frame_.fluoroscopy_on = true;
    frame_.exposure = from_ns(1'000'000'000);
  }

  const ImageFrame& take(const Shot& shot) {
    std::normal_distribution<double> noise(0, 2);
    if (shot.noise_seed != 0) random_.seed(shot.noise_seed);
    for (int y = 0; y < kBackgroundSide; ++y) {
      for (int x = 0; x < kBackgroundSide; ++x) {
        const double lower = std::clamp((y - kBackgroundSide / 2.0) / (kBackgroundSide / 4.0), 0.0, 1.0);
        const double from_x =
            (x - kBackgroundSide / 2.0) / shot.zoom + kBackgroundSide / 2.0 + shot.pan_x_mm / kMmPerPx;
        const double from_y = (y - kBackgroundSide / 2.0) / shot.zoom + kBackgroundSide / 2.0 +
                              (shot.pan_y_mm - lower * shot.breath_mm) / kMmPerPx;
        const double grey =
            128 + shot.gain * static_cast<double>(background_.at(from_x, from_y)) + noise(random_);
        const bool is_open = x >= shot.blade_px && x < kBackgroundSide - shot.blade_px &&
                             y >= shot.blade_px && y < kBackgroundSide - shot.blade_px;
        frame_.pixels[static_cast<std::size_t>(y) * kBackgroundSide + static_cast<std::size_t>(x)] =
            static_cast<std::uint8_t>(is_open ? std::clamp(grey, 0.0, 255.0) : 3);
      }
    }
    frame_.exposure += milliseconds(67);
    return frame_;
  }

  void stay_off_for(milliseconds time) { frame_.exposure += time; }
  [[nodiscard]] double time_s() const { return static_cast<double>(to_ns(frame_.exposure)) / 1e9; }

 private:
  Background background_;
  std::mt19937 random_;
  ImageFrame frame_;
};

}  // namespace tubed::moving_background
