// What each preset of the simulation is.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "drivers/laboratory/bench_scenario.hpp"
#include "drivers/laboratory/fluoroscope/c_arm.hpp"
#include "drivers/laboratory/fluoroscope/console.hpp"
#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/scenario.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

/// Sec. 3.1: five coils, 10 mm from the tip and 80, 80, 100, 100 mm on.
InstrumentDescription paper_catheter() {
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  int sensor = 0;
  for (const double offset_mm : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    catheter.coils.push_back({++sensor, offset_mm, false});
  }
  return catheter;
}

/// A field generator somewhere beside the table, turned by whatever its arm allows.
RigidTransform placed_generator(CounterRandom& random) {
  const Eigen::Vector3d axis(random.signed_unit(), random.signed_unit(), random.signed_unit() + 0.1);
  const Eigen::AngleAxisd turn(std::numbers::pi * random.unit(), axis.normalized());
  const Eigen::Vector3d place_mm(150 + 100 * random.unit(), 200 + 60 * random.signed_unit(),
                                 -150 + 100 * random.signed_unit());
  return RigidTransform(Eigen::Translation3d(place_mm) * turn);
}

RigidTransform small_motion(CounterRandom& random, double shift_mm, double turn_rad) {
  const auto direction = [&] {
    Eigen::Vector3d drawn;
    do {
      drawn = {random.signed_unit(), random.signed_unit(), random.signed_unit()};
    } while (drawn.norm() > 1 || drawn.norm() < 0.1);
    return drawn.normalized();
  };
  const Eigen::Vector3d shift = shift_mm * direction();
  return RigidTransform(Eigen::Translation3d(shift) * Eigen::AngleAxisd(turn_rad, direction()));
}

/// LAO at which a view faces the plane of the arch.
double facing_deg(const AortaDimensions& patient) {
  return 90 - patient.arch_turn_from_anterior_rad / kDegree;
}

/// What all presets share: another patient for each seed, the paper's commands and catheter, one view that
/// faces the arch.
Scenario common(std::string name, std::string meaning, std::int64_t seed, double more_lao_deg,
                double cranial_deg) {
  Scenario scenario;
  scenario.name = std::move(name);
  scenario.meaning = std::move(meaning);
  scenario.seed = seed;
  scenario.patient = aorta_of_patient(seed);
  scenario.commands = paper_commands();
  scenario.room.instruments = {paper_catheter()};
  scenario.room.cameras = {
      c_arm_view("A", {facing_deg(scenario.patient) + more_lao_deg, cranial_deg}, kViewCentre_mm)};
  return scenario;
}

Scenario paper(std::int64_t seed) {
  Scenario scenario =
      common("paper", "Sec. 3.1: noise of 4 mm and 3 deg drawn anew with every image, view faces the arch",
             seed, 0, 0);
  scenario.em_with_every_image = true;
  scenario.em.lambda_mm = 4;
  scenario.em.psi_rad = 3 * kDegree;
  return scenario;
}

Scenario field(std::int64_t seed) {
  Scenario scenario = common(
      "field", "a static warp of the tracker's field up to 4 mm and 3 deg, jitter 0.5 mm", seed, 10, 5);
  CounterRandom random(seed, 7201, 0);
  scenario.room.T_world_em = placed_generator(random);
  scenario.em_phase_s = 0.025 * random.unit();
  scenario.em.warp_mm = 4;
  scenario.em.warp_rad = 3 * kDegree;
  scenario.em.jitter_mm = 0.5;
  scenario.em.jitter_rad = 0.2 * kDegree;
  return scenario;
}

Scenario frozen(std::int64_t seed) {
  Scenario scenario =
      common("frozen", "every coil is off by 4 mm and 3 deg, always the same, jitter 0.3 mm", seed, 5, 0);
  CounterRandom random(seed, 7202, 0);
  scenario.room.T_world_em = placed_generator(random);
  scenario.em_phase_s = 0.025 * random.unit();
  scenario.em.lambda_mm = 4;
  scenario.em.psi_rad = 3 * kDegree;
  scenario.em.draw = NoiseDraw::kOncePerCoil;
  scenario.em.jitter_mm = 0.3;
  scenario.em.jitter_rad = 0.1 * kDegree;
  return scenario;
}

/// In, with a look back and a turn on the way.
std::vector<CatheterCommand> clinical_commands() {
  std::vector<CatheterCommand> commands = paper_commands();
  std::vector<CatheterCommand> look_back(20, CatheterCommand{-1, 0, 0});
  look_back.insert(look_back.end(), 5, CatheterCommand{0, 4 * kDegree, 0});
  look_back.insert(look_back.end(), 15, CatheterCommand{});
  look_back.insert(look_back.end(), 20, CatheterCommand{1, 0, 0});
  commands.insert(commands.begin() + 130, look_back.begin(), look_back.end());
  return commands;
}

Scenario clinical(std::int64_t seed) {
  Scenario scenario = common("clinical",
                             "second wire, leads, contrast agent, heart beat, breathing, blades; pauses of "
                             "fluoroscopy, drop-outs, outliers reported OK, a stuck coil, metal passing "
                             "by, registration off by 1 mm and 0.3 deg, warped field",
                             seed, -6, -6);
  CounterRandom random(seed, 7203, 0);
  scenario.commands = clinical_commands();
  scenario.steps_per_s = 12;
  scenario.frame_rate_hz = 15;
  scenario.room.T_world_em = placed_generator(random);
  scenario.registration_error = small_motion(random, 1.0, 0.3 * kDegree);
  scenario.em_phase_s = 0.025 * random.unit();
  scenario.em_clock_error_s = 0.004;
  scenario.em.warp_mm = 3;
  scenario.em.warp_rad = 2 * kDegree;
  scenario.em.jitter_mm = 0.6;
  scenario.em.jitter_rad = 0.3 * kDegree;
  scenario.em.drop_out_share = 0.01;
  const double first_s = 4 + 2 * random.unit();
  scenario.clutter = {true, true, true, true, true, -1};
  scenario.contrast_from_s = first_s + 5;
  scenario.detector_lag = 0.05;
  scenario.fluoroscopy_off = {{first_s, first_s + 2}, {first_s + 14, first_s + 17}};
  const auto any_sensor = [&] { return 1 + static_cast<int>(5 * random.unit()); };
  scenario.em.events = {
      {EmEventKind::kDropOut, any_sensor(), first_s + 3, first_s + 4.5, 0},
      {EmEventKind::kOutlier, any_sensor(), first_s + 6, first_s + 6.4, 25},
      {EmEventKind::kStuck, any_sensor(), first_s + 9, first_s + 10, 0},
      {EmEventKind::kOutOfVolume, 5, first_s + 12, first_s + 13, 0},
  };
  const Eigen::Vector3d beside_em_mm = scenario.room.T_world_em.inverse() * Eigen::Vector3d(160, -40, -250);
  const Eigen::Vector3d along_em =
      scenario.room.T_world_em.linear().transpose() * Eigen::Vector3d(-10, 0, 30);
  scenario.em.metal = {{6, 4 * kDegree, 70, beside_em_mm, along_em, first_s + 18, first_s + 26}};
  return scenario;
}

Scenario biplane(std::int64_t seed) {
  Scenario scenario = common(
      "biplane", "a second view, a quarter turn away, with every sixth exposure; warped field", seed, 5, 0);
  CounterRandom random(seed, 7204, 0);
  scenario.room.cameras.push_back(c_arm_view("B", {facing_deg(scenario.patient) - 85, 0}, kViewCentre_mm));
  scenario.second_view_every = 6;
  scenario.room.T_world_em = placed_generator(random);
  scenario.em_phase_s = 0.025 * random.unit();
  scenario.em.warp_mm = 3;
  scenario.em.warp_rad = 2 * kDegree;
  scenario.em.jitter_mm = 0.5;
  scenario.em.jitter_rad = 0.2 * kDegree;
  return scenario;
}

/// As "field", but that the first view does not stay where it is. The images say where it is.
Scenario moving(std::int64_t seed) {
  Scenario scenario = field(seed);
  scenario.name = "moving";
  scenario.meaning =
      "field, and the C-arm turns by 30 deg, the table pans, the field of view changes; each image says how "
      "the view stood";
  const auto turned = [](double from_s, double turn_deg) {
    constexpr double kSpeed_deg_s = 10;
    ViewMove move;
    move.from_s = from_s;
    move.until_s = from_s + std::abs(turn_deg) / kSpeed_deg_s;
    move.turn_deg = turn_deg;
    return move;
  };
  ViewMove pan;
  pan.from_s = 15;
  pan.until_s = 17;
  pan.pan_mm = {12, 20, 0};
  ViewMove zoom;
  zoom.from_s = 30;
  zoom.until_s = 30.1;
  zoom.zoom = 1.15;
  scenario.view_motion.moves = {turned(8, -30), pan, turned(22, 30), zoom, turned(34, -30)};
  return scenario;
}

Scenario bench(std::int64_t seed) {
  Scenario scenario = common(
      "bench",
      "Sec. 3.2: four coils in a silicone aorta, five halts with one image each, registered by 13 markers; "
      "the tracker as in field",
      seed, 0, 0);
  place_on_bench(scenario);
  return scenario;
}

/// Up to the arch, turned in the hand on the way: a catheter that its maker has bent has no wire to pull.
std::vector<CatheterCommand> preshaped_commands() {
  constexpr CatheterCommand kInsert{1, 0, 0};
  constexpr CatheterCommand kTurn{0, 4.5 * kDegree, 0};
  std::vector<CatheterCommand> commands(70, kInsert);
  commands.insert(commands.end(), 40, kTurn);
  commands.insert(commands.end(), 50, CatheterCommand{1, 3 * kDegree, 0});
  commands.insert(commands.end(), 20, CatheterCommand{-1, 0, 0});
  commands.insert(commands.end(), 30, kTurn);
  return commands;
}

/// As "field", but that the catheter's maker has bent its tip.
Scenario preshaped(std::int64_t seed) {
  Scenario scenario = field(seed);
  scenario.name = "preshaped";
  scenario.meaning =
      "field, and the catheter's tip is a hook of 8 mm; it goes up to the arch and is turned in the hand";
  scenario.commands = preshaped_commands();
  scenario.short_of_root_mm = 228;
  constexpr double kRadius_mm = 8;
  return with_hook(std::move(scenario), {kRadius_mm, 0});
}

/// As "field", seen on the monitor of a console by way of its video output, in a patient who was operated on.
Scenario console(std::int64_t seed) {
  Scenario scenario = field(seed);
  scenario.name = "console";
  scenario.meaning =
      "field on the 1024 x 1024 pixels of a console's video output: grid lines, vignetting, automatic "
      "brightness, temporal filter, edge enhancement, steep grey values, burnt-in text (masked); a braided "
      "catheter with marker bands, sternal wires, clips and leads";
  FlatPanel output;
  output.readout = DetectorReadout::kDisplay;
  output.bits = 8;
  output.pixel_mm = 0.3;
  CameraCalibration& camera = scenario.room.cameras.front();
  camera = with_pixels(camera, output.pixel_mm);
  camera.cx += (1024 - camera.width) / 2.0;
  camera.cy += (1024 - camera.height) / 2.0;
  camera.width = camera.height = 1024;
  scenario.panel = output;
  scenario.console = typical_console();
  camera.masks = Console::text_areas(scenario.console, camera.width, camera.height);
  scenario.is_braided = true;
  scenario.marker_bands_mm = {20, 50, 90};
  scenario.clutter.ecg_leads = true;
  scenario.clutter.surgery = true;
  return scenario;
}

/// As "field", with another catheter like it in the same vessel.
Scenario twins(std::int64_t seed) {
  Scenario scenario = field(seed);
  scenario.name = "twins";
  scenario.meaning =
      "field, and an equal catheter without coils beside it, withdrawn while this one is pushed: their tips "
      "pass each other";
  scenario.has_twin = true;
  return scenario;
}

/// As "field", with a catheter of 9 Fr, seen by a panel of today.
Scenario flat_panel(std::int64_t seed) {
  Scenario scenario = field(seed);
  scenario.name = "flatpanel";
  scenario.meaning =
      "field, and a catheter of 3 mm on a panel of 1024 x 1024 pixels and 12 bits of intensity, 14 px wide";
  scenario.room.instruments.front().diameter_mm = 3;
  CameraCalibration& camera = scenario.room.cameras.front();
  const FlatPanel panel;
  camera = with_pixels(camera, panel.pixel_mm);
  camera.cx += (1024 - camera.width) / 2.0;
  camera.cy += (1024 - camera.height) / 2.0;
  camera.width = camera.height = 1024;
  scenario.panel = panel;
  return scenario;
}

/// In, then to and fro by about 15 mm in no even rhythm, with a turn of the hand: half a minute of it.
std::vector<CatheterCommand> to_and_fro_commands(double steps_per_s, std::int64_t seed) {
  constexpr int kInsertions = 40;  // the tip is free, and in view
  constexpr double kDuration_s = 26;
  std::vector<CatheterCommand> commands = paper_commands();
  commands.resize(kInsertions);
  CounterRandom random(seed, 7206, 0);
  struct Swing {
    double amplitude_mm, rate_hz, phase;
  };
  std::array<Swing, 3> swings{{{8, 0.37, 0}, {5, 0.83, 0}, {2, 1.3, 0}}};
  for (Swing& swing : swings) {
    swing.rate_hz *= 0.85 + 0.3 * random.unit();
    swing.phase = 2 * std::numbers::pi * random.unit();
  }
  const auto place_mm = [&swings](double t_s) {
    double sum_mm = 0;
    for (const Swing& swing : swings) {
      sum_mm += swing.amplitude_mm *
                (std::sin(2 * std::numbers::pi * swing.rate_hz * t_s + swing.phase) - std::sin(swing.phase));
    }
    return sum_mm;
  };
  constexpr double kTurn_rad_mm = 2 * kDegree;  // the hand turns a little as it pulls
  for (double t_s = 0; t_s < kDuration_s; t_s += 1 / steps_per_s) {
    const double insert_mm = place_mm(t_s + 1 / steps_per_s) - place_mm(t_s);
    commands.push_back({insert_mm, kTurn_rad_mm * insert_mm, 0});
  }
  return commands;
}

/// As "field", with the tip moved as `tubectl calibrate time` asks for.
Scenario to_and_fro(std::int64_t seed) {
  Scenario scenario = field(seed);
  scenario.name = "to-and-fro";
  scenario.meaning =
      "the tip goes to and fro for half a minute, as tubectl calibrate time asks for; field's tracker";
  scenario.steps_per_s = 30;
  scenario.frame_rate_hz = 15;
  scenario.commands = to_and_fro_commands(scenario.steps_per_s, seed);
  scenario.fluoroscopy_off = {{0, 1.4}};
  return scenario;
}

/// All presets, in the order in which they are listed: a new one is a row here and what makes it.
struct Preset {
  std::string_view name;
  Scenario (*make)(std::int64_t seed);
};
constexpr std::array<Preset, 12> kPresets{{{"paper", paper},
                                           {"field", field},
                                           {"frozen", frozen},
                                           {"clinical", clinical},
                                           {"biplane", biplane},
                                           {"moving", moving},
                                           {"bench", bench},
                                           {"preshaped", preshaped},
                                           {"flatpanel", flat_panel},
                                           {"console", console},
                                           {"to-and-fro", to_and_fro},
                                           {"twins", twins}}};

}  // namespace

const std::vector<std::string>& preset_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    std::transform(kPresets.begin(), kPresets.end(), std::back_inserter(all),
                   [](const Preset& preset) { return std::string(preset.name); });
    return all;
  }();
  return names;
}

Scenario make_scenario(std::string_view preset, std::int64_t seed) {
  const auto found = std::find_if(kPresets.begin(), kPresets.end(),
                                  [&](const Preset& known) { return known.name == preset; });
  if (found == kPresets.end()) {
    std::string known;
    for (const std::string& name : preset_names()) {
      known += (known.empty() ? "" : ", ") + name;
    }
    throw std::invalid_argument("there is no preset '" + std::string(preset) + "'; there are " + known);
  }
  return found->make(seed);
}

}  // namespace tubed
