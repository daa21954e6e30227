#include "clients/calibration/coil_rest.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kMean_s = 0.5;
constexpr double kDrift_mm = 1.0;  // that is none of a hand's
constexpr double kSigmas = 6;      // of the difference of two means

/// Means over pieces of half a second, and how many measurements the smallest has.
struct Means {
  std::vector<Eigen::Vector3d> p_mm;
  std::size_t fewest = 0;
};

Means means_of(const std::vector<double>& t_s, const std::vector<Eigen::Vector3d>& p_mm) {
  Means means;
  std::size_t from = 0;
  while (from < p_mm.size()) {
    std::size_t until = from;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    while (until < p_mm.size() && (t_s[until] < t_s[from] + kMean_s || until < from + 4)) {
      sum += p_mm[until++];
    }
    const std::size_t count = until - from;
    if (count >= 4) {
      means.p_mm.emplace_back(sum / static_cast<double>(count));
      means.fewest = means.fewest == 0 ? count : std::min(means.fewest, count);
    }
    from = until;
  }
  return means;
}

}  // namespace

std::optional<CoilRest> rest_of(const std::vector<SequenceMeasurement>& measurements,
                                const CoilPlacement& coil, int min_measurements) {
  std::vector<double> t_s;
  std::vector<Eigen::Vector3d> p_mm;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (const SequenceMeasurement& measurement : measurements) {
    if (const CoilSample* const sample = sample_of(measurement, coil)) {
      t_s.push_back(measurement.t_s);
      p_mm.push_back(sample->p_em_mm);
      direction += sample->tangent_em;
    }
  }
  if (static_cast<int>(p_mm.size()) < std::max(min_measurements, 2)) {
    return std::nullopt;
  }
  CoilRest rest;
  rest.measurements = static_cast<int>(p_mm.size());
  rest.tangent_em = direction.normalized();
  for (const Eigen::Vector3d& p : p_mm) {
    rest.p_em_mm += p / static_cast<double>(p_mm.size());
  }
  // The difference of two measurements has twice the variance of one.
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  for (std::size_t i = 1; i < p_mm.size(); ++i) {
    squares += (p_mm[i] - p_mm[i - 1]).array().square() / 2;
  }
  rest.noise_mm = (squares / static_cast<double>(p_mm.size() - 1)).sqrt();
  const Means means = means_of(t_s, p_mm);
  for (const Eigen::Vector3d& a : means.p_mm) {
    for (const Eigen::Vector3d& b : means.p_mm) {
      rest.moved_mm = std::max(rest.moved_mm, (a - b).norm());
    }
  }
  const double mean_sigma_mm =
      rest.noise_mm.norm() * std::sqrt(2.0 / static_cast<double>(std::max<std::size_t>(means.fewest, 1)));
  rest.moved_limit_mm = kDrift_mm + kSigmas * mean_sigma_mm;
  return rest;
}

}  // namespace tubed
