#include "clients/evaluation/simulated_run.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/evaluation/offline_reconstruction.hpp"
#include "drivers/laboratory/simulated_tracker.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "drivers/replay/sequence_writer.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

namespace {

std::string text_of(const std::vector<std::string>& mistakes) {
  std::string text;
  for (const std::string& word : mistakes) text += (text.empty() ? "" : " ") + word;
  return text;
}

DriverSettings settings_for(const SimulatedRun& run) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : simulation_settings()) {
    values[setting.name] = setting.default_value;
  }
  return run.reference.in(DriverSettings(values))
      .with("preset", run.preset)
      .with("seed", run.seed)
      .with("vessel", run.vessel)
      .with("hook_radius_mm", run.hook_radius_mm)
      .with("hook_length_mm", run.hook_length_mm)
      .with("hook_arcs_mm", run.hook_arcs_mm)
      .with("panel", run.panel)
      .with("undisturbed", run.undisturbed)
      .with("swing_deg", run.swing_deg)
      .with("announces_pose", run.announces_pose)
      .with("pose_noise_deg", run.pose_noise_deg)
      .with("pose_noise_mm", run.pose_noise_mm)
      .with("pan_mm", run.pan_mm)
      .with("turn_deg", run.turn_deg)
      .with("zoom", run.zoom)
      .with("move_at_s", run.move_at_s)
      .with("mistakes", text_of(run.mistakes));
}

/// Number and time of something that is done at a constant rate.
struct Tick {
  std::int64_t k = 0;
  double t_s = 0;
};

/// All exposures of the first view.
std::vector<Tick> exposures_of(const SimulatedRun& run, const Scenario& scenario) {
  const auto count =
      static_cast<std::int64_t>(std::floor(scenario.duration_s() * scenario.frame_rate_hz + 1e-9));
  std::vector<Tick> exposures;
  for (std::int64_t k = run.every; k <= count; k += run.every) {
    exposures.push_back({k, static_cast<double>(k) / scenario.frame_rate_hz});
  }
  return exposures;
}

double em_period_s(const Scenario& scenario) {
  return 1 / (scenario.em_with_every_image ? scenario.frame_rate_hz : scenario.em_rate_hz);
}

std::vector<Tick> measurements_of(const SimulatedRun& run, const Scenario& scenario) {
  if (scenario.em_with_every_image) {
    return exposures_of(run, scenario);
  }
  std::vector<Tick> measurements;
  Tick tick{0, scenario.em_phase_s};
  while (tick.t_s <= scenario.duration_s()) {
    measurements.push_back(tick);
    ++tick.k;
    tick.t_s = scenario.em_phase_s + static_cast<double>(tick.k) * em_period_s(scenario);
  }
  return measurements;
}

/// What a person would type for the same run.
std::string command_of(const SimulatedRun& run) {
  std::ostringstream text;
  text << "tubectl simulate --preset " << run.preset << " --seed " << run.seed;
  if (run.hook_radius_mm != 0) text << " --hook-radius " << run.hook_radius_mm;
  if (run.hook_length_mm != 0) text << " --hook-length " << run.hook_length_mm;
  for (std::size_t i = 0; i < run.hook_arcs_mm.size(); ++i) {
    text << (i == 0 ? " --hook-arcs " : ",") << run.hook_arcs_mm[i];
  }
  if (run.tip_coil_mm != 0) text << " --tip-coil " << run.tip_coil_mm;
  for (std::size_t i = 0; i < run.coils_mm.size(); ++i) {
    text << (i == 0 ? " --coils " : ",") << run.coils_mm[i];
  }
  if (run.tip_stiffness != 0) text << " --tip-stiffness " << run.tip_stiffness;
  if (!run.panel.empty()) text << " --panel " << run.panel;
  if (run.undisturbed) text << " --undisturbed";
  if (run.tells_marks) text << " --tell-marks";
  if (run.rate_hz != 0) text << " --rate " << run.rate_hz;
  if (run.second_view_every != 0) text << " --second-view-every " << run.second_view_every;
  if (run.pan_mm != 0) text << " --pan " << run.pan_mm;
  if (run.turn_deg != 0) text << " --turn " << run.turn_deg;
  if (run.zoom != 1) text << " --zoom " << run.zoom;
  if (run.move_at_s >= 0) text << " --move-at " << run.move_at_s;
  if (!run.announces_pose) text << " --unannounced";
  if (run.moves_unseen) text << " --unseen";
  for (const std::string& word : run.mistakes) text << " --mistake " << word;
  const SimulatedReference& reference = run.reference;
  if (reference.kind != "none") text << " --reference " << reference.kind;
  if (reference.shift_mm != 0) text << " --generator-moves " << reference.shift_mm;
  if (reference.turn_deg != 0) text << " --generator-turns " << reference.turn_deg;
  if (reference.shift_mm != 0 || reference.turn_deg != 0) text << " --generator-at " << reference.at_s;
  if (reference.drift_mm_s != 0) text << " --generator-drifts " << reference.drift_mm_s;
  return text.str();
}

/// Writes one run, row by row.
class RunWriter {
 public:
  RunWriter(const SimulatedRun& run, const Scenario& scenario, const std::filesystem::path& folder)
      : run_(run),
        scenario_(scenario),
        folder_(folder),
        settings_(settings_for(run)),
        world_(described_room_of(run, scenario), settings_),
        writer_(folder, "SIMULATED. " + command_of(run) + ": " + scenario.meaning,
                described_room_of(run, scenario)) {
    const auto body = std::make_shared<const AttenuationVolume>(body_of(world_));
    for (const CameraCalibration& camera : world_.room().cameras) {
      views_.push_back(
          std::make_unique<SimulatedView>(camera, world_, run.seed, settings_.get<double>("cnr"), body));
    }
  }

  /// All exposures, then all measurements, each in order of time. Returns the number of pictures.
  std::size_t write(const RunProgress& progress) {
    const std::vector<Tick> exposures = exposures_of(run_, scenario_);
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      write_instant(exposures[i]);
      if (progress) progress(i + 1, exposures.size());
    }
    for (const SequenceMeasurement& measurement : simulated_measurements(run_, scenario_)) {
      writer_.add_measurement(measurement);
    }
    writer_.finish();
    if (scenario_.room.reference) {
      const SimulatedTracker tracker(world_, settings_, em_period_s(scenario_));
      write_reference(registered_reference(tracker, world_), folder_ / "reference.toml");
    }
    return pictures_;
  }

 private:
  void write_instant(const Tick& exposure) {
    const SequenceTruth truth{0, true_centreline(exposure.t_s)};
    for (std::size_t camera = 0; camera < views_.size(); ++camera) {
      const bool due = camera == 0 || exposure.k / run_.every % scenario_.second_view_every == 0;
      if (due) {
        write_view(static_cast<int>(camera), exposure, truth);
      }
    }
  }

  void write_view(int camera, const Tick& exposure, SequenceTruth truth) {
    const double stamp_s = exposure.t_s + world_.mistakes().image_stamp_error_s();
    truth.frame = ++frame_;
    if (scenario_.fluoroscopy_on(exposure.t_s) && !is_moving_unseen(exposure.t_s)) {
      const CameraCalibration& calibration = world_.room().cameras[static_cast<std::size_t>(camera)];
      SimulatedView& view = *views_[static_cast<std::size_t>(camera)];
      GreyImage image{calibration.width, calibration.height, view.depth(), {}};
      image.pixels.resize(view.bytes_per_image());
      view.render(world_, exposure.t_s, exposure.k, image.pixels);
      writer_.add_exposure(frame_, stamp_s, camera, image);
      if (const auto geometry = world_.announced(calibration, exposure.t_s, exposure.k, run_.seed)) {
        writer_.add_geometry(frame_, *geometry);
      }
      ++pictures_;
    } else if (camera == 0) {
      writer_.add_instant_without_fluoroscopy(frame_, stamp_s, camera);
    } else {
      --frame_;
      return;
    }
    writer_.add_truth(truth);
  }

  [[nodiscard]] bool is_moving_unseen(double t_s) const {
    return run_.moves_unseen && std::ranges::any_of(world_.view_motion().once, [t_s](const ViewMove& move) {
             return t_s > move.from_s && t_s < move.until_s;
           });
  }

  [[nodiscard]] Eigen::Matrix3Xd true_centreline(double t_s) const {
    const double length_mm = scenario_.room.instruments.front().length_mm;
    Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(std::floor(length_mm)) + 1);
    for (Eigen::Index s = 0; s < points.cols(); ++s) {
      points.col(s) = world_.point(0, t_s, static_cast<double>(s));
    }
    return points;
  }

  const SimulatedRun& run_;
  const Scenario& scenario_;
  std::filesystem::path folder_;
  DriverSettings settings_;
  SimulatedWorld world_;
  SequenceWriter writer_;
  std::vector<std::unique_ptr<SimulatedView>> views_;
  std::uint32_t frame_ = 0;
  std::size_t pictures_ = 0;
};

std::string presets_with_two_views(std::int64_t seed) {
  std::string names;
  for (const std::string& preset : preset_names()) {
    if (make_scenario(preset, seed).room.cameras.size() > 1) names += " " + preset;
  }
  return names;
}

void place_coils(const std::vector<double>& coils_mm, InstrumentDescription& instrument) {
  const bool is_ascending = std::ranges::adjacent_find(coils_mm, std::greater_equal<>()) == coils_mm.end();
  if (coils_mm.size() > static_cast<std::size_t>(kMaxCoils) || !is_ascending || coils_mm.front() < 0 ||
      coils_mm.back() > instrument.length_mm) {
    std::ostringstream text;
    text << "--coils: " << kMaxCoils
         << " at most, from the tip on, each further from it than the one before, "
         << "the last one " << instrument.length_mm << " mm at most";
    throw std::invalid_argument(text.str());
  }
  instrument.coils.clear();
  for (const double coil_mm : coils_mm) {
    instrument.coils.push_back({static_cast<int>(instrument.coils.size()) + 1, coil_mm, false});
  }
}

}  // namespace

Scenario scenario_of(const SimulatedRun& run) {
  Scenario scenario = with_hook(make_scenario(run.preset, run.seed),
                                {run.hook_radius_mm, run.hook_length_mm, run.hook_arcs_mm});
  if (!run.coils_mm.empty()) place_coils(run.coils_mm, scenario.room.instruments.front());
  if (run.tip_coil_mm > 0) {
    scenario.room.instruments.front().coils.front().offset_from_tip_mm = run.tip_coil_mm;
  }
  scenario = with_tip_stiffness(std::move(scenario), run.tip_stiffness);
  if (!run.vessel.empty()) {
    scenario = in_vessel(std::move(scenario), run.vessel);
  }
  scenario = on_panel(std::move(scenario), run.panel);
  if (run.undisturbed) scenario = undisturbed(std::move(scenario));
  if (run.rate_hz > 0) scenario.frame_rate_hz = run.rate_hz;
  if (run.second_view_every > 0) {
    if (scenario.room.cameras.size() < 2) {
      throw std::runtime_error("--second-view-every: preset " + run.preset +
                               " has one view; with two:" + presets_with_two_views(run.seed));
    }
    scenario.second_view_every = run.second_view_every;
  }
  add_reference(run.reference, scenario.room);
  (void)described_room_of(run, scenario);  // now, not after the mechanics
  return scenario;
}

RoomDescription described_room_of(const SimulatedRun& run, const Scenario& scenario) {
  RoomDescription room =
      described_room(scenario.room, parse_mistakes(run.mistakes), {run.seed, scenario.middle_world_mm});
  if (run.tells_marks) {
    for (InstrumentDescription& instrument : room.instruments) {
      instrument.marks_mm = ring_electrodes_mm();
      instrument.mark_length_mm = kRingElectrode_mm;
    }
  }
  return room;
}

std::vector<SequenceMeasurement> simulated_measurements(const SimulatedRun& run, const Scenario& scenario) {
  const DriverSettings settings = settings_for(run);
  const SimulatedWorld world(described_room_of(run, scenario), settings);
  const SimulatedTracker tracker(world, settings, em_period_s(scenario));
  std::vector<SequenceMeasurement> measurements;
  for (const Tick& tick : measurements_of(run, scenario)) {
    SequenceMeasurement& measurement = measurements.emplace_back();
    measurement.t_s = tick.t_s + scenario.em_clock_error_s + world.mistakes().em_stamp_error_s();
    measurement.em_frame = static_cast<std::uint32_t>(tick.k);
    measurement.coil_count = tracker.measure_all(world, tick.k, tick.t_s, measurement.coils);
  }
  return measurements;
}

bool changes_pictures(const SimulatedRun& run) {
  const RoomMistakes mistakes = parse_mistakes(run.mistakes);
  return mistakes.inverts || mistakes.mirrors || mistakes.averaging > 0 || run.swing_deg != 0 ||
         run.pan_mm != 0 || run.turn_deg != 0 || run.zoom != 1;
}

Sequence with_mistakes(Sequence clean, const SimulatedRun& run, const Scenario& scenario) {
  const RoomMistakes mistakes = parse_mistakes(run.mistakes);
  clean.room = described_room_of(run, scenario);
  clean.measurements = simulated_measurements(run, scenario);
  for (SequenceFrame& frame : clean.frames) {
    frame.t_s += mistakes.image_stamp_error_s();
    if (frame.geometry) {
      frame.geometry = described_view(*frame.geometry, mistakes, {run.seed, scenario.middle_world_mm},
                                      static_cast<std::size_t>(frame.camera));
    }
  }
  return clean;
}

TrueRun true_run_of(const SimulatedRun& run, const Scenario& scenario, const Sequence& sequence) {
  const SimulatedWorld world(described_room_of(run, scenario), settings_for(run));
  TrueRun truth = true_run_of(sequence);
  truth.cameras.clear();
  for (const CameraCalibration& camera : world.room().cameras) truth.cameras.emplace_back(camera);
  const std::vector<SequenceInstant> instants = instants_of(sequence);
  for (std::size_t i = 0; i < truth.instants.size(); ++i) {
    const double exposed_s = instants[i].t_s - world.mistakes().image_stamp_error_s();
    TrueInstant& instant = truth.instants[i];
    instant.view = world.view(world.room().cameras[instant.view_camera], exposed_s);
  }
  return truth;
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
