#include "clients/evaluation/simulated_run.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include "drivers/laboratory/simulated_tracker.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "drivers/replay/sequence_writer.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

namespace {

DriverSettings settings_for(const SimulatedRun& run) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : simulation_settings()) {
    values[setting.name] = setting.default_value;
  }
  return run.reference.in(DriverSettings(values))
      .with("preset", run.preset)
      .with("seed", run.seed)
      .with("vessel", run.vessel)
      .with("swing_deg", run.swing_deg)
      .with("announces_pose", run.announces_pose)
      .with("pose_noise_deg", run.pose_noise_deg)
      .with("pose_noise_mm", run.pose_noise_mm);
}

/// Writes one run, row by row.
class RunWriter {
 public:
  RunWriter(const SimulatedRun& run, const Scenario& scenario, const std::filesystem::path& folder)
      : run_(run),
        scenario_(scenario),
        folder_(folder),
        settings_(settings_for(run)),
        world_(scenario.room, settings_),
        tracker_(world_, settings_, em_period_s()),
        writer_(folder, note(), scenario.room) {
    const auto body = std::make_shared<const AttenuationVolume>(body_of(world_));
    for (const CameraCalibration& camera : scenario.room.cameras) {
      views_.push_back(
          std::make_unique<SimulatedView>(camera, world_, run.seed, settings_.get<double>("cnr"), body));
    }
  }

  /// All exposures, then all measurements, each in order of time. Returns the number of pictures.
  std::size_t write(const RunProgress& progress) {
    const auto exposures =
        static_cast<std::int64_t>(std::floor(duration_s() * scenario_.frame_rate_hz + 1e-9));
    const auto total = static_cast<std::size_t>(exposures / run_.every);
    std::size_t instants = 0;
    for (std::int64_t k = run_.every; k <= exposures; k += run_.every) {
      write_instant(k);
      ++instants;
      if (progress) progress(instants, total);
    }
    if (!scenario_.em_with_every_image) {
      for (std::int64_t k = 0; em_time_s(k) <= duration_s(); ++k) {
        write_measurement(k, em_time_s(k));
      }
    }
    writer_.finish();
    if (scenario_.room.reference) {
      write_reference(registered_reference(tracker_, world_), folder_ / "reference.toml");
    }
    return pictures_;
  }

 private:
  [[nodiscard]] std::string note() const {
    return "SIMULATED. tubectl simulate --preset " + run_.preset + " --seed " + std::to_string(run_.seed) +
           (run_.second_view_every == 0 ? ""
                                        : " --second-view-every " + std::to_string(run_.second_view_every)) +
           ": " + scenario_.meaning;
  }
  [[nodiscard]] double duration_s() const {
    return static_cast<double>(scenario_.commands.size()) / scenario_.steps_per_s;
  }
  [[nodiscard]] double em_period_s() const {
    return scenario_.em_with_every_image ? 1 / scenario_.frame_rate_hz : 1 / scenario_.em_rate_hz;
  }
  [[nodiscard]] double em_time_s(std::int64_t k) const {
    return scenario_.em_phase_s + static_cast<double>(k) * em_period_s();
  }

  void write_instant(std::int64_t k) {
    const double t_s = static_cast<double>(k) / scenario_.frame_rate_hz;
    const SequenceTruth truth{0, true_centreline(t_s)};
    for (std::size_t camera = 0; camera < views_.size(); ++camera) {
      const bool due = camera == 0 || k / run_.every % scenario_.second_view_every == 0;
      if (due) {
        write_view(static_cast<int>(camera), k, t_s, truth);
      }
    }
    if (scenario_.em_with_every_image) {
      write_measurement(k, t_s);
    }
  }

  void write_view(int camera, std::int64_t k, double t_s, SequenceTruth truth) {
    truth.frame = ++frame_;
    if (scenario_.fluoroscopy_on(t_s)) {
      const CameraCalibration& calibration = scenario_.room.cameras[static_cast<std::size_t>(camera)];
      GreyImage image{calibration.width, calibration.height, PixelDepth::kGrey8, {}};
      image.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
      views_[static_cast<std::size_t>(camera)]->render(world_, t_s, k, image.pixels);
      writer_.add_exposure(frame_, t_s, camera, image);
      if (const auto geometry = world_.announced(calibration, t_s, k, run_.seed)) {
        writer_.add_geometry(frame_, *geometry);
      }
      ++pictures_;
    } else if (camera == 0) {
      writer_.add_instant_without_fluoroscopy(frame_, t_s, camera);
    } else {
      --frame_;
      return;
    }
    writer_.add_truth(truth);
  }

  [[nodiscard]] Eigen::Matrix3Xd true_centreline(double t_s) const {
    const double length_mm = scenario_.room.instruments.front().length_mm;
    Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(std::floor(length_mm)) + 1);
    for (Eigen::Index s = 0; s < points.cols(); ++s) {
      points.col(s) = world_.point(0, t_s, static_cast<double>(s));
    }
    return points;
  }

  void write_measurement(std::int64_t k, double t_s) {
    SequenceMeasurement measurement;
    measurement.t_s = t_s + scenario_.em_clock_error_s;
    measurement.em_frame = static_cast<std::uint32_t>(k);
    measurement.coil_count = tracker_.measure_all(world_, k, t_s, measurement.coils);
    writer_.add_measurement(measurement);
  }

  const SimulatedRun& run_;
  const Scenario& scenario_;
  std::filesystem::path folder_;
  DriverSettings settings_;
  SimulatedWorld world_;
  SimulatedTracker tracker_;
  SequenceWriter writer_;
  std::vector<std::unique_ptr<SimulatedView>> views_;
  std::uint32_t frame_ = 0;
  std::size_t pictures_ = 0;
};

}  // namespace

Scenario scenario_of(const SimulatedRun& run) {
  Scenario scenario = make_scenario(run.preset, run.seed);
  if (!run.vessel.empty()) {
    scenario = in_vessel(std::move(scenario), run.vessel);
  }
  if (run.second_view_every > 0) {
    if (scenario.room.cameras.size() < 2) {
      throw std::runtime_error("--second-view-every: preset " + run.preset +
                               " has one view; biplane has two");
    }
    scenario.second_view_every = run.second_view_every;
  }
  add_reference(run.reference, scenario.room);
  return scenario;
}

void require_empty(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (std::filesystem::exists(folder, ignored) && !std::filesystem::is_empty(folder, ignored)) {
    throw std::runtime_error("--out " + folder.string() +
                             " is there and not empty; remove it or name another folder");
  }
}

std::size_t write_simulated_run(const SimulatedRun& run, const Scenario& scenario,
                                const std::filesystem::path& folder, const RunProgress& progress) {
  require_empty(folder);
  return RunWriter(run, scenario, folder).write(progress);
}

}  // namespace tubed
