#include "drivers/laboratory/tracker/em_errors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/em_noise.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kJitterStream = 1000;
constexpr std::int64_t kDropOutStream = 2000;
constexpr std::int64_t kOutlierStream = 3000;
constexpr std::int64_t kIndicatorStream = 4000;
constexpr std::int64_t kDisplacementStream = 7101;
constexpr std::int64_t kTurnStream = 7102;
constexpr std::int64_t kFrozenDraw = -1;

double gaussian(CounterRandom& random) {  // Box and Muller
  const double radius = std::sqrt(-2 * std::log(1 - random.unit()));
  return radius * std::cos(2 * std::numbers::pi * random.unit());
}

Eigen::Vector3d gaussian_vector(CounterRandom& random) {
  const double x = gaussian(random);
  const double y = gaussian(random);
  return {x, y, gaussian(random)};
}

Eigen::Vector3d turned(const Eigen::Vector3d& tangent, const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  return angle == 0 ? tangent
                    : Eigen::Vector3d(Eigen::AngleAxisd(angle, rotation_rad / angle) * tangent).normalized();
}

bool holds(const EmEvent& event, int sensor, double t_s) {
  return (event.sensor == 0 || event.sensor == sensor) && t_s >= event.from_s && t_s < event.until_s;
}

CoilSample silent(CoilStatus status) {
  CoilSample sample;
  sample.status = status;
  return sample;
}

}  // namespace

EmErrors::EmErrors(EmErrorSettings settings, std::int64_t seed,
                   const Eigen::AlignedBox3d& working_volume_em_mm)
    : settings_(std::move(settings)),
      seed_(seed),
      displacement_(draw_field(seed, kDisplacementStream, settings_.warp_mm, working_volume_em_mm)),
      turn_(draw_field(seed, kTurnStream, settings_.warp_rad, working_volume_em_mm)) {}

EmErrors::Field EmErrors::draw_field(std::int64_t seed, std::int64_t stream, double greatest,
                                     const Eigen::AlignedBox3d& volume) {
  constexpr int kWaves = 6;
  constexpr double kShortest_mm = 350;
  constexpr double kMax_mm = 900;
  constexpr int kLooks = 16;  ///< an axis
  Field field;
  if (greatest == 0) {
    return field;
  }
  CounterRandom random(seed, stream, 0);
  for (int wave = 0; wave < kWaves; ++wave) {
    const Eigen::Vector3d amplitude = gaussian_vector(random);
    const Eigen::Vector3d direction = gaussian_vector(random).normalized();
    // w(p) = sum_k a_k cos(k_k . p + phi_k): smooth and static, as eddy currents in fixed metal distort a
    // field.
    const double length_mm = kShortest_mm + (kMax_mm - kShortest_mm) * random.unit();
    field.push_back(
        {amplitude, 2 * std::numbers::pi / length_mm * direction, 2 * std::numbers::pi * random.unit()});
  }
  double found = 0;
  for (int i = 0; i < kLooks * kLooks * kLooks; ++i) {
    const Eigen::Array3d share(i % kLooks, i / kLooks % kLooks, i / kLooks / kLooks);
    const Eigen::Vector3d p_mm =
        volume.min().array() + volume.sizes().array() * share / static_cast<double>(kLooks - 1);
    found = std::max(found, value_of(field, p_mm).norm());
  }
  for (Wave& wave : field) {
    wave.amplitude *= greatest / found;
  }
  return field;
}

Eigen::Vector3d EmErrors::value_of(const Field& field, const Eigen::Vector3d& p_mm) noexcept {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Wave& wave : field) {
    sum += wave.amplitude * std::cos(wave.wave_number_per_mm.dot(p_mm) + wave.phase_rad);
  }
  return sum;
}

Eigen::Vector3d EmErrors::warp_mm(const Eigen::Vector3d& p_em_mm) const noexcept {
  return value_of(displacement_, p_em_mm);
}

Eigen::Vector3d EmErrors::warp_rad(const Eigen::Vector3d& p_em_mm) const noexcept {
  return value_of(turn_, p_em_mm);
}

std::optional<double> EmErrors::stuck_since_s(int sensor, double t_s) const noexcept {
  for (const EmEvent& event : settings_.events) {
    if (event.kind == EmEventKind::kStuck && holds(event, sensor, t_s)) {
      return event.from_s;
    }
  }
  return std::nullopt;
}

CoilSample EmErrors::measure(int sensor, std::int64_t k, double t_s, const Eigen::Vector3d& p_em_mm,
                             const Eigen::Vector3d& tangent_em) const noexcept {
  if (CounterRandom(seed_, kDropOutStream + sensor, k).unit() < settings_.drop_out_share) {
    return silent(CoilStatus::kMissing);
  }
  Eigen::Vector3d offset_mm = warp_mm(p_em_mm);
  Eigen::Vector3d turn_rad = warp_rad(p_em_mm);
  for (const MetalObject& metal : settings_.metal) {
    if (t_s >= metal.from_s && t_s < metal.until_s) {
      const Eigen::Vector3d away =
          p_em_mm - metal.start_em_mm - (t_s - metal.from_s) * metal.velocity_em_mm_s;
      const double distance = std::max(away.norm(), 1e-6);
      const double left = 1 / (1 + std::pow(distance / metal.reach_mm, 3));
      offset_mm += metal.max_mm * left / distance * away;
      turn_rad += metal.max_rad * left / distance * away;
    }
  }
  CounterRandom jitter(seed_, kJitterStream + sensor, k);
  // jitter_mm is the root mean square of the whole vector: 1 / sqrt(3) of it an axis.
  offset_mm += settings_.jitter_mm / std::sqrt(3.0) * gaussian_vector(jitter);
  // Only the two components across the tangent turn it.
  turn_rad += settings_.jitter_rad / std::sqrt(2.0) * gaussian_vector(jitter);

  for (const EmEvent& event : settings_.events) {
    if (!holds(event, sensor, t_s)) {
      continue;
    }
    if (event.kind == EmEventKind::kDropOut) {
      return silent(CoilStatus::kMissing);
    }
    if (event.kind == EmEventKind::kOutOfVolume) {
      return silent(CoilStatus::kOutOfVolume);
    }
    if (event.kind == EmEventKind::kOutlier) {
      CounterRandom outlier(seed_, kOutlierStream + sensor, k);
      offset_mm += event.size_mm * gaussian_vector(outlier).normalized();
    }
  }
  if (!settings_.volume_em_mm.contains(p_em_mm)) {
    return silent(CoilStatus::kOutOfVolume);
  }
  CounterRandom random(seed_, sensor, settings_.draw == NoiseDraw::kOncePerCoil ? kFrozenDraw : k);
  CoilSample sample;
  sample.status = CoilStatus::kOk;
  sample.p_em_mm = noisy_position(p_em_mm, settings_.lambda_mm, random) + offset_mm;
  sample.tangent_em = turned(noisy_tangent(tangent_em, settings_.psi_rad, random), turn_rad);
  sample.indicator = 0.3 + 0.3 * CounterRandom(seed_, kIndicatorStream + sensor, k).unit();
  return sample;
}

}  // namespace tubed
