#include "bench/accuracy/disturbances.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

namespace tubed {

namespace {

/// `change` of one coil of every measurement, and of the time of it.
template <typename Change>
Sequence with_coil_changed(Sequence sequence, int coil, const Change& change) {
  bool any = false;
  for (SequenceMeasurement& measurement : sequence.measurements) {
    if (coil < 0 || coil >= measurement.coil_count) continue;
    change(measurement.coils[static_cast<std::size_t>(coil)], measurement.t_s);
    any = true;
  }
  if (!any) throw std::invalid_argument("no measurement has a coil " + std::to_string(coil));
  return sequence;
}

double start_of(const Sequence& sequence) {
  return sequence.measurements.empty() ? 0 : sequence.measurements.front().t_s;
}

}  // namespace

Eigen::Vector3d random_direction(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

bool is_off(double t_s, double start_s, double off_s, double period_s) {
  return std::fmod(t_s - start_s, period_s) >= period_s - off_s;
}

Sequence with_fluoroscopy_off_for(Sequence sequence, double off_s, double period_s) {
  if (sequence.frames.empty()) return sequence;
  const double start_s = sequence.frames.front().t_s;
  for (SequenceFrame& frame : sequence.frames) {
    if (is_off(frame.t_s, start_s, off_s, period_s)) frame.file.clear();
  }
  return sequence;
}

Sequence with_coils_dropped(Sequence sequence, double share, unsigned seed) {
  std::mt19937_64 random(seed);
  std::bernoulli_distribution dropped(share);
  for (SequenceMeasurement& measurement : sequence.measurements) {
    for (int i = 0; i < measurement.coil_count; ++i) {
      if (dropped(random)) measurement.coils[static_cast<std::size_t>(i)] = CoilSample{};
    }
  }
  return sequence;
}

Sequence with_coil_lying(Sequence sequence, int coil, double error_mm, unsigned seed) {
  std::mt19937_64 random(seed);
  const Eigen::Vector3d error_em_mm = error_mm * random_direction(random);
  return with_coil_changed(std::move(sequence), coil,
                           [=](CoilSample& sample, double) { sample.p_em_mm += error_em_mm; });
}

Sequence with_coil_erratic(Sequence sequence, int coil, double error_mm, double wrong_s, double period_s,
                           unsigned seed) {
  std::mt19937_64 random(seed);
  const double start_s = start_of(sequence);
  return with_coil_changed(std::move(sequence), coil, [&](CoilSample& sample, double t_s) {
    const Eigen::Vector3d error_em_mm = error_mm * random_direction(random);
    if (is_off(t_s, start_s, wrong_s, period_s)) sample.p_em_mm += error_em_mm;
  });
}

Sequence with_coil_missing(Sequence sequence, int coil, double off_s, double period_s) {
  const double start_s = start_of(sequence);
  return with_coil_changed(std::move(sequence), coil, [=](CoilSample& sample, double t_s) {
    if (is_off(t_s, start_s, off_s, period_s)) sample = CoilSample{};
  });
}

Sequence with_wrong_images(Sequence sequence, std::size_t step) {
  std::map<int, std::filesystem::path> first;
  std::map<int, std::size_t> seen;
  for (SequenceFrame& frame : sequence.frames) {
    if (!frame.fluoroscopy_on()) continue;
    const auto [kept, is_first] = first.emplace(frame.camera, frame.file);
    const std::size_t count = ++seen[frame.camera];
    if (!is_first && step > 0 && count % step == 0) frame.file = kept->second;
  }
  return sequence;
}

}  // namespace tubed
