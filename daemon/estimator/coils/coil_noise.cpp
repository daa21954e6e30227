#include "daemon/estimator/coils/coil_noise.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kMedianOfChiSquared3 = 2.366;  // three axes
constexpr double kMedianOfChiSquared2 = 1.386;  // a unit vector has no noise along itself
constexpr double kUneven = 0.25;                // share by which two intervals may differ
// No tracker is exact, and the model of the tube is not either: noise is never taken for less than this share
// of the whole error, and never for much more than the settings say.
constexpr double kMinShare = 0.05;
constexpr double kMaxShare = 3;
constexpr double kMinLastingShare = 0.1;

double lasting(double whole, double noise) {
  const double least = kMinLastingShare * whole;
  return std::sqrt(std::max(whole * whole - noise * noise, least * least));
}

}  // namespace

CoilNoise::CoilNoise(const EstimatorSettings& settings)
    : settings_(settings),
      noise_position_mm_(settings.sigma_position_mm),
      noise_tangent_(settings.sigma_tangent) {}

void CoilNoise::reset() {
  next_ = 0;
  count_ = 0;
  noise_position_mm_ = settings_.sigma_position_mm;
  noise_tangent_ = settings_.sigma_tangent;
}

double CoilNoise::lasting_position_mm(double whole_mm) const { return lasting(whole_mm, noise_position_mm_); }

double CoilNoise::lasting_tangent(double whole) const { return lasting(whole, noise_tangent_); }

double CoilNoise::sigma_of(const Differences& squares, double median_of_chi_squared) {
  std::copy_n(squares.begin(), count_, scratch_.begin());
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(count_ / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.begin() + static_cast<std::ptrdiff_t>(count_));
  return std::sqrt(static_cast<double>(*middle) / median_of_chi_squared / 6);
}

void CoilNoise::observe(const EmFrame& frame, const EmHistory& history,
                        const InstrumentDescription& instrument) {
  const EmFrame* before = history.before(&frame, 1);
  const EmFrame* first = history.before(&frame, 2);
  if (before == nullptr || first == nullptr) {
    return;
  }
  const double later_s = seconds_between(before->measured, frame.measured);
  const double earlier_s = seconds_between(first->measured, before->measured);
  if (std::abs(later_s - earlier_s) > kUneven * std::max(later_s, earlier_s)) {
    return;
  }
  for (const CoilPlacement& placement : instrument.coils) {
    if (placement.sensor > std::min({frame.coil_count, before->coil_count, first->coil_count})) {
      continue;
    }
    const auto sensor = static_cast<std::size_t>(placement.sensor - 1);
    const CoilSample& c = frame.coils[sensor];
    const CoilSample& b = before->coils[sensor];
    const CoilSample& a = first->coils[sensor];
    if (a.status != CoilStatus::kOk || b.status != CoilStatus::kOk || c.status != CoilStatus::kOk ||
        c.p_em_mm == b.p_em_mm || b.p_em_mm == a.p_em_mm) {
      continue;  // a repeated value is no measurement
    }
    const Eigen::Vector3d position_mm = c.p_em_mm - 2 * b.p_em_mm + a.p_em_mm;
    const Eigen::Vector3d tangent = c.tangent_em - 2 * b.tangent_em + a.tangent_em;
    if (!position_mm.allFinite() || !tangent.allFinite()) {
      continue;
    }
    positions_mm2_[next_] = static_cast<float>(position_mm.squaredNorm());
    tangents_[next_] = static_cast<float>(tangent.squaredNorm());
    next_ = (next_ + 1) % kKept;
    count_ = std::min(count_ + 1, kKept);
  }
  if (known()) {
    const auto within = [](double sigma, double whole) {
      return std::clamp(sigma, kMinShare * whole, kMaxShare * whole);
    };
    noise_position_mm_ = within(sigma_of(positions_mm2_, kMedianOfChiSquared3), settings_.sigma_position_mm);
    noise_tangent_ = within(sigma_of(tangents_, kMedianOfChiSquared2), settings_.sigma_tangent);
  }
}

}  // namespace tubed
