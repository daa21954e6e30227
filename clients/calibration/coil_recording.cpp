#include "clients/calibration/coil_recording.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace tubed {

namespace {

constexpr double kMaxGap_s = 0.3;

}  // namespace

CoilRecording coils_of(const Sequence& sequence) {
  return {sequence.folder.string(), sequence.room.instruments.front(), sequence.measurements};
}

const CoilSample* sample_of(const SequenceMeasurement& measurement, const CoilPlacement& coil) {
  const int index = coil.sensor - 1;
  if (index < 0 || index >= measurement.coil_count) {
    return nullptr;
  }
  const CoilSample& sample = measurement.coils[static_cast<std::size_t>(index)];
  const bool is_good =
      sample.status == CoilStatus::kOk && sample.p_em_mm.allFinite() && sample.tangent_em.allFinite();
  return is_good ? &sample : nullptr;
}

void require_time(const CoilRecording& recording, double min_s) {
  if (recording.measurements.empty()) {
    throw CalibrationError(recording.from +
                           ": no measurement of coils; is the tracker connected and tracking?");
  }
  const double spans_s = recording.measurements.back().t_s - recording.measurements.front().t_s;
  if (spans_s >= min_s) {
    return;
  }
  std::array<char, 160> words{};
  std::snprintf(
      words.data(), words.size(), ": %zu measurements span %.2f s, %.1f s are needed; %s",
      recording.measurements.size(), spans_s, min_s,
      spans_s == 0 && recording.measurements.size() > 1 ? "their time stamps stand still" : "record longer");
  throw CalibrationError(recording.from + words.data());
}

CoilTrack::CoilTrack(const std::vector<SequenceMeasurement>& measurements, const CoilPlacement& coil) {
  for (const SequenceMeasurement& measurement : measurements) {
    const CoilSample* const sample = sample_of(measurement, coil);
    if (sample != nullptr && (t_s_.empty() || measurement.t_s > t_s_.back())) {
      t_s_.push_back(measurement.t_s);
      p_em_mm_.push_back(sample->p_em_mm);
      toward_tip_em_.push_back(coil.flipped ? Eigen::Vector3d(-sample->tangent_em) : sample->tangent_em);
    }
  }
}

std::optional<CoilTrack::Place> CoilTrack::at(double t_s, double half_window_s) const {
  const auto after = std::lower_bound(t_s_.begin(), t_s_.end(), t_s);
  const auto next = static_cast<std::size_t>(after - t_s_.begin());
  const bool has_next = next < t_s_.size() && t_s_[next] - t_s <= kMaxGap_s;
  const bool has_before = next > 0 && t_s - t_s_[next - 1] <= kMaxGap_s;
  if (has_next && t_s_[next] == t_s && half_window_s <= 0) {
    return Place{p_em_mm_[next], toward_tip_em_[next].normalized(), Eigen::Vector3d::Zero(), 1};
  }
  if (!has_next || !has_before) {
    const bool is_exact = has_next && t_s_[next] == t_s;
    if (!is_exact) {
      return std::nullopt;
    }
    return Place{p_em_mm_[next], toward_tip_em_[next].normalized(), Eigen::Vector3d::Zero(), 1};
  }
  auto first = static_cast<std::size_t>(std::lower_bound(t_s_.begin(), t_s_.end(), t_s - half_window_s) -
                                        t_s_.begin());
  auto last = static_cast<std::size_t>(std::upper_bound(t_s_.begin(), t_s_.end(), t_s + half_window_s) -
                                       t_s_.begin());
  if (last < first + 2) {
    first = next - 1;
    last = next + 1;
  }
  // Least squares of p = a + b (t - t_mean).
  const auto count = static_cast<double>(last - first);
  double mean_s = 0;
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (std::size_t i = first; i < last; ++i) {
    mean_s += t_s_[i] / count;
    mean_mm += p_em_mm_[i] / count;
    direction += toward_tip_em_[i];
  }
  double spread_s2 = 0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (std::size_t i = first; i < last; ++i) {
    spread_s2 += (t_s_[i] - mean_s) * (t_s_[i] - mean_s);
    slope += (t_s_[i] - mean_s) * (p_em_mm_[i] - mean_mm);
  }
  slope /= std::max(spread_s2, 1e-12);
  return Place{mean_mm + (t_s - mean_s) * slope, direction.normalized(), slope,
               static_cast<int>(last - first)};
}

}  // namespace tubed
