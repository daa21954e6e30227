// The checks of a recording that ask its measurements and no image.
#include <algorithm>
#include <cmath>
#include <optional>

#include "clients/evaluation/finding_text.hpp"
#include "clients/evaluation/recording_check.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

namespace {

using Verdict = RecordingFinding::Verdict;

constexpr int kMinMeasurements = 20;  // of a pair of coils, to judge it
constexpr double kMostly = 0.9;       // share of the measurements
constexpr double kMaxExcess_mm = 4;   // that two coils may lie further apart than along the tube

const CoilSample* sample_of(const SequenceMeasurement& measurement, const CoilPlacement& coil) {
  const int index = coil.sensor - 1;
  if (index < 0 || index >= measurement.coil_count) {
    return nullptr;
  }
  const CoilSample& sample = measurement.coils[static_cast<std::size_t>(index)];
  return sample.status == CoilStatus::kOk ? &sample : nullptr;
}

/// Calls `on_pair(nearer, further)` for each measurement that has both.
template <typename OnPair>
void for_each_pair(const Sequence& sequence, const CoilPlacement& nearer, const CoilPlacement& further,
                   const OnPair& on_pair) {
  for (const SequenceMeasurement& measurement : sequence.measurements) {
    const CoilSample* const a = sample_of(measurement, nearer);
    const CoilSample* const b = sample_of(measurement, further);
    if (a != nullptr && b != nullptr) {
      on_pair(*a, *b);
    }
  }
}

/// How often a coil pointed away from the tip, of how many measurements.
struct Backward {
  int times = 0;
  int of = 0;
  [[nodiscard]] bool mostly() const { return of >= kMinMeasurements && times > kMostly * of; }
};

Backward backward_times(const Sequence& sequence, std::size_t coil) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  Backward found;
  const auto count = [&found](const Eigen::Vector3d& toward_tip, const CoilSample& sample, bool flipped) {
    const double dot = toward_tip.dot(sample.tangent_em) * (flipped ? -1 : 1);
    found.times += dot < 0 ? 1 : 0;
    ++found.of;
  };
  if (coil > 0) {
    for_each_pair(sequence, coils[coil - 1], coils[coil], [&](const CoilSample& a, const CoilSample& b) {
      count(a.p_em_mm - b.p_em_mm, b, coils[coil].flipped);
    });
  }
  if (coil + 1 < coils.size()) {
    for_each_pair(sequence, coils[coil], coils[coil + 1], [&](const CoilSample& a, const CoilSample& b) {
      count(a.p_em_mm - b.p_em_mm, a, coils[coil].flipped);
    });
  }
  return found;
}

}  // namespace

RecordingFinding check_coil_directions(const Sequence& sequence) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  RecordingFinding finding{"coil directions", Verdict::kFine, "", ""};
  int judged = 0;
  std::vector<std::size_t> backward;
  for (std::size_t i = 0; i < coils.size(); ++i) {
    const Backward times = backward_times(sequence, i);
    judged += times.of >= kMinMeasurements ? 1 : 0;
    if (times.mostly()) {
      backward.push_back(i);
    }
  }
  if (judged == 0) {
    return {finding.what, Verdict::kNotJudged, "too few measurements with two neighbouring coils", ""};
  }
  if (backward.empty()) {
    finding.evidence = text_of("each of %d coils points toward its neighbour nearer the tip", judged);
    return finding;
  }
  finding.verdict = Verdict::kWrong;
  if (static_cast<int>(backward.size()) == judged) {
    finding.evidence = text_of("all %d coils point away from the tip", judged);
    finding.advice =
        "either their order is the wrong way round (offset_from_tip_mm counts from the tip), or each is "
        "mounted "
        "backward (flipped = true)";
    return finding;
  }
  for (const std::size_t i : backward) {
    finding.evidence +=
        text_of("%scoil %zu (sensor %d)", finding.evidence.empty() ? "" : ", ", i + 1, coils[i].sensor);
  }
  finding.evidence += backward.size() == 1 ? " points away from the tip" : " point away from the tip";
  finding.advice = "flipped = true there, or its sensor number belongs to another coil";
  return finding;
}

RecordingFinding check_coil_distances(const Sequence& sequence) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  RecordingFinding finding{"coil distances", Verdict::kNotJudged,
                           "too few measurements with two neighbouring coils", ""};
  double largest_mm = -1e9;
  for (std::size_t i = 0; i + 1 < coils.size(); ++i) {
    std::vector<double> distances_mm;
    for_each_pair(sequence, coils[i], coils[i + 1], [&](const CoilSample& a, const CoilSample& b) {
      distances_mm.push_back((a.p_em_mm - b.p_em_mm).norm());
    });
    if (distances_mm.size() < kMinMeasurements) {
      continue;
    }
    const auto middle = distances_mm.begin() + static_cast<std::ptrdiff_t>(distances_mm.size() / 2);
    std::nth_element(distances_mm.begin(), middle, distances_mm.end());
    const double along_mm = std::abs(coils[i + 1].offset_from_tip_mm - coils[i].offset_from_tip_mm);
    if (*middle - along_mm > largest_mm) {
      largest_mm = *middle - along_mm;
      finding.verdict = largest_mm > kMaxExcess_mm ? Verdict::kWrong : Verdict::kFine;
      finding.evidence = text_of("coils %zu and %zu lie %.1f mm apart, %.1f mm along the tube", i + 1, i + 2,
                                 *middle, along_mm);
    }
  }
  if (finding.verdict == Verdict::kWrong) {
    finding.advice =
        "nothing bends a tube longer than it is: check offset_from_tip_mm of both, and the sensor numbers";
  } else if (finding.verdict == Verdict::kFine) {
    finding.evidence += ", at most";
  }
  return finding;
}

bool is_any_coil_in_view(const Sequence& sequence) {
  constexpr std::size_t kEvery = 20;
  const bool views_move = std::ranges::any_of(
      sequence.frames, [](const SequenceFrame& frame) { return frame.geometry.has_value(); });
  if (views_move) return true;
  const RoomDescription& room = sequence.room;
  for (const CameraCalibration& calibration : room.cameras) {
    const Camera camera(calibration);
    for (std::size_t i = 0; i < sequence.measurements.size(); i += kEvery) {
      for (const CoilPlacement& coil : room.instruments.front().coils) {
        const CoilSample* const sample = sample_of(sequence.measurements[i], coil);
        const auto projection =
            sample != nullptr ? camera.project(room.T_world_em * sample->p_em_mm) : std::nullopt;
        if (projection && camera.contains(projection->p_image_px)) return true;
      }
    }
  }
  return false;
}

}  // namespace tubed
