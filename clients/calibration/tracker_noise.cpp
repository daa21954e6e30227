#include "clients/calibration/tracker_noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "clients/calibration/coil_rest.hpp"
#include "clients/calibration/coil_series.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kMinTime_s = 5;
constexpr int kMinMeasurements = 100;
constexpr int kAveraged = 40;
constexpr double kFisher = 1e-4;  // by chance, a recording in ten thousand
constexpr double kDriftSigmas = 5;
constexpr double kNotedDrift_mm_min = 0.2;
constexpr double kExcess = 2;               // of averaged noise over what white noise leaves
constexpr std::size_t kMaxSpectrum = 1200;  // measurements whose spectrum is looked at
constexpr double kReach_mm = 25;
constexpr int kMinImages = 20;

std::string words(const char* format, auto... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// Half the mean square of successive differences, an axis.
Eigen::Vector3d successive_variance(const std::vector<Eigen::Vector3d>& values) {
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  for (std::size_t i = 1; i < values.size(); ++i) {
    sum += (values[i] - values[i - 1]).array().square() / 2;
  }
  return sum / std::max(static_cast<double>(values.size()) - 1, 1.0);
}

/// Allan variance of means over `count` values.
double allan_mm(const std::vector<Eigen::Vector3d>& values, int count) {
  std::vector<Eigen::Vector3d> means;
  for (std::size_t from = 0; from + static_cast<std::size_t>(count) <= values.size();
       from += static_cast<std::size_t>(count)) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < count; ++i) {
      sum += values[from + static_cast<std::size_t>(i)] / count;
    }
    means.push_back(sum);
  }
  return means.size() < 2 ? 0 : std::sqrt(successive_variance(means).sum() / 3);
}

/// The straight line in time that fits best: mm/min and its standard deviation from white noise.
void find_drift(const CoilSeries& series, StillCoil& coil) {
  const auto count = static_cast<double>(series.t_s.size());
  double mean_s = 0;
  for (const double t_s : series.t_s) mean_s += t_s / count;
  double spread = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < series.t_s.size(); ++i) {
    spread += squared(series.t_s[i] - mean_s);
    slope += (series.t_s[i] - mean_s) * (series.p_mm[i] - coil.p_em_mm);
  }
  coil.drift_mm_min = 60 * slope.norm() / spread;
  coil.drift_sigma_mm_min = 60 * coil.white_rms_mm() / std::sqrt(spread);
}

/// Fisher, Tests of significance in harmonic analysis, 1929: the share g of the largest of m ordinates is
/// exceeded by chance with a probability below m (1 - g)^(m - 1). All three axes are added up: ordinates then
/// have six degrees of freedom instead of two, which makes large shares less likely, so that the bound holds.
void find_interference(const CoilSeries& series, double rate_hz, StillCoil& coil) {
  const std::size_t count = std::min(series.p_mm.size(), kMaxSpectrum);
  const std::size_t ordinates = (count - 1) / 2;
  double sum = 0;
  double largest = 0;
  std::size_t at = 0;
  for (std::size_t f = 1; f <= ordinates; ++f) {
    Eigen::Vector3cd line = Eigen::Vector3cd::Zero();
    const std::complex<double> turn =
        std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(f) / static_cast<double>(count));
    std::complex<double> phase = 1;
    for (std::size_t i = 0; i < count; ++i) {
      line += phase * (series.p_mm[i] - coil.p_em_mm).cast<std::complex<double>>();
      phase *= turn;
    }
    const double power = line.squaredNorm();
    sum += power;
    if (power > largest) {
      largest = power;
      at = f;
    }
  }
  const double share = sum > 0 ? largest / sum : 0;
  const double by_chance =
      static_cast<double>(ordinates) * std::pow(1 - share, static_cast<double>(ordinates) - 1);
  // The lowest lines are drift.
  if (by_chance < kFisher && at > 2) {
    coil.interference_hz = static_cast<double>(at) * rate_hz / static_cast<double>(count);
    coil.interference_mm = 2 * std::sqrt(largest) / static_cast<double>(count);
  }
}

StillCoil still_coil(const CoilSeries& series, const CoilRest& rest, int sensor, double rate_hz) {
  StillCoil coil;
  coil.sensor = sensor;
  coil.measurements = rest.measurements;
  coil.p_em_mm = rest.p_em_mm;
  coil.white_mm = successive_variance(series.p_mm).cwiseSqrt();
  Eigen::Array3d squares = Eigen::Array3d::Zero();
  for (const Eigen::Vector3d& p : series.p_mm) {
    squares += (p - rest.p_em_mm).array().square();
    const Eigen::Vector3d off = p - rest.p_em_mm;
    coil.deviations_mm.insert(coil.deviations_mm.end(), {off.x(), off.y(), off.z()});
  }
  const auto count = static_cast<double>(series.p_mm.size());
  coil.total_mm = (squares / (count - 1)).sqrt();
  // Of a variance from successive differences: 3 / (2 n) instead of 1 / (2 n), relative and squared, an axis.
  coil.white_sigma_mm = coil.white_rms_mm() * std::sqrt(3.0 / (4 * 3 * count));
  // A unit tangent moves on two axes.
  coil.tangent = std::sqrt(successive_variance(series.tangent).sum() / 2);
  coil.averaged_mm = allan_mm(series.p_mm, kAveraged);
  coil.expected_mm = coil.white_rms_mm() / std::sqrt(static_cast<double>(kAveraged));
  find_drift(series, coil);
  find_interference(series, rate_hz, coil);
  return coil;
}

void remark(const StillCoil& coil, std::vector<std::string>& remarks) {
  if (coil.interference_hz > 0) {
    remarks.push_back(
        words("sensor %d shakes at %.2f Hz by %.2f mm: something periodic interferes (mains, a drive, a "
              "ventilator, or the table's vibration)",
              coil.sensor, coil.interference_hz, coil.interference_mm));
  }
  if (coil.drift_mm_min > kNotedDrift_mm_min && coil.drift_mm_min > kDriftSigmas * coil.drift_sigma_mm_min) {
    remarks.push_back(
        words("sensor %d drifts by %.2f mm a minute: let the tracker warm up, or it is being pulled",
              coil.sensor, coil.drift_mm_min));
  } else if (coil.averaged_mm > kExcess * coil.expected_mm && coil.interference_hz == 0) {
    remarks.push_back(
        words("sensor %d: means over %d measurements still shake by %.3f mm, white noise leaves %.3f mm: "
              "averaging does not help there",
              coil.sensor, kAveraged, coil.averaged_mm, coil.expected_mm));
  }
}

}  // namespace

StillNoise measure_still(const CoilRecording& recording) {
  require_time(recording, kMinTime_s);
  StillNoise noise;
  const double spans_s = recording.measurements.back().t_s - recording.measurements.front().t_s;
  noise.rate_hz = static_cast<double>(recording.measurements.size() - 1) / spans_s;
  double tangents = 0;
  double positions = 0;
  for (std::size_t k = 0; k < recording.instrument.coils.size(); ++k) {
    const CoilPlacement& placement = recording.instrument.coils[k];
    const auto rest = rest_of(recording.measurements, placement, kMinMeasurements);
    if (!rest) {
      noise.remarks.push_back(words("sensor %d gave fewer than %d measurements and is left out",
                                    placement.sensor, kMinMeasurements));
      continue;
    }
    if (rest->moved_mm > rest->moved_limit_mm) {
      throw CalibrationError(
          recording.from +
          words(": coil %zu (sensor %d) moved by %.1f mm while it should have been still; fix it "
                "and record again",
                k + 1, placement.sensor, rest->moved_mm));
    }
    if (rest->noise_mm.norm() == 0) {
      noise.remarks.push_back(
          words("sensor %d gave the same values all the time (stuck) and is left out", placement.sensor));
      continue;
    }
    noise.coils.push_back(
        still_coil(CoilSeries(recording, placement), *rest, placement.sensor, noise.rate_hz));
    positions += squared(noise.coils.back().white_rms_mm());
    tangents += squared(noise.coils.back().tangent);
    remark(noise.coils.back(), noise.remarks);
  }
  if (noise.coils.empty()) {
    throw CalibrationError(recording.from +
                           words(": no coil gave %d measurements that differ; is the tracker tracking "
                                 "them? `tubectl doctor --tracker` says",
                                 kMinMeasurements));
  }
  const auto many = static_cast<double>(noise.coils.size());
  noise.position_mm = std::sqrt(positions / many);
  noise.tangent = std::sqrt(tangents / many);
  return noise;
}

}  // namespace tubed
