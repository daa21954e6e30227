// tubectl simulate: a catheterisation as a sequence folder with its truth.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/tubectl/simulation_picture.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/replay/sequence_writer.hpp"
#include "drivers/simulation/simulated_tracker.hpp"
#include "drivers/simulation/simulated_view.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

namespace {

using Clock = std::chrono::steady_clock;

struct SimulateOptions {
  std::string preset = "paper";
  std::int64_t seed = 1;
  std::string out;
  std::string vessel;
  std::string picture;
  int every = 1;
  int second_view_every = 0;  ///< 0: as the preset has it
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// A counter on the terminal, at most five times a second; elsewhere one line at the end.
class Progress {
 public:
  Progress(std::string what, std::size_t total) : what_(std::move(what)), total_(total) {}
  ~Progress() {
    if (live_) std::cerr << '\n';
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void show(std::size_t done) {
    if (done == total_ || (live_ && seconds_since(shown_) > 0.2)) {
      shown_ = Clock::now();
      std::cerr << (live_ ? "\r" : "") << what_ << ' ' << done << " of " << total_ << (live_ ? "" : "\n")
                << std::flush;
    }
  }

 private:
  std::string what_;
  std::size_t total_;
  bool live_ = isatty(STDERR_FILENO) == 1;
  Clock::time_point shown_;
};

DriverSettings settings_for(const SimulateOptions& options) {
  std::map<std::string, SettingValue> values;
  for (const SettingDescription& setting : simulation_settings()) {
    values[setting.name] = setting.default_value;
  }
  return DriverSettings(values)
      .with("preset", options.preset)
      .with("seed", options.seed)
      .with("vessel", options.vessel);
}

void print_mechanics(const RunReport& report, double seconds) {
  std::printf(
      "mechanics: %zu steps in %.2f s (%.0f a second), %d iterations, %d without balance\n"
      "  wall penetration, greatest of each step: median %.3f, greatest %.3f mm\n"
      "  length error: greatest %.1e of the whole; tip moves %.2f mm a step (median); %d snaps, greatest "
      "%.1f mm\n",
      report.steps, seconds, static_cast<double>(report.steps) / seconds, report.iterations,
      report.unfinished, report.median_penetration_mm, report.greatest_penetration_mm,
      report.greatest_length_error, report.median_tip_move_mm, report.snaps, report.greatest_move_mm);
}

std::shared_ptr<const Catheterisation> run_mechanics(const Scenario& scenario) {
  Progress progress("mechanics: step", scenario.commands.size());
  return shared_run_of(scenario, [&](std::size_t done) { progress.show(done); });
}

/// Writes one simulated run, row by row.
class SequenceSimulation {
 public:
  SequenceSimulation(const SimulateOptions& options, const Scenario& scenario)
      : options_(options),
        scenario_(scenario),
        settings_(settings_for(options)),
        world_(scenario.room, settings_),
        tracker_(world_, settings_, em_period_s()),
        writer_(options.out, note(), scenario.room) {
    const AttenuationVolume body = body_of(world_);
    for (const CameraCalibration& camera : scenario.room.cameras) {
      views_.push_back(
          std::make_unique<SimulatedView>(camera, world_, options.seed, settings_.get<double>("cnr"), &body));
    }
  }

  /// All exposures, then all measurements, each in order of time. Returns the number of pictures.
  std::size_t write() {
    const auto exposures =
        static_cast<std::int64_t>(std::floor(duration_s() * scenario_.frame_rate_hz + 1e-9));
    Progress progress("exposure", static_cast<std::size_t>(exposures / options_.every));
    std::size_t instants = 0;
    for (std::int64_t k = options_.every; k <= exposures; k += options_.every) {
      write_instant(k);
      progress.show(++instants);
    }
    if (!scenario_.em_with_every_image) {
      for (std::int64_t k = 0; em_time_s(k) <= duration_s(); ++k) {
        write_measurement(k, em_time_s(k));
      }
    }
    writer_.finish();
    return pictures_;
  }

 private:
  [[nodiscard]] std::string note() const {
    return "SIMULATED. tubectl simulate --preset " + options_.preset + " --seed " +
           std::to_string(options_.seed) +
           (options_.second_view_every == 0
                ? ""
                : " --second-view-every " + std::to_string(options_.second_view_every)) +
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
      const bool due = camera == 0 || k / options_.every % scenario_.second_view_every == 0;
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
    for (const CoilPlacement& coil : scenario_.room.instruments.front().coils) {
      measurement.coils[static_cast<std::size_t>(coil.sensor - 1)] =
          tracker_.measure(world_, 0, coil, k, t_s);
      measurement.coil_count = std::max(measurement.coil_count, coil.sensor);
    }
    writer_.add_measurement(measurement);
  }

  const SimulateOptions& options_;
  const Scenario& scenario_;
  DriverSettings settings_;
  SimulatedWorld world_;
  SimulatedTracker tracker_;
  SequenceWriter writer_;
  std::vector<std::unique_ptr<SimulatedView>> views_;
  std::uint32_t frame_ = 0;
  std::size_t pictures_ = 0;
};

void refuse_filled_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (std::filesystem::exists(folder, ignored) && !std::filesystem::is_empty(folder, ignored)) {
    throw std::runtime_error("--out " + folder.string() +
                             " is there and not empty; remove it or name another folder");
  }
}

int simulate(const SimulateOptions& options) {
  Scenario scenario = make_scenario(options.preset, options.seed);
  if (!options.vessel.empty()) {
    scenario = in_vessel(std::move(scenario), options.vessel);
  }
  if (options.second_view_every > 0) {
    if (scenario.room.cameras.size() < 2) {
      throw std::runtime_error("--second-view-every: preset " + options.preset +
                               " has one view; biplane has two");
    }
    scenario.second_view_every = options.second_view_every;
  }
  if (!options.out.empty()) {
    refuse_filled_folder(options.out);
  }
  Clock::time_point start = Clock::now();
  const auto run = run_mechanics(scenario);
  print_mechanics(run->report(), seconds_since(start));
  if (!options.picture.empty()) {
    draw_simulation(scenario, *run, options.picture);
    std::printf("drew %s\n", options.picture.c_str());
  }
  if (options.out.empty()) {
    return kExitOk;
  }
  start = Clock::now();
  std::cerr << "casting the patient's X-rays"
            << (scenario.clutter.heart_beat ? ", heart and lungs in all phases" : "") << '\n';
  SequenceSimulation simulation(options, scenario);
  const std::size_t pictures = simulation.write();
  std::printf("wrote %s: %zu pictures in %.1f s (%.0f a second)\n", options.out.c_str(), pictures,
              seconds_since(start), static_cast<double>(pictures) / seconds_since(start));
  return kExitOk;
}

}  // namespace

CLI::App* add_simulate(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<SimulateOptions>();
  CLI::App* verb = app.add_subcommand(
      "simulate",
      "Push a simulated catheter through an aorta; write images, coils and truth as a sequence folder");
  verb->add_option("--preset", options->preset, "paper, field, frozen, clinical or biplane")
      ->check(CLI::IsMember(preset_names()))
      ->capture_default_str();
  verb->add_option("--seed", options->seed,
                   "Patient, noise and what goes wrong; the same seed, the same files")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000'000}))
      ->capture_default_str();
  verb->add_option("--out", options->out,
                   "Folder to write; without it only the mechanics run and are judged");
  verb->add_option("--vessel", options->vessel,
                   "A vessel of your own in mm: centreline with radii (.csv) or closed surface (.stl)");
  verb->add_option("--picture", options->picture,
                   "Draw the vessel, the catheter and the mechanics' figures, PNG");
  verb->add_option("--every", options->every, "Only every so many-th exposure")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  verb->add_option("--second-view-every", options->second_view_every,
                   "Second view with every so many-th exposure (default: as the preset has it)")
      ->check(CLI::Range(1, 1000));
  verb->callback([options, &exit_code] { exit_code = simulate(*options); });
  return verb;
}

}  // namespace tubed
