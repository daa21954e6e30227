#include "clients/calibration/moving_noise.hpp"

#include <algorithm>
#include <cmath>

#include "clients/calibration/coil_series.hpp"
#include "clients/calibration/formatted.hpp"
#include "clients/calibration/median.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kMinTime_s = 5;
constexpr std::size_t kMinDifferences = 100;
constexpr double kUneven = 0.25;        // of the usual time between measurements
constexpr double kMedian = 0.67449;     // of the absolute value of a normal number
constexpr double kOfDifference = 20;    // variance, 1 + 9 + 9 + 1
constexpr double kMedianSpread = 1.36;  // variance of ln sigma by a median of n absolute values, times n
constexpr double kTogether = 2.3;       // differences that see the same noise
constexpr double kMoves_mm_s = 2;       // below, a coil is as good as still
constexpr double kNotedSigmas = 4;

/// One third difference.
struct Difference {
  Eigen::Vector3d p_mm;
  Eigen::Vector3d tangent;
  double speed_mm_s;
};

double usual_period_s(const CoilSeries& series) {
  std::vector<double> periods_s;
  for (std::size_t i = 1; i < series.t_s.size(); ++i) periods_s.push_back(series.t_s[i] - series.t_s[i - 1]);
  return periods_s.empty() ? 0 : median_of(std::move(periods_s));
}

std::vector<Difference> third_differences(const CoilSeries& series) {
  const double period_s = usual_period_s(series);
  std::vector<Difference> differences;
  for (std::size_t i = 3; i < series.t_s.size(); ++i) {
    bool is_even = true;
    for (std::size_t k = i - 2; k <= i; ++k) {
      is_even = is_even && std::abs(series.t_s[k] - series.t_s[k - 1] - period_s) < kUneven * period_s;
    }
    if (!is_even) continue;
    const auto third = [i](const std::vector<Eigen::Vector3d>& x) -> Eigen::Vector3d {
      return x[i] - 3 * x[i - 1] + 3 * x[i - 2] - x[i - 3];
    };
    differences.push_back({third(series.p_mm), third(series.tangent), 0});
    // Over as long as averages most of the noise out.
    constexpr std::size_t kReach = 10;
    const std::size_t from = i > kReach ? i - kReach : 0;
    const std::size_t until = std::min(i + kReach, series.t_s.size() - 1);
    differences.back().speed_mm_s =
        (series.p_mm[until] - series.p_mm[from]).norm() / (series.t_s[until] - series.t_s[from]);
  }
  return differences;
}

/// Variance of one measurement, the sum over the axes.
template <typename OfDifference>
double variance_of(const std::vector<Difference>& differences, OfDifference of) {
  double sum = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    std::vector<double> sizes;
    for (const Difference& one : differences) sizes.push_back(std::abs(of(one)[axis]));
    sum += squared(median_of(std::move(sizes)) / kMedian) / kOfDifference;
  }
  return sum;
}

double position_mm(const std::vector<Difference>& differences) {
  return std::sqrt(variance_of(differences, [](const Difference& one) { return one.p_mm; }) / 3);
}

MovingCoil moving_coil(std::vector<Difference> differences, int sensor) {
  MovingCoil coil;
  coil.sensor = sensor;
  coil.differences = static_cast<int>(differences.size());
  coil.noise_mm = position_mm(differences);
  // A unit tangent moves on two axes.
  coil.tangent = std::sqrt(variance_of(differences, [](const Difference& one) { return one.tangent; }) / 2);
  std::ranges::sort(differences, {}, &Difference::speed_mm_s);
  const auto half = static_cast<std::ptrdiff_t>(differences.size() / 2);
  coil.median_mm_s = differences[static_cast<std::size_t>(half)].speed_mm_s;
  coil.slow_noise_mm = position_mm({differences.begin(), differences.begin() + half});
  coil.fast_noise_mm = position_mm({differences.begin() + half, differences.end()});
  // Two halves, three axes.
  coil.ratio_sigma = std::sqrt(2 * kMedianSpread * kTogether / (3 * static_cast<double>(half)));
  return coil;
}

void remark(const MovingCoil& coil, std::vector<std::string>& remarks) {
  // Exactly none: stuck.
  const double ratio = coil.slow_noise_mm > 0 ? std::log(coil.fast_noise_mm / coil.slow_noise_mm) : 0;
  if (std::abs(ratio) > kNotedSigmas * coil.ratio_sigma) {
    remarks.push_back(
        formatted("sensor %d shakes by %.3f mm an axis while it moves by less than %.0f mm/s, and by %.3f mm "
                  "while it is faster: the tracker, or the hand that moves it",
                  coil.sensor, coil.slow_noise_mm, coil.median_mm_s, coil.fast_noise_mm));
  }
}

}  // namespace

MovingNoise measure_moving(const CoilRecording& recording) {
  require_time(recording, kMinTime_s);
  MovingNoise noise;
  const double spans_s = recording.measurements.back().t_s - recording.measurements.front().t_s;
  noise.rate_hz = static_cast<double>(recording.measurements.size() - 1) / spans_s;
  double positions = 0;
  double tangents = 0;
  double fastest_mm_s = 0;
  for (const CoilPlacement& placement : recording.instrument.coils) {
    std::vector<Difference> differences = third_differences(CoilSeries(recording, placement));
    if (differences.size() < kMinDifferences) {
      noise.remarks.push_back(
          formatted("sensor %d gave %zu differences of four measurements in a row, %zu are needed: left out",
                    placement.sensor, differences.size(), kMinDifferences));
      continue;
    }
    noise.coils.push_back(moving_coil(std::move(differences), placement.sensor));
    const MovingCoil& coil = noise.coils.back();
    positions += squared(coil.noise_mm);
    tangents += squared(coil.tangent);
    fastest_mm_s = std::max(fastest_mm_s, coil.median_mm_s);
    remark(coil, noise.remarks);
  }
  if (noise.coils.empty()) {
    throw CalibrationError(
        recording.from +
        formatted(
            ": no coil gave %zu times four measurements in a row; is the tracker tracking them? `tubectl "
            "doctor --tracker` says",
            kMinDifferences));
  }
  if (fastest_mm_s < kMoves_mm_s) {
    noise.remarks.push_back(
        formatted("half of the time no coil moved by more than %.1f mm/s: for still coils `tubectl calibrate "
                  "noise` without --moving tells more",
                  fastest_mm_s));
  }
  const auto many = static_cast<double>(noise.coils.size());
  noise.position_mm = std::sqrt(positions / many);
  noise.tangent = std::sqrt(tangents / many);
  return noise;
}

}  // namespace tubed
