#include "bench/accuracy/bench_experiment.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bench/accuracy/ct_scan.hpp"
#include "bench/accuracy/ct_segmentation.hpp"
#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/simulated_run.hpp"
#include "clients/evaluation/true_run.hpp"
#include "drivers/laboratory/bench_scenario.hpp"
#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/tracker/gaussian.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kPointingStream = 7503;
constexpr double kPointing_mm = 2;   ///< how well a person points at the tip in the CT, an axis
constexpr std::int64_t kScans = 10;  ///< numbers of scans kept for one draw

Sequence sequence_of(std::int64_t seed, const fs::path& folder) {
  const SimulatedRun run{.preset = kBenchPreset, .seed = seed};
  if (!fs::exists(folder)) {
    const fs::path unfinished = folder.string() + ".unfinished";
    fs::remove_all(unfinished);
    fs::create_directories(folder.parent_path());
    write_simulated_run(run, scenario_of(run), unfinished);
    fs::rename(unfinished, folder);
  }
  return read_sequence(folder);
}

SampledCentreline segmented_truth(const Eigen::Matrix3Xd& centreline_mm, std::int64_t seed,
                                  std::size_t position) {
  const std::int64_t scan_seed = seed * kScans + static_cast<std::int64_t>(position);
  const CtScan scan = simulated_ct(centreline_mm, {}, scan_seed);
  CounterRandom pointing(scan_seed, kPointingStream, 0);
  return segment_catheter(scan, centreline_mm.col(0) + kPointing_mm * gaussian_vector(pointing));
}

/// RMS distance of the segmented points up to `s_max_mm` from the simulated curve.
double off_mm(const SampledCentreline& segmented, const Eigen::Matrix3Xd& simulated_mm, double s_max_mm) {
  const SampledCentreline judged = up_to(segmented, s_max_mm);
  double squares_mm2 = 0;
  for (const auto& p_mm : judged.p_world_mm.colwise()) {
    squares_mm2 += (p_mm - closest_point_on(simulated_mm, p_mm)).squaredNorm();
  }
  return std::sqrt(squares_mm2 / static_cast<double>(judged.p_world_mm.cols()));
}

/// What registration and tracker are off by at the coils of the last measurement.
void judge_coils(const Sequence& still, const Eigen::Matrix3Xd& truth_mm, const Scenario& scenario,
                 BenchDraw& draw) {
  const RigidTransform& T_world_em = still.room.T_world_em;
  const RigidTransform T_em_world = (T_world_em * scenario.registration_error).inverse();
  for (const CoilPlacement& coil : still.room.instruments.front().coils) {
    const CoilSample& sample = still.measurements.back().coils[static_cast<std::size_t>(coil.sensor - 1)];
    const Eigen::Vector3d p_mm = truth_mm.col(std::lround(coil.offset_from_tip_mm));
    draw.registration_mm.push_back((T_world_em * (T_em_world * p_mm) - p_mm).norm());
    draw.coil_mm.push_back((T_world_em * sample.p_em_mm - p_mm).norm());
  }
}

EstimatedShape last_estimate(const Sequence& still, const Method& method) {
  EstimatedShape last;
  reconstruct(as_given(still, method), method.settings, FrangiSettings{},
              [&](const SequenceInstant&, const TubeEstimate& estimate) { last = shape_of(estimate); });
  return last;
}

}  // namespace

Sequence during(const Sequence& sequence, const TimeSpan& halt) {
  Sequence still = sequence;
  std::erase_if(still.frames, [&](const SequenceFrame& frame) { return !halt.contains(frame.t_s); });
  std::erase_if(still.measurements,
                [&](const SequenceMeasurement& measurement) { return !halt.contains(measurement.t_s); });
  while (!still.frames.empty() && !still.frames.back().fluoroscopy_on()) still.frames.pop_back();
  if (still.frames.empty()) throw std::runtime_error(sequence.folder.string() + ": a halt without an image");
  std::erase_if(still.measurements, [&](const SequenceMeasurement& measurement) {
    return measurement.t_s > still.frames.back().t_s;
  });
  return still;
}

BenchDraw run_bench_draw(std::int64_t seed, const fs::path& folder, const std::vector<Method>& methods,
                         const ShapeErrorSettings& judged,
                         const std::function<void(const std::string&)>& told) {
  const Scenario scenario = make_scenario(kBenchPreset, seed);
  const std::string name = "bench-" + std::to_string(seed);
  told(name + ": simulating");
  const Sequence sequence = sequence_of(seed, folder);
  BenchDraw draw{seed, bench_registration(scenario).residual_mm, {}, {}, {}, {}};
  TrueRun truth;
  for (const CameraCalibration& camera : sequence.room.cameras) truth.cameras.emplace_back(camera);
  std::vector<Sequence> stills;
  for (const TimeSpan& halt : scenario.halts) {
    told(name + ": position " + std::to_string(stills.size() + 1) + ", segmenting");
    const Sequence& still = stills.emplace_back(during(sequence, halt));
    const std::uint32_t frame = still.frames.back().frame;
    const Eigen::Matrix3Xd& simulated_mm = find_truth(sequence, frame)->points_world_mm;
    truth.instants.push_back({frame, segmented_truth(simulated_mm, seed, stills.size())});
    draw.truth_rms_mm.push_back(off_mm(truth.instants.back().truth, simulated_mm, judged.s_max_mm));
    judge_coils(still, simulated_mm, scenario, draw);
  }
  for (const Method& method : methods) {
    told(name + ": " + method.name);
    Estimates estimates;
    for (const Sequence& still : stills) {
      estimates.emplace(still.frames.back().frame, last_estimate(still, method));
    }
    draw.methods.push_back(evaluate_method(truth, estimates, judged));
  }
  return draw;
}

}  // namespace tubed
