// tubectl simulate: a catheterisation as a sequence folder with its truth.
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/evaluation/simulated_run.hpp"
#include "clients/tubectl/see/simulation_picture.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/laboratory/room_mistakes.hpp"
#include "drivers/laboratory/scenario.hpp"
#include "idl/settings/key_description.hpp"

namespace tubed {

namespace {

using Clock = std::chrono::steady_clock;

struct SimulateOptions {
  SimulatedRun run;
  std::string out;
  std::string picture;
  bool unannounced = false;
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

void print_mechanics(const RunReport& report, double seconds) {
  std::printf(
      "mechanics: %zu steps in %.2f s (%.0f a second), %d iterations, %d without balance\n"
      "  wall penetration, greatest of each step: median %.3f, greatest %.3f mm\n"
      "  length error: greatest %.1e of the whole; tip moves %.2f mm a step (median); %d snaps, greatest "
      "%.1f mm\n",
      report.steps, seconds, static_cast<double>(report.steps) / seconds, report.iterations,
      report.unfinished, report.median_penetration_mm, report.max_penetration_mm, report.max_length_error,
      report.median_tip_move_mm, report.snaps, report.max_move_mm);
}

std::shared_ptr<const Catheterisation> run_mechanics(const Scenario& scenario) {
  Progress progress("mechanics: step", scenario.commands.size());
  return shared_run_of(scenario, [&](std::size_t done) { progress.show(done); });
}

int simulate(const SimulateOptions& options) {
  const Scenario scenario = scenario_of(options.run);
  if (!options.out.empty()) {
    require_empty(options.out);
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
  std::unique_ptr<Progress> progress;
  const std::size_t pictures =
      write_simulated_run(options.run, scenario, options.out, [&](std::size_t done, std::size_t total) {
        if (!progress) progress = std::make_unique<Progress>("exposure", total);
        progress->show(done);
      });
  progress.reset();
  std::printf("wrote %s: %zu pictures in %.1f s (%.0f a second)\n", options.out.c_str(), pictures,
              seconds_since(start), static_cast<double>(pictures) / seconds_since(start));
  return kExitOk;
}

/// One line a mistake.
std::string mistake_meanings() {
  std::string words =
      "What people and rooms get wrong, NAME=VALUES; may be given several times. The truth stays true";
  for (const MistakeHelp& mistake : mistakes_help()) {
    words += "\n" + mistake.form + ": " + std::string(mistake.meaning);
  }
  return words;
}

void add_tip_options(CommandLine& verb, SimulatedRun& run) {
  const Argument radius =
      verb.add_option("--hook-radius", run.hook_radius_mm,
                      "Let the catheter's tip be a hook of so many mm radius (default: as the preset has it)")
          .in_range(6.0, 100.0);
  const Argument length =
      verb.add_option("--hook-length", run.hook_length_mm,
                      "Length of the hook along the catheter, mm (default: 1.75 times its radius, 14 to 40)")
          .in_range(1.0, 45.0);
  verb.add_option("--hook-arcs", run.hook_arcs_mm,
                  "The hook in several arcs, L,R,L,R..: length and radius of each from the tip on, mm, as "
                  "rest_arcs_mm of an instrument (radius 0: straight, negative: to the other side)")
      .delimiter(',')
      .excludes(radius)
      .excludes(length);
  const Argument tip_coil =
      verb.add_option("--tip-coil", run.tip_coil_mm,
                      "The first coil lies so many mm behind the tip (default: as the preset has it, 10)")
          .in_range(0.5, 60.0);
  verb.add_option(
          "--coils", run.coils_mm,
          "Where all coils lie, MM,MM,..: mm from the tip, ascending, 16 at most (default: as the preset "
          "has them, 10,90,170,270,370)")
      .delimiter(',')
      .excludes(tip_coil);
  verb.add_option("--tip-stiffness", run.tip_stiffness,
                  "Bending stiffness of the tip's last 50 mm, as a multiple of the shaft's (default: as the "
                  "preset has it, 0.5)")
      .in_range(0.05, 5.0);
}

void add_picture_options(CommandLine& verb, SimulatedRun& run) {
  verb.add_option(
      "--panel", run.panel,
      "Take the pictures with a panel: READOUT,BITS,PIXEL_MM, such as linear,12,0.2; linear or log, "
      "9 to 16 bits, mm where the patient is (default: as the preset has it)");
  verb.add_flag("--tell-marks", run.tells_marks,
                "Let sequence.toml say where the catheter's electrodes are, marks_mm");
  verb.add_flag("--undisturbed", run.undisturbed,
                "Take the pictures straight from the detector: no console's processing, marker bands, braid, "
                "wires and leads");
}

void add_reference_options(CommandLine& verb, SimulatedReference& reference) {
  verb.add_option(
          "--reference", reference.kind,
          "What is on the patient: none; sensor: one of 6 degrees of freedom; coils: two 5-DOF coils. "
          "OUT/reference.toml is then the [em.reference] of a configuration")
      .is_member({"none", "sensor", "coils"})
      .capture_default_str();
  verb.add_option("--generator-moves", reference.shift_mm, "Push the field generator by so many mm, once")
      .in_range(0.0, 1000.0);
  verb.add_option("--generator-turns", reference.turn_deg, "and turn it by so many degrees about itself")
      .in_range(-180.0, 180.0);
  verb.add_option("--generator-at", reference.at_s, "when, in s; it takes 0.3 s")
      .in_range(0.0, 1e6)
      .capture_default_str();
  verb.add_option("--generator-drifts", reference.drift_mm_s,
                  "Let it also drift by so many mm/s all the time")
      .in_range(-100.0, 100.0);
}

void add_view_options(CommandLine& verb, SimulateOptions& options) {
  verb.add_option("--swing", options.run.swing_deg,
                  "Swing the C-arm of the first view by so many degrees there and back every 20 s, at 10 "
                  "degrees a second (default: as the preset has it)")
      .in_range(-120.0, 120.0);
  verb.add_option("--pose-noise-deg", options.run.pose_noise_deg,
                  "Standard deviation of the angles that images of a moving view say")
      .in_range(0.0, 10.0)
      .capture_default_str();
  verb.add_option("--pose-noise-mm", options.run.pose_noise_mm, "The same of where it stands")
      .in_range(0.0, 100.0)
      .capture_default_str();
  verb.add_option("--pan", options.run.pan_mm,
                  "Pan the table by so many mm, once, in the image's plane at 10 mm a second; it stays there")
      .in_range(-200.0, 200.0);
  verb.add_option("--turn", options.run.turn_deg,
                  "Turn the C-arm of the first view by so many degrees, once, at 10 degrees a second")
      .in_range(-120.0, 120.0);
  verb.add_option("--zoom", options.run.zoom, "Multiply its focal lengths by this, once").in_range(0.5, 2.0);
  verb.add_option("--move-at", options.run.move_at_s,
                  "When --pan, --turn and --zoom begin, s (default: half way through)")
      .in_range(0.0, 1e6);
  verb.add_flag("--unannounced", options.unannounced, "Images of a moving view do not say how it stood");
  verb.add_flag(
      "--unseen", options.run.moves_unseen,
      "No fluoroscopy while --pan, --turn and --zoom happen, as when a C-arm is turned without the pedal");
}

}  // namespace

CommandLine add_simulate(CommandLine app, int& exit_code) {
  auto options = std::make_shared<SimulateOptions>();
  CommandLine verb = app.add_subcommand(
      "simulate",
      "Push a simulated catheter through an aorta; write images, coils and truth as a sequence folder");
  verb.add_option("--preset", options->run.preset, alternatives(preset_names()))
      .is_member(preset_names())
      .capture_default_str();
  verb.add_option("--seed", options->run.seed,
                  "Patient, noise and what goes wrong; the same seed, the same files")
      .in_range(std::int64_t{0}, std::int64_t{1'000'000'000'000})
      .capture_default_str();
  verb.add_option("--out", options->out, "Folder to write; without it only the mechanics run and are judged");
  verb.add_option("--vessel", options->run.vessel,
                  "A vessel of your own in mm: centreline with radii (.csv) or closed surface (.stl)");
  add_picture_options(verb, options->run);
  verb.add_option("--picture", options->picture,
                  "Draw the vessel, the catheter and the mechanics' figures, PNG");
  verb.add_option("--every", options->run.every, "Only every so many-th exposure")
      .in_range(1, 1000)
      .capture_default_str();
  verb.add_option("--rate", options->run.rate_hz,
                  "So many exposures a second, Hz (default: as the preset has it, mostly 7.5)")
      .in_range(0.5, 60.0);
  verb.add_option("--second-view-every", options->run.second_view_every,
                  "Second view with every so many-th exposure (default: as the preset has it)")
      .in_range(1, 1000);
  add_view_options(verb, *options);
  verb.add_option("--mistake", options->run.mistakes, mistake_meanings());
  add_tip_options(verb, options->run);
  add_reference_options(verb, options->run.reference);
  verb.callback([options, &exit_code] {
    options->run.announces_pose = !options->unannounced;
    exit_code = simulate(*options);
  });
  return verb;
}

}  // namespace tubed
