#include "drivers/laboratory/tracker/em_errors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/em_noise.hpp"
#include "drivers/laboratory/tracker/gaussian.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kJitterStream = 1000;
constexpr std::int64_t kDropOutStream = 2000;
constexpr std::int64_t kOutlierStream = 3000;
constexpr std::int64_t kIndicatorStream = 4000;
constexpr std::int64_t kDisplacementStream = 7101;
constexpr std::int64_t kTurnStream = 7102;
constexpr std::int64_t kFrozenDraw = -1;

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
      displacement_(seed, kDisplacementStream, settings_.warp_mm, working_volume_em_mm),
      turn_(seed, kTurnStream, settings_.warp_rad, working_volume_em_mm) {}

Eigen::Vector3d EmErrors::warp_mm(const Eigen::Vector3d& p_em_mm) const noexcept {
  return displacement_.at(p_em_mm);
}

Eigen::Vector3d EmErrors::warp_rad(const Eigen::Vector3d& p_em_mm) const noexcept {
  return turn_.at(p_em_mm);
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
