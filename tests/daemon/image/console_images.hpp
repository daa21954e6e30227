// A detector and consoles that show what it saw, image after image.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "daemon/image/image_checks.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

inline constexpr int kConsoleWidth = 200;
inline constexpr int kConsoleHeight = 300;
inline constexpr float kWhite = 255;
inline constexpr double kRounded = 1;
inline constexpr int kEnough = 20;  // images, to find a filter

using ConsolePicture = std::vector<float>;

/// What a detector sees, exposure after exposure: noise over a still background, and before it a tube that
/// moves across by some pixels an exposure.
class Detector {
 public:
  explicit Detector(double noise = 8, int bands = 1) : noise_(0, static_cast<float>(noise)), bands_(bands) {}

  ConsolePicture expose() {
    ConsolePicture picture(static_cast<std::size_t>(kConsoleWidth * kConsoleHeight));
    for (int y = 0; y < kConsoleHeight; ++y) {
      for (int x = 0; x < kConsoleWidth; ++x) {
        const float still = 120 + 30 * std::sin(0.08F * static_cast<float>(x)) + (x / 40 % 2 == 0 ? 10 : 0);
        picture[static_cast<std::size_t>(y * kConsoleWidth + x)] = still - shade(x) + noise_(random_);
      }
    }
    ++exposures_;
    return picture;
  }

 private:
  [[nodiscard]] float shade(int x) const {
    float sum = 0;
    for (int band = 0; band < bands_; ++band) {
      const int at = (40 + 60 * band + 3 * exposures_) % kConsoleWidth;
      sum += std::abs(x - at) < 3 ? 25 : 0;
    }
    return sum;
  }

  std::mt19937 random_{7};
  std::normal_distribution<float> noise_;
  int bands_;
  int exposures_ = 0;
};

/// Shows a share of what it has shown before, in whole grey values.
class RecursiveConsole {
 public:
  explicit RecursiveConsole(double share) : share_(static_cast<float>(share)) {}

  ConsolePicture show(const ConsolePicture& seen) {
    kept_ = kept_.empty() ? seen : kept_;
    ConsolePicture shown(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) {
      kept_[i] += (1 - share_) * (seen[i] - kept_[i]);
      shown[i] = std::round(std::clamp(kept_[i], 0.0F, kWhite));
    }
    return shown;
  }

 private:
  float share_;
  ConsolePicture kept_;
};

/// The same where nothing moves; what differs from the image before by more than noise is shown as it is.
class GatedConsole {
 public:
  GatedConsole(double share, double noise)
      : share_(static_cast<float>(share)), limit_(static_cast<float>(3 * noise)) {}

  ConsolePicture show(const ConsolePicture& seen) {
    kept_ = kept_.empty() ? seen : kept_;
    ConsolePicture shown(seen.size());
    const ConsolePicture before = kept_;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const float change = change_at(seen, before, i) / limit_;
      const float share = share_ / (1 + change * change * change * change);
      kept_[i] += (1 - share) * (seen[i] - kept_[i]);
      shown[i] = std::round(std::clamp(kept_[i], 0.0F, kWhite));
    }
    return shown;
  }

 private:
  /// Mean of five pixels.
  static float change_at(const ConsolePicture& seen, const ConsolePicture& before, std::size_t i) {
    float sum = 0;
    for (std::size_t k = std::max<std::size_t>(i, 2) - 2; k < std::min(i + 3, seen.size()); ++k) {
      sum += (seen[k] - before[k]) / 5;
    }
    return sum;
  }

  float share_;
  float limit_;
  ConsolePicture kept_;
};

inline MonotonicTime at_s(double t_s) { return from_ns(1'000'000'000 + std::llround(1e9 * t_s)); }

/// Mean square of what a door measures of the last of `images` + 1 images, off what the detector saw; the
/// last one comes `missing_s` late.
template <typename Console>
double square_off(ImageDoor& door, Detector detector, Console console, int images, double missing_s = 0) {
  ImageMeasurement measurement;
  measurement.reserve(kConsoleWidth, kConsoleHeight);
  ImageFrame frame;
  frame.reserve(kConsoleWidth, kConsoleHeight);
  double off = 0;
  for (int k = 0; k <= images; ++k) {
    const ConsolePicture seen = detector.expose();
    const ConsolePicture shown = console.show(seen);
    std::ranges::transform(shown, frame.pixels.begin(),
                           [](float grey) { return static_cast<std::uint8_t>(grey); });
    measurement.exposure = at_s(k / 15.0 + (k == images ? missing_s : 0));
    EXPECT_EQ(door.take(frame, measurement), ImageRejection::kNone);
    off = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) off += std::pow(measurement.grey[i] - seen[i], 2);
  }
  return off / (kConsoleWidth * kConsoleHeight);
}

/// Of the view that such images are of.
inline CameraCalibration camera_of(TimeAveraging time_averaging) {
  CameraCalibration camera;
  camera.width = kConsoleWidth;
  camera.height = kConsoleHeight;
  camera.time_averaging = time_averaging;
  return camera;
}

}  // namespace tubed
