#include "drivers/laboratory/simulated_world.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace tubed {

namespace {

constexpr double kEntryX_mm = 30;   ///< the descending aorta's place
constexpr double kEntryY_mm = 430;  ///< below the image: the rear of the catheter is out of view at first
constexpr double kMiddleInsertion_mm = 595;  ///< tip just past the top of the arch
constexpr double kTravel_mm = 75;            ///< to either side of it
constexpr double kTurnOfNextVessel_rad = 0.35;
constexpr double kDelayOfNextRun_s = 5;
const Eigen::Vector3d kOffsetOfNextVessel_mm(14, 8, 0);
const Eigen::Vector3d kOffsetOfTwin_mm(2.1, 2.1, 0);  // 3 mm: beside each other in one vessel

/// Bend directions count from the normal, which points to image left; a quarter turn on is depth.
std::vector<VesselPiece> aortic_arch() {
  constexpr double kDeeper_rad = std::numbers::pi / 2;
  constexpr double kShallower_rad = -std::numbers::pi / 2;
  return {
      {260, 0, 0},                    // from the groin
      {120, 1.0 / 900, kDeeper_rad},  // descending aorta, an S in depth: 16 mm
      {120, 1.0 / 900, kShallower_rad},
      {45, 1.0 / 27, 0.12},  // arch, its plane turned out of the image's
      {43, 1.0 / 30, 0.12},
      {80, 1.0 / 220, 0.4},  // ascending aorta
  };
}

VesselCentreline vessel_of(std::size_t instrument) {
  const auto number = static_cast<double>(instrument);
  const Eigen::AngleAxisd turn(number * kTurnOfNextVessel_rad, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d entry_mm =
      Eigen::Vector3d(kEntryX_mm, kEntryY_mm, 0) + number * kOffsetOfNextVessel_mm;
  return {entry_mm, -Eigen::Vector3d::UnitY(), turn * -Eigen::Vector3d::UnitX(), aortic_arch()};
}

bool same_coils(const InstrumentDescription& a, const InstrumentDescription& b) {
  return std::equal(a.coils.begin(), a.coils.end(), b.coils.begin(), b.coils.end(),
                    [](const CoilPlacement& x, const CoilPlacement& y) { return x.sensor == y.sensor; });
}

int first_with_same_coils(const std::vector<InstrumentDescription>& instruments, std::size_t instrument) {
  std::size_t first = 0;
  while (!same_coils(instruments[first], instruments[instrument])) {
    ++first;
  }
  return static_cast<int>(first);
}

MistakeDraw draw_of(const DriverSettings& settings, const Scenario* scenario) {
  return {settings.get<std::int64_t>("seed"),
          scenario == nullptr ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : scenario->middle_world_mm};
}

// A swing of the settings takes the place of what the preset's view does; a change comes on top.
void take_motion(const DriverSettings& settings, double half_way_s, ViewMotion& motion) {
  const double swing_deg = settings.get<double>("swing_deg");
  if (swing_deg != 0) {
    motion.repeat_s = settings.get<double>("swing_every_s");
    motion.moves = swing(swing_deg, settings.get<double>("swing_deg_s"), motion.repeat_s);
  }
  const double move_at_s = settings.get<double>("move_at_s");
  motion.once = moves_of({settings.get<double>("pan_mm"), settings.get<double>("turn_deg"),
                          settings.get<double>("zoom"), move_at_s < 0 ? half_way_s : move_at_s},
                         settings.get<std::int64_t>("seed"));
  motion.noise_rad = settings.get<double>("pose_noise_deg") * std::numbers::pi / 180;
  motion.noise_mm = settings.get<double>("pose_noise_mm");
  motion.announced = settings.get<bool>("announces_pose");
}

}  // namespace

std::vector<std::string> simulation_presets() {
  std::vector<std::string> names = preset_names();
  names.insert(names.begin(), std::string(kArchPreset));
  return names;
}

SimulatedWorld::SimulatedWorld(RoomDescription described, const DriverSettings& settings)
    : mistakes_(parse_mistakes(mistake_words(settings.get<std::string>("mistakes")))),
      room_(std::move(described)),
      epoch_(from_ns(settings.get<std::int64_t>("epoch_ns"))),
      max_speed_mm_s_(settings.get<double>("speed_mm_s")) {
  for (std::size_t instrument = 0; instrument < room_.instruments.size(); ++instrument) {
    catheters_.push_back(first_with_same_coils(room_.instruments, instrument));
    vessels_.push_back(vessel_of(instrument));
  }
  const std::string& preset = settings.get<std::string>("preset");
  if (preset != kArchPreset) {
    Scenario scenario =
        with_hook(make_scenario(preset, settings.get<std::int64_t>("seed")),
                  {settings.get<double>("hook_radius_mm"), settings.get<double>("hook_length_mm"),
                   settings.get<std::vector<double>>("hook_arcs_mm")});
    scenario = with_tip_stiffness(std::move(scenario), settings.get<double>("tip_stiffness"));
    const std::string& vessel_file = settings.get<std::string>("vessel");
    if (!vessel_file.empty()) {
      scenario = in_vessel(std::move(scenario), vessel_file);
    }
    scenario = on_panel(std::move(scenario), settings.get<std::string>("panel"));
    if (settings.get<bool>("undisturbed")) {
      scenario = undisturbed(std::move(scenario));
    }
    scenario_ = std::make_shared<const Scenario>(std::move(scenario));
    run_ = std::make_shared<const PlayedRun>(shared_run_of(*scenario_), scenario_->steps_per_s);
    view_motion_ = scenario_->view_motion;
    if (view_motion_.repeat_s == 0) view_motion_.repeat_s = 2 * run_->duration_s();
  }
  take_motion(settings, half_way_s(), view_motion_);
  draw_ = draw_of(settings, scenario_.get());
  room_ = real_room(std::move(room_), mistakes_, draw_);
}

bool SimulatedWorld::is_first(const CameraCalibration& camera) const {
  return !room_.cameras.empty() && room_.cameras.front().name == camera.name;
}

ViewGeometry SimulatedWorld::view(const CameraCalibration& at_rest, double t_s) const {
  return is_first(at_rest) ? moved_view(at_rest, view_motion_, t_s) : geometry_of(at_rest);
}

std::optional<ViewGeometry> SimulatedWorld::announced(const CameraCalibration& at_rest, double t_s,
                                                      std::int64_t exposure, std::int64_t seed) const {
  std::optional<ViewGeometry> said;
  if (is_first(at_rest)) said = announced_view(at_rest, view_motion_, t_s, exposure, seed);
  return said ? std::optional(described_view(*said, mistakes_, draw_, 0)) : std::nullopt;
}

double SimulatedWorld::half_way_s() const {
  constexpr double kOfTheArch_s = 30;
  return run_ == nullptr ? kOfTheArch_s : run_->duration_s() / 2;
}

double SimulatedWorld::scenario_time_s(double t_s) const {
  return run_ == nullptr ? t_s : std::fmod(std::max(t_s, 0.0), 2 * run_->duration_s());
}

double SimulatedWorld::insertion_mm(int instrument, double t_s) const {
  if (run_ != nullptr) {
    return run_->insertion_mm(t_s - kDelayOfNextRun_s * instrument);
  }
  const double angular_speed = max_speed_mm_s_ / kTravel_mm;
  return kMiddleInsertion_mm + kTravel_mm * std::sin(angular_speed * t_s + instrument);
}

Eigen::Vector3d SimulatedWorld::point(int instrument, double t_s, double s_mm) const {
  return at(instrument, t_s, s_mm).p_world_mm;
}

// The run is pushed in and pulled back in turn: half a turn later it goes the other way.
Eigen::Vector3d SimulatedWorld::twin_point(double t_s, double s_mm) const {
  return run_->at(t_s + run_->duration_s(), s_mm).p_world_mm + kOffsetOfTwin_mm;
}

Eigen::Vector3d SimulatedWorld::tangent(int instrument, double t_s, double s_mm) const {
  return at(instrument, t_s, s_mm).tangent_world;
}

VesselPoint SimulatedWorld::at(int instrument, double t_s, double s_mm) const {
  const int catheter = catheter_of(instrument);
  if (run_ != nullptr) {
    const ShapePoint point = run_->at(t_s - kDelayOfNextRun_s * catheter, s_mm);
    return {point.p_world_mm + catheter * kOffsetOfNextVessel_mm, point.tangent_world};
  }
  return vessels_[static_cast<std::size_t>(catheter)].at(insertion_mm(catheter, t_s) - s_mm);
}

}  // namespace tubed
