#include "drivers/laboratory/scenario.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "drivers/laboratory/fluoroscope/console.hpp"
#include "drivers/laboratory/random/counter_random.hpp"
#include "drivers/laboratory/vessel/vessel_file.hpp"

namespace tubed {

namespace {

CatheterisationStart start_in(const Vessel& vessel, const Scenario& scenario) {
  if (scenario.vessel_file.empty()) {
    // The reference of the introducer is anterior; the arch turns from there toward the right.
    CatheterisationStart start =
        start_for(vessel, -scenario.patient.arch_turn_from_anterior_rad, scenario.seed, scenario.commands);
    start.insertion_mm -= scenario.short_of_root_mm;
    return start;
  }
  constexpr double kMinInsertion_mm = 60;
  CatheterisationStart start = start_for(vessel, 0, scenario.seed, scenario.commands);
  start.insertion_mm = std::max(start.insertion_mm, kMinInsertion_mm);
  return start;
}

/// The curve that a person chose; `usual` where nothing was said of it.
RestCurve curve_of(const HookChoice& choice, const RestCurve& usual) {
  if (!choice.arcs_mm.empty()) return RestCurve::from_pairs(choice.arcs_mm);
  RestArc arc = usual.arcs.empty() ? RestArc{} : usual.arcs.front();
  if (choice.radius_mm != 0) {
    arc = {std::clamp(1.75 * choice.radius_mm, 14.0, 40.0), choice.radius_mm};
  }
  if (choice.length_mm != 0) {
    arc.length_mm = choice.length_mm;
  }
  return {{arc}};
}

bool can_be(const RestCurve& curve) {
  constexpr double kMinRadius_mm = 6;
  constexpr double kMaxLength_mm = 45;
  return curve.length_mm() > 0 && curve.length_mm() <= kMaxLength_mm &&
         std::ranges::all_of(curve.arcs, [](const RestArc& arc) {
           return arc.length_mm > 0 && (arc.radius_mm == 0 || std::abs(arc.radius_mm) >= kMinRadius_mm) &&
                  arc.length_mm * std::abs(arc.curvature_per_mm()) <= std::numbers::pi;
         });
}

}  // namespace

bool Scenario::fluoroscopy_on(double t_s) const {
  return std::none_of(fluoroscopy_off.begin(), fluoroscopy_off.end(),
                      [&](const TimeSpan& span) { return span.contains(t_s); });
}

Eigen::AlignedBox3d working_volume_mm(const RigidTransform& T_em_world) {
  const Eigen::AlignedBox3d world_mm(Eigen::Vector3d(-100, -100, -450), Eigen::Vector3d(100, 100, 60));
  return world_mm.transformed(T_em_world);
}

Scenario in_vessel(Scenario scenario, const std::string& vessel_file) {
  const Vessel vessel = read_vessel(vessel_file);
  scenario.vessel_file = vessel_file;
  double insertion_mm = start_in(vessel, scenario).insertion_mm;
  std::vector<CatheterCommand> fitting;
  for (const CatheterCommand& command : scenario.commands) {
    if (insertion_mm + command.insert_mm <= vessel.route_length_mm()) {
      insertion_mm += command.insert_mm;
      fitting.push_back(command);
    }
  }
  scenario.commands = fitting;
  Eigen::AlignedBox3d box;
  for (const VesselStation& station : vessel.route) {
    box.extend(station.p_world_mm);
  }
  scenario.middle_world_mm = box.center();
  for (CameraCalibration& camera : scenario.room.cameras) {
    camera.T_camera_world = camera.T_camera_world * Eigen::Translation3d(kViewCentre_mm - box.center());
  }
  return scenario;
}

Scenario with_hook(Scenario scenario, const HookChoice& choice) {
  constexpr std::int64_t kHookStream = 7205;
  if (choice.radius_mm == 0 && choice.length_mm == 0 && choice.arcs_mm.empty()) {
    return scenario;
  }
  Hook& hook = scenario.catheter.hook;
  hook.curve = curve_of(choice, hook.curve);
  if (choice.arcs_mm.size() % 2 != 0 || !can_be(hook.curve)) {
    throw std::invalid_argument(
        "a hook has radii of 6 mm or more, arcs of half a circle at most, and is 45 mm long at most");
  }
  CounterRandom random(scenario.seed, kHookStream, 0);
  hook.roll_rad = std::numbers::pi * random.signed_unit();
  return scenario;
}

Scenario with_tip_stiffness(Scenario scenario, double times) {
  constexpr double kMin = 0.05;  // softer, and the rod's steps are too long for it
  if (times != 0 && !(times >= kMin)) {
    throw std::invalid_argument("a tip is 0.05 times as stiff as the shaft or more; 0: as the preset has it");
  }
  if (times != 0) {
    scenario.catheter.tip_bending_stiffness_N_mm2 = times * scenario.catheter.bending_stiffness_N_mm2;
  }
  return scenario;
}

Scenario on_panel(Scenario scenario, std::string_view words) {
  if (!words.empty()) {
    scenario.panel = parse_panel(words);
    for (CameraCalibration& camera : scenario.room.cameras) {
      camera = with_pixels(camera, scenario.panel->pixel_mm);
      camera.masks = Console::text_areas(scenario.console, camera.width, camera.height);
    }
  }
  return scenario;
}

Scenario undisturbed(Scenario scenario) {
  scenario.console = {};
  scenario.is_braided = false;
  scenario.marker_bands_mm.clear();
  scenario.clutter.second_wire = scenario.clutter.ecg_leads = scenario.clutter.surgery = false;
  for (CameraCalibration& camera : scenario.room.cameras) {
    camera.masks.clear();
  }
  return scenario;
}

Catheterisation run_scenario(const Scenario& scenario, const std::function<void(std::size_t)>& progress) {
  const Vessel vessel =
      scenario.vessel_file.empty() ? make_aorta(scenario.patient) : read_vessel(scenario.vessel_file);
  return catheterise(vessel, scenario.catheter, start_in(vessel, scenario), scenario.commands, progress);
}

std::shared_ptr<const Catheterisation> shared_run_of(const Scenario& scenario,
                                                     const std::function<void(std::size_t)>& progress) {
  static std::mutex mutex;
  using Key =
      std::tuple<std::string, std::int64_t, std::string, double, std::vector<std::pair<double, double>>>;
  static std::map<Key, std::weak_ptr<const Catheterisation>> runs;
  const std::lock_guard lock(mutex);
  std::vector<std::pair<double, double>> arcs;
  for (const RestArc& arc : scenario.catheter.hook.curve.arcs)
    arcs.emplace_back(arc.length_mm, arc.radius_mm);
  auto& known = runs[{scenario.name, scenario.seed, scenario.vessel_file,
                      scenario.catheter.tip_bending_stiffness_N_mm2, std::move(arcs)}];
  std::shared_ptr<const Catheterisation> run = known.lock();
  if (run == nullptr) {
    run = std::make_shared<const Catheterisation>(run_scenario(scenario, progress));
    known = run;
  }
  return run;
}

}  // namespace tubed
