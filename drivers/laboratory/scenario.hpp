// The presets of the simulation: patient, motion, views, tracker and what goes wrong, by name and seed.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/interface/room.hpp"
#include "drivers/laboratory/flat_panel.hpp"
#include "drivers/laboratory/fluoroscope/radiograph_scene.hpp"
#include "drivers/laboratory/instrument/catheterisation.hpp"
#include "drivers/laboratory/tracker/em_errors.hpp"
#include "drivers/laboratory/vessel/aorta.hpp"
#include "drivers/laboratory/view_motion.hpp"

namespace tubed {

/// From and until, s.
struct TimeSpan {
  double from_s = 0;
  double until_s = 0;
  [[nodiscard]] bool contains(double t_s) const { return t_s >= from_s && t_s < until_s; }
};

/// What the presets' views look at, world: the arch is in the upper third of the image.
inline const Eigen::Vector3d kViewCentre_mm(0, 0, -75);

/// What is around the catheter in the pictures.
enum class Body {
  kThorax,  ///< a patient's chest
  kMockUp,  ///< a silicone aorta on a table
};

/// Everything that a preset is, for one seed.
struct Scenario {
  std::string name;
  std::string meaning;  ///< one line for a person
  std::int64_t seed = 0;
  AortaDimensions patient;
  CatheterProperties catheter;
  std::string vessel_file;  ///< of the user's own, instead of the patient's aorta; empty: none
  std::vector<CatheterCommand> commands;
  double short_of_root_mm = 0;  ///< the commands end so much before the aorta's root
  double steps_per_s = 7.5;     ///< commands a second
  double frame_rate_hz = 7.5;   ///< exposures of the first view
  int second_view_every = 1;    ///< of the first view's exposures has one of the second view with it
  double em_rate_hz = 40;
  double em_phase_s = 0;             ///< of the first measurement after the first exposure
  double em_clock_error_s = 0;       ///< the tracker's time stamps are so much late
  bool em_with_every_image = false;  ///< one measurement at each exposure instead of em_rate_hz
  EmErrorSettings em;
  RoomDescription room;  ///< cameras, registration as it is given to the daemon, one catheter
  /// The true registration is room.T_world_em * registration_error.
  RigidTransform registration_error = RigidTransform::Identity();
  /// Middle of the region that the part of the catheter that is asked for comes through.
  Eigen::Vector3d middle_world_mm{0, 0, -195};
  std::vector<TimeSpan> fluoroscopy_off;
  std::vector<TimeSpan> halts;  ///< the catheter is kept still; its first and last exposure lie within
  Body body = Body::kThorax;
  ViewMotion view_motion;            ///< of the first view
  ClutterStates clutter;             ///< what else is in the pictures
  double contrast_from_s = -1;       ///< when contrast agent is injected; negative: never
  double detector_lag = 0;           ///< part of a picture that stays for the next
  std::optional<FlatPanel> panel{};  ///< what the pictures are taken with; nothing: as a console shows them
  ConsoleSettings console{};         ///< what is done to them on their way
  bool is_braided = false;           ///< the catheter's wall, with steel wire
  std::vector<double> marker_bands_mm{};  ///< of gold, on the catheter: middles, from the tip
  /// Another catheter like it, without coils, lies beside it in the vessel: it is withdrawn while this one is
  /// pushed, so that their tips pass each other.
  bool has_twin = false;

  [[nodiscard]] bool fluoroscopy_on(double t_s) const;
  /// Until the last command has been carried out.
  [[nodiscard]] double duration_s() const { return static_cast<double>(commands.size()) / steps_per_s; }
};

/// Where the part of a catheter that is asked for can be, in the tracker's frame.
Eigen::AlignedBox3d working_volume_mm(const RigidTransform& T_em_world);

/// The names of all presets.
const std::vector<std::string>& preset_names();

/// Throws std::invalid_argument, naming the presets there are, for another name.
Scenario make_scenario(std::string_view preset, std::int64_t seed);

/// The scenario in a vessel of the user's own (see read_vessel, whose errors it throws): the views are turned
/// to the middle of its route, and commands that would go beyond its end are left out.
Scenario in_vessel(Scenario scenario, const std::string& vessel_file);

/// What a person says of a hook.
struct HookChoice {
  double radius_mm = 0;           ///< 0: as the preset has it
  double length_mm = 0;           ///< 0: 1.75 times the radius, 14 mm at least and 40 mm at most
  std::vector<double> arcs_mm{};  ///< instead of both: as RestCurve::from_pairs() takes them; empty: a circle
};

/// The scenario with a catheter whose tip is such a hook; the roll of its plane is drawn from the seed.
/// Throws std::invalid_argument for a hook that cannot be: tighter than 6 mm (its nodes are 3 mm apart),
/// longer than 45 mm (the bendable tip is 50 mm long), more than half a circle in one arc, or a length
/// without a radius.
Scenario with_hook(Scenario scenario, const HookChoice& choice);

/// The scenario with a catheter whose bendable tip, its last 50 mm, is so many times as stiff against bending
/// as its shaft; 0: as it is. Throws std::invalid_argument below 0.05.
Scenario with_tip_stiffness(Scenario scenario, double times);

/// The scenario with pictures of a panel, parse_panel(`words`), of the same field of view; empty: as it is.
Scenario on_panel(Scenario scenario, std::string_view words);

/// The scenario with pictures straight from the detector, and without marker bands, braid, wires and clips:
/// what a console's processing and foreign metal cost is measured against it.
Scenario undisturbed(Scenario scenario);

/// Runs the scenario's mechanics: its vessel, then all commands; two to four
/// seconds.
Catheterisation run_scenario(const Scenario& scenario, const std::function<void(std::size_t)>& progress = {});

/// The same, computed once and shared by all holders in this process. Waits while another thread computes it.
std::shared_ptr<const Catheterisation> shared_run_of(const Scenario& scenario,
                                                     const std::function<void(std::size_t)>& progress = {});

}  // namespace tubed
