#include "clients/evaluation/true_run.hpp"

#include <stdexcept>
#include <utility>

#include "clients/evaluation/configured_sequence.hpp"

namespace tubed {

namespace {

SampledCentreline centreline_of(const SequenceTruth* truth) {
  SampledCentreline curve;
  curve.p_world_mm.resize(3, 0);
  if (truth == nullptr) return curve;
  curve.p_world_mm = truth->points_world_mm;
  for (Eigen::Index i = 0; i < curve.p_world_mm.cols(); ++i) curve.s_mm.push_back(static_cast<double>(i));
  return curve;
}

}  // namespace

TrueRun true_run_of(const Sequence& sequence) {
  TrueRun run;
  for (const CameraCalibration& calibration : sequence.room.cameras) run.cameras.emplace_back(calibration);
  for (std::size_t first = 0; first < sequence.frames.size();) {
    std::size_t last = first;
    while (last + 1 < sequence.frames.size() && sequence.frames[last + 1].t_s == sequence.frames[first].t_s)
      ++last;
    const std::uint32_t frame = sequence.frames[last].frame;
    run.instants.push_back({frame, centreline_of(find_truth(sequence, frame)),
                            static_cast<std::size_t>(sequence.frames[first].camera),
                            sequence.frames[first].geometry});
    first = last + 1;
  }
  return run;
}

TrueRun read_true_run(const std::filesystem::path& folder, const std::filesystem::path& configuration) {
  Sequence sequence = read_sequence(folder);
  if (sequence.truth.empty()) {
    throw std::runtime_error(folder.string() + ": has no truth.csv; nothing to compare estimates with");
  }
  if (!configuration.empty()) {
    sequence = as_configured(std::move(sequence), configuration).sequence;
  }
  return true_run_of(sequence);
}

}  // namespace tubed
