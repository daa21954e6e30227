#include <benchmark/benchmark.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <random>
#include <string>
#include <vector>

#include "bench/stages/opencv_frangi.hpp"
#include "bench/stages/stages.hpp"
#include "daemon/image/frangi.hpp"

namespace tubed {

namespace {

constexpr const char* kPeer = "opencv-sepfilter";

// A dark curved tube, 4 px wide, over a slope with noise: grey values as a fluoroscope of 8 or 16 bits gives
// them.
template <typename Pixel>
std::vector<Pixel> fluoroscopic_image(int width, int height) {
  const double full = sizeof(Pixel) == 1 ? 255 : 65535;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.015);
  std::vector<Pixel> pixels;
  pixels.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double tube = y - height * (0.5 + 0.25 * std::sin(6.0 * x / width));
      const double grey = 0.55 + 0.2 * x / width - 0.2 * std::exp(-0.5 * tube * tube / 4) + noise(random);
      pixels.push_back(static_cast<Pixel>(full * std::clamp(grey, 0.0, 1.0)));
    }
  }
  return pixels;
}

// Tiles of 64 x 32 px that a band of 16 px to either side of the tube above touches.
std::vector<PixelRectangle> band(int width, int height) {
  std::vector<PixelRectangle> tiles;
  for (int left = 0; left < width; left += 64) {
    double top = height;
    double bottom = 0;
    for (int x = left; x < std::min(left + 64, width); ++x) {
      const double tube = height * (0.5 + 0.25 * std::sin(6.0 * x / width));
      top = std::min(top, tube - 16);
      bottom = std::max(bottom, tube + 17);
    }
    tiles.push_back({left, static_cast<int>(top), std::min(left + 64, width), static_cast<int>(bottom)});
  }
  return tiles;
}

struct Case {
  int width = 400;
  int height = 600;
  std::vector<double> scales_px{1.0, 1.5, 2.0, 3.0};
  FrangiSmoothing smoothing = FrangiSmoothing::kFloat;
  double structureness = 0;
  bool on_band = false;
  std::string variant{};
  std::int64_t instruction_set = 0;  // Highway's target; 0: the best there is

  [[nodiscard]] std::string name() const {
    return "frangi/" + std::to_string(width) + "x" + std::to_string(height) + "/" +
           std::to_string(scales_px.size()) + "scales/" + (on_band ? "band" : "full") + variant;
  }
};

void measure(const Case& c, const StageChoice& choice, Report& report) {
  if (!choice.wants(c.name())) {
    return;
  }
  FrangiSettings settings;
  settings.scales_px = c.scales_px;
  settings.structureness = c.structureness;
  settings.smoothing = c.smoothing;
  std::vector<std::uint8_t> grey = fluoroscopic_image<std::uint8_t>(c.width, c.height);
  std::vector<float> vesselness(grey.size());
  const std::vector<PixelRectangle> tiles = band(c.width, c.height);
  FrangiFilter filter(c.width, c.height, settings);
  OpencvFrangi peer(settings);
  const cv::Mat picture(c.height, c.width, CV_8U, grey.data());
  hwy::SetSupportedTargetsForTest(c.instruction_set);
  hwy::GetChosenTarget().DeInit();
  const TurnTimes times = take_turns(
      {.turns = choice.turns, .calls_own = c.on_band ? 20 : 4},
      [&] {
        if (c.on_band) {
          filter.filter_tiles(grey, tiles, RidgeMaps{vesselness});
        } else {
          filter.filter(grey, vesselness);
        }
        benchmark::DoNotOptimize(vesselness.data());
        benchmark::ClobberMemory();
      },
      [&] {
        benchmark::DoNotOptimize(peer.filter(picture).data);
        benchmark::ClobberMemory();
      });
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().DeInit();
  const double pixels = static_cast<double>(c.width) * c.height;
  report.add(c.name(), kPeer, times, {{"ns_per_px", quantile(times.own_ms, 0.5) * 1e6 / pixels}});
}

}  // namespace

void measure_frangi(const StageChoice& choice, Report& report) {
  cv::setNumThreads(1);
  constexpr auto kInteger = FrangiSmoothing::kInteger16;
  measure({}, choice, report);
  measure({.scales_px = {2.0}}, choice, report);
  measure({.structureness = 20, .variant = "/c20"}, choice, report);
  measure({.smoothing = kInteger, .variant = "/int16"}, choice, report);
  measure({.smoothing = kInteger, .structureness = 20, .variant = "/int16/c20"}, choice, report);
  measure({.on_band = true}, choice, report);
  measure({.smoothing = kInteger, .on_band = true, .variant = "/int16"}, choice, report);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const std::string name = hwy::TargetName(target);
    measure({.variant = "/" + name, .instruction_set = target}, choice, report);
    measure({.smoothing = kInteger, .variant = "/int16/" + name, .instruction_set = target}, choice, report);
  }
  for (const int width : {64, 401, 512, 1024, 1040, 2048}) {
    measure({.width = width, .height = width == 401 ? 600 : width}, choice, report);
  }
}

}  // namespace tubed
