#include <benchmark/benchmark.h>

#include <hwy/targets.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/core.hpp>
#include <random>
#include <string>
#include <vector>

#include "bench/stages/opencv_frangi.hpp"
#include "bench/stages/stages.hpp"
#include "daemon/image/frangi.hpp"

namespace tubed {

namespace {

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

// One filter with its image, ready to run.
class Bed {
 public:
  explicit Bed(const Case& c)
      : case_(c),
        grey_(fluoroscopic_image<std::uint8_t>(c.width, c.height)),
        vesselness_(grey_.size()),
        tiles_(band(c.width, c.height)),
        filter_(c.width, c.height, settings_of(c)) {}

  void run() {
    if (case_.on_band) {
      filter_.filter_tiles(grey_, tiles_, RidgeMaps{vesselness_});
    } else {
      filter_.filter(grey_, vesselness_);
    }
    benchmark::DoNotOptimize(vesselness_.data());
    benchmark::ClobberMemory();
  }

  std::vector<std::uint8_t>& grey() { return grey_; }

  [[nodiscard]] double pixels() const {
    double sum = 0;
    for (const PixelRectangle& tile : tiles_) {
      sum += tile.width() * tile.height();
    }
    return case_.on_band ? sum : static_cast<double>(grey_.size());
  }

  static FrangiSettings settings_of(const Case& c) {
    return {.scales_px = c.scales_px, .structureness = c.structureness, .smoothing = c.smoothing};
  }

 private:
  Case case_;
  std::vector<std::uint8_t> grey_;
  std::vector<float> vesselness_;
  std::vector<PixelRectangle> tiles_;
  FrangiFilter filter_;
};

void use_instruction_set(std::int64_t target) {
  hwy::SetSupportedTargetsForTest(target);
  hwy::GetChosenTarget().DeInit();
}

std::map<std::string, double> per_pixel(const TurnTimes& times, double pixels) {
  return {{"pixels", pixels},
          {"ns_per_px", percentile(times.own_ms, 50) * 1e6 / pixels},
          {"min_ns_per_px", percentile(times.own_ms, 0) * 1e6 / pixels}};
}

// Beside OpenCV's, on the same 8-bit image with the same settings.
void measure(const Case& c, const StageChoice& choice, Report& report) {
  if (!choice.wants(c.name())) {
    return;
  }
  Bed bed(c);
  OpencvFrangi peer(Bed::settings_of(c));
  const cv::Mat picture(c.height, c.width, CV_8U, bed.grey().data());
  use_instruction_set(c.instruction_set);
  const TurnTimes times = take_turns(
      {.turns = choice.turns, .calls_own = 4}, [&] { bed.run(); },
      [&] {
        benchmark::DoNotOptimize(peer.filter(picture).data);
        benchmark::ClobberMemory();
      });
  use_instruction_set(0);
  report.add(c.name(), "opencv-sepfilter", times, per_pixel(times, bed.pixels()));
}

// Beside another case of ours: the band beside the frame, a power of two beside another width.
void measure_pair(const Case& c, const Case& other, const StageChoice& choice, Report& report) {
  const std::string name = c.name() + "/beside";
  if (!choice.wants(name)) {
    return;
  }
  Bed own(c);
  Bed peer(other);
  const TurnTimes times = take_turns(
      {.turns = choice.turns, .calls_own = c.on_band ? 10 : 2, .calls_peer = 2}, [&] { own.run(); },
      [&] { peer.run(); });
  auto extra = per_pixel(times, own.pixels());
  extra["peer_ns_per_px"] = percentile(times.peer_ms, 50) * 1e6 / peer.pixels();
  extra["peer_min_ns_per_px"] = percentile(times.peer_ms, 0) * 1e6 / peer.pixels();
  report.add(name, other.name(), times, extra);
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
  measure_pair({.on_band = true}, {}, choice, report);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    const std::string name = hwy::TargetName(target);
    measure({.variant = "/" + name, .instruction_set = target}, choice, report);
    measure({.smoothing = kInteger, .variant = "/int16/" + name, .instruction_set = target}, choice, report);
  }
  for (const int width : {64, 401, 512, 1024, 1040, 2048}) {
    measure({.width = width, .height = width == 401 ? 600 : width}, choice, report);
  }
  measure_pair({.width = 1024, .height = 1024}, {.width = 1040, .height = 1040}, choice, report);
}

}  // namespace tubed
