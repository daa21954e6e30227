#include "drivers/laboratory/scenario.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <utility>

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
  constexpr double kMinRadius_mm = 6;
  constexpr double kMaxLength_mm = 45;
  constexpr std::int64_t kHookStream = 7205;
  if (choice.radius_mm == 0 && choice.length_mm == 0) {
    return scenario;
  }
  Hook& hook = scenario.catheter.hook;
  if (choice.radius_mm != 0) {
    hook.radius_mm = choice.radius_mm;
    hook.length_mm = std::clamp(1.75 * choice.radius_mm, 14.0, 40.0);
  }
  if (choice.length_mm != 0) {
    hook.length_mm = choice.length_mm;
  }
  if (!(hook.radius_mm >= kMinRadius_mm && hook.length_mm <= kMaxLength_mm &&
        hook.length_mm <= std::numbers::pi * hook.radius_mm)) {
    throw std::invalid_argument(
        "a hook has a radius of 6 mm or more and is half a circle long and 45 mm at most");
  }
  CounterRandom random(scenario.seed, kHookStream, 0);
  hook.roll_rad = std::numbers::pi * random.signed_unit();
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
  using Key = std::tuple<std::string, std::int64_t, std::string, double, double>;
  static std::map<Key, std::weak_ptr<const Catheterisation>> runs;
  const std::lock_guard lock(mutex);
  auto& known = runs[{scenario.name, scenario.seed, scenario.vessel_file, scenario.catheter.hook.radius_mm,
                      scenario.catheter.hook.length_mm}];
  std::shared_ptr<const Catheterisation> run = known.lock();
  if (run == nullptr) {
    run = std::make_shared<const Catheterisation>(run_scenario(scenario, progress));
    known = run;
  }
  return run;
}

}  // namespace tubed
