#include "drivers/laboratory/fluoroscope_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "drivers/laboratory/random/counter_random.hpp"

namespace tubed {

namespace {

constexpr std::size_t kNoiseMargin = 128;  ///< px by which the noise window moves
constexpr double kOutlineStep_mm = 1;      ///< chords of 1 mm are within 0.005 mm of a 27 mm arch
constexpr double kBlur_px = 0.8;           ///< standard deviation of the edges
constexpr double kReach = 4;               ///< blurs beyond the edge at which nothing is left
constexpr double kStepsPerBlur = 64;       ///< of the table
constexpr float kMeanGrey = 150;
constexpr int kWaves = 24;
constexpr double kTexture_grey = 8;  ///< standard deviation of the texture
constexpr int kRibs = 6;
constexpr double kRib_grey = 12;
constexpr std::int64_t kBackgroundStream = 1000;
constexpr std::uint64_t kWindows = 8;        ///< of the noise, across and down
constexpr std::uint64_t kWindowStride = 37;  ///< from one exposure to the next; odd, so that all come in turn

struct Wave {
  double kx, ky, phase;  ///< rad per px, rad
};

/// Texture as a sum of waves 40 to 200 px long in all directions.
std::array<Wave, kWaves> random_waves(CounterRandom& random) {
  std::array<Wave, kWaves> waves{};
  for (Wave& wave : waves) {
    const double wave_number = 2 * std::numbers::pi / (40 + 160 * random.unit());
    const double direction = 2 * std::numbers::pi * random.unit();
    wave = {wave_number * std::cos(direction), wave_number * std::sin(direction),
            2 * std::numbers::pi * random.unit()};
  }
  return waves;
}

double texture_at(const std::array<Wave, kWaves>& waves, double x, double y) {
  double sum = 0;
  for (const Wave& wave : waves) {
    sum += std::cos(wave.kx * x + wave.ky * y + wave.phase);
  }
  return kTexture_grey * std::sqrt(2.0 / kWaves) * sum;
}

/// Bands that hang from the middle to both sides, with edges several px soft.
double ribs_at(int width, int height, double x, double y) {
  const double spacing_px = static_cast<double>(height) / kRibs;
  const double to_side = (x - width / 2.0) / width;
  const double phase = (y - 0.5 * width * to_side * to_side) / spacing_px;
  const double from_rib_px = (phase - std::floor(phase) - 0.5) * spacing_px;
  const double half_width_px = spacing_px / 6;
  return -kRib_grey / (1 + std::exp((std::abs(from_rib_px) - half_width_px) / 3));
}

std::vector<float> draw_chest(int width, int height, CounterRandom random) {
  const auto waves = random_waves(random);
  std::vector<float> grey;
  grey.reserve(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      grey.push_back(kMeanGrey + static_cast<float>(texture_at(waves, x, y) + ribs_at(width, height, x, y)));
    }
  }
  return grey;
}

std::vector<float> draw_noise(std::size_t count, double sigma_grey, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal(0.0F, static_cast<float>(sigma_grey));
  std::vector<float> noise(count);
  std::generate(noise.begin(), noise.end(), [&] { return normal(engine); });
  return noise;
}

/// Integral of the blur's Gaussian from minus infinity to x, for x = -kReach .. kReach blurs.
std::vector<float> normal_integral_table() {
  std::vector<float> table;
  for (int i = 0; i <= static_cast<int>(2 * kReach * kStepsPerBlur); ++i) {
    const double x = i / kStepsPerBlur - kReach;
    table.push_back(static_cast<float>(0.5 * std::erfc(-x / std::numbers::sqrt2)));
  }
  return table;
}

std::int64_t stream_of(const CameraCalibration& camera) {
  std::int64_t stream = 0;
  for (const char letter : camera.name) {
    stream = (stream * 131 + static_cast<unsigned char>(letter)) % 1'000'003;
  }
  return stream;
}

std::size_t outline_points(double length_mm) {
  return static_cast<std::size_t>(length_mm / kOutlineStep_mm) + 1;
}

/// The place of a pixel in a picture that is continued by its mirror images to all sides.
std::size_t mirrored(int place, int size) {
  const int period = 2 * size;
  const int in_period = ((place % period) + period) % period;
  return static_cast<std::size_t>(in_period < size ? in_period : period - 1 - in_period);
}

Eigen::Vector3d behind_the_scene(const CameraCalibration& camera) {
  const Eigen::Vector3d beyond =
      camera.T_camera_world.linear().row(2).transpose() * FluoroscopeRenderer::kBackgroundDepth_mm;
  return camera.looked_at_world_mm().value_or(Eigen::Vector3d::Zero()) + beyond;
}

}  // namespace

FluoroscopeRenderer::FluoroscopeRenderer(const CameraCalibration& camera, const SimulatedWorld& world,
                                         std::int64_t seed, double cnr)
    : camera_(camera),
      background_world_mm_(behind_the_scene(camera)),
      width_(camera.width),
      height_(camera.height),
      seed_(seed + stream_of(camera)),
      background_(draw_chest(width_, height_, CounterRandom(seed_, kBackgroundStream, 0))),
      noise_width_(width_ + static_cast<int>(kNoiseMargin)),
      noise_(draw_noise(
          static_cast<std::size_t>(noise_width_) * (static_cast<std::size_t>(height_) + kNoiseMargin),
          kCatheterContrast_grey / cnr, static_cast<std::uint64_t>(seed_))),
      normal_integral_(normal_integral_table()),
      picture_(background_.size()),
      coverage_(background_.size(), 0.0F) {
  // Written once, so that no page of it is new to a real-time thread.
  covered_.resize(background_.size());
  covered_.clear();
  std::size_t longest = 0;
  for (const InstrumentDescription& instrument : world.room().instruments) {
    longest = std::max(longest, outline_points(instrument.length_mm));
  }
  outline_.reserve(longest);
}

void FluoroscopeRenderer::look_from(const ViewGeometry& view) {
  const auto at_rest = (camera_.look_from(std::nullopt), camera_.project(background_world_mm_));
  camera_.look_from(view);
  const auto now = camera_.project(background_world_mm_);
  background_off_px_.setZero();
  if (at_rest && now) {
    background_off_px_ = (now->p_image_px - at_rest->p_image_px).array().round().cast<int>().matrix();
  }
}

void FluoroscopeRenderer::render(const SimulatedWorld& world, double t_s, std::int64_t exposure,
                                 std::span<std::uint8_t> pixels) {
  draw_background(exposure);
  for (std::size_t instrument = 0; instrument < world.room().instruments.size(); ++instrument) {
    if (world.catheter_of(static_cast<int>(instrument)) == static_cast<int>(instrument)) {
      draw_catheter(world, static_cast<int>(instrument), t_s);
    }
  }
  std::transform(picture_.begin(), picture_.end(), pixels.begin(),
                 [](float grey) { return static_cast<std::uint8_t>(std::clamp(grey + 0.5F, 0.0F, 255.0F)); });
}

void FluoroscopeRenderer::draw_background(std::int64_t exposure) {
  // All windows in turn. Two of them are the same or so far from each other that what looks for small shifts
  // of the background finds none in the noise, which comes again here and never does in an X-ray image.
  const std::uint64_t window = static_cast<std::uint64_t>(exposure) * kWindowStride % (kWindows * kWindows);
  const std::size_t left = window % kWindows * (kNoiseMargin / kWindows);
  const std::size_t top = window / kWindows * (kNoiseMargin / kWindows);
  const auto width = static_cast<std::size_t>(width_);
  for (std::size_t y = 0; y < static_cast<std::size_t>(height_); ++y) {
    const float* still =
        &background_[mirrored(static_cast<int>(y) - background_off_px_.y(), height_) * width];
    const float* noise = &noise_[(y + top) * static_cast<std::size_t>(noise_width_) + left];
    if (background_off_px_.x() == 0) {
      std::transform(still, still + width, noise, &picture_[y * width], std::plus<>());
      continue;
    }
    for (std::size_t x = 0; x < width; ++x) {
      picture_[y * width + x] =
          still[mirrored(static_cast<int>(x) - background_off_px_.x(), width_)] + noise[x];
    }
  }
}

void FluoroscopeRenderer::draw_catheter(const SimulatedWorld& world, int instrument, double t_s) {
  project_centreline(world, instrument, t_s);
  for (std::size_t i = 1; i < outline_.size(); ++i) {
    if (outline_[i - 1].seen && outline_[i].seen) {
      cover(outline_[i - 1], outline_[i]);
    }
  }
  for (const std::uint32_t pixel : covered_) {
    picture_[pixel] -= static_cast<float>(kCatheterContrast_grey) * coverage_[pixel];
    coverage_[pixel] = 0;
  }
  covered_.clear();
}

void FluoroscopeRenderer::project_centreline(const SimulatedWorld& world, int instrument, double t_s) {
  const InstrumentDescription& catheter = world.room().instruments[static_cast<std::size_t>(instrument)];
  const double f_px = std::sqrt(camera_.calibration().fx * camera_.calibration().fy);
  outline_.clear();
  for (std::size_t i = 0; i < outline_points(catheter.length_mm); ++i) {
    const double s_mm = static_cast<double>(i) * kOutlineStep_mm;
    const auto projected = camera_.project(world.point(instrument, t_s, s_mm));
    Outline& outline = outline_.emplace_back();
    outline.seen = projected.has_value();
    if (projected) {
      outline.p_image_px = projected->p_image_px;
      outline.radius_px = 0.5 * catheter.diameter_mm * f_px / projected->depth_mm;
    }
  }
}

void FluoroscopeRenderer::cover(const Outline& from, const Outline& to) {
  const double reach_px = from.radius_px + kReach * kBlur_px;
  const Eigen::Vector2d low = (from.p_image_px.cwiseMin(to.p_image_px).array() - reach_px).matrix();
  const Eigen::Vector2d high = (from.p_image_px.cwiseMax(to.p_image_px).array() + reach_px).matrix();
  if (!(high.x() >= 0 && high.y() >= 0 && low.x() <= width_ - 1 && low.y() <= height_ - 1)) {
    return;
  }
  const int left = static_cast<int>(std::ceil(std::max(low.x(), 0.0)));
  const int right = static_cast<int>(std::floor(std::min(high.x(), width_ - 1.0)));
  const int top = static_cast<int>(std::ceil(std::max(low.y(), 0.0)));
  const int bottom = static_cast<int>(std::floor(std::min(high.y(), height_ - 1.0)));
  const Eigen::Vector2d chord = to.p_image_px - from.p_image_px;
  const double chord_squared = std::max(chord.squaredNorm(), 1e-12);
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const Eigen::Vector2d offset = Eigen::Vector2d(x, y) - from.p_image_px;
      const double along = std::clamp(offset.dot(chord) / chord_squared, 0.0, 1.0);
      const float covered = coverage((offset - along * chord).norm(), from.radius_px);
      const auto pixel = static_cast<std::uint32_t>(y * width_ + x);
      if (covered > coverage_[pixel]) {
        if (coverage_[pixel] == 0) {
          covered_.push_back(pixel);
        }
        coverage_[pixel] = covered;
      }
    }
  }
}

/// A band of the given half width blurred by a Gaussian: the difference of two of its integrals.
float FluoroscopeRenderer::coverage(double distance_px, double radius_px) const {
  const auto integral = [&](double x_px) {
    const double step = std::clamp((x_px / kBlur_px + kReach) * kStepsPerBlur, 0.0,
                                   static_cast<double>(normal_integral_.size() - 1) - 1e-6);
    const auto below = static_cast<std::size_t>(step);
    const auto part = static_cast<float>(step - static_cast<double>(below));
    return normal_integral_[below] + part * (normal_integral_[below + 1] - normal_integral_[below]);
  };
  return integral(radius_px - distance_px) - integral(-radius_px - distance_px);
}

}  // namespace tubed
