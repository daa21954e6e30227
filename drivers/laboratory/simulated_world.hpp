// The truth of the simulation: where every catheter is at any time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/interface/timestamps.hpp"
#include "drivers/laboratory/played_run.hpp"
#include "drivers/laboratory/room_mistakes.hpp"
#include "drivers/laboratory/scenario.hpp"
#include "drivers/laboratory/vessel/vessel_centreline.hpp"

namespace tubed {

/// The preset that is no scenario: catheters in an aortic arch, ready at once.
inline constexpr std::string_view kArchPreset = "arch";

/// What `preset` of the simulation may be: kArchPreset, then preset_names() of the scenarios.
std::vector<std::string> simulation_presets();

/// Catheters by time. A pure function of settings and time: another process with the same settings has the
/// same truth. Uses nothing of the estimator's curves. Immutable, callable from any thread, never allocates
/// after construction.
///
/// With a preset the catheter is pushed through that preset's aorta and pulled back, again and again (further
/// instruments do the same 5 s later, 16 mm aside); construction runs the mechanics, some seconds, once for
/// all worlds of a process.
///
/// With `preset = "arch"` catheters slide to and fro along an aortic arch without touching, each in a vessel
/// of its own, ready at once. The vessel comes up from below the image of a camera that looks along world z
/// at the world's origin (x right, y down), turns over an arch of about 28 mm radius and comes down again,
/// about 20 mm deep in z. The catheter's point at arc length s from the tip is the vessel's at insertion - s:
/// it keeps its length by construction.
class SimulatedWorld {
 public:
  /// `described`: the room as the configuration has it; with mistakes in the settings the room is another.
  /// `settings`: the described keys of the simulation driver; `epoch_ns`, `speed_mm_s`, `preset`, `seed`,
  /// `mistakes`, those of the hook and those of the moving view are used here. Throws std::invalid_argument
  /// for a mistake that there is not and for a hook that cannot be.
  SimulatedWorld(RoomDescription described, const DriverSettings& settings);

  /// Seconds since the epoch of the simulation.
  [[nodiscard]] double seconds(MonotonicTime time) const { return seconds_between(epoch_, time); }

  /// Centreline of the instrument (index in the room's list) at `t_s` seconds since the epoch, `s_mm` from
  /// its tip; s_mm may be beyond its length. World frame, mm.
  [[nodiscard]] Eigen::Vector3d point(int instrument, double t_s, double s_mm) const;
  /// The same of the catheter beside it that the scenario has (Scenario::has_twin), which no tracker sees.
  [[nodiscard]] Eigen::Vector3d twin_point(double t_s, double s_mm) const;
  /// Unit tangent there, toward the tip, world frame.
  [[nodiscard]] Eigen::Vector3d tangent(int instrument, double t_s, double s_mm) const;
  /// How far the tip has come along its vessel, mm from the entry.
  [[nodiscard]] double insertion_mm(int instrument, double t_s) const;

  /// The catheter that an instrument is: its own index, or that of an earlier instrument with the same coils
  /// (one catheter may be tracked twice, e.g. by two estimators).
  [[nodiscard]] int catheter_of(int instrument) const {
    return catheters_[static_cast<std::size_t>(instrument)];
  }

  /// As it is, which without mistakes is as it was described.
  [[nodiscard]] const RoomDescription& room() const { return room_; }
  /// What is described wrong, or goes wrong.
  [[nodiscard]] const RoomMistakes& mistakes() const { return mistakes_; }
  /// What is simulated; nullptr for "arch".
  [[nodiscard]] const Scenario* scenario() const { return scenario_.get(); }
  /// How the room's first view moves: as the preset has it, or as the settings say.
  [[nodiscard]] const ViewMotion& view_motion() const { return view_motion_; }
  /// How that camera stands at `t_s`, and what an image of it says; see moved_view() and announced_view().
  [[nodiscard]] ViewGeometry view(const CameraCalibration& at_rest, double t_s) const;
  [[nodiscard]] std::optional<ViewGeometry> announced(const CameraCalibration& at_rest, double t_s,
                                                      std::int64_t exposure, std::int64_t seed) const;
  /// When the catheter is half way in; 30 s for "arch".
  [[nodiscard]] double half_way_s() const;
  /// The preset's time at `t_s`: it begins again when the catheter is back. The same time for "arch".
  [[nodiscard]] double scenario_time_s(double t_s) const;

 private:
  [[nodiscard]] bool is_first(const CameraCalibration& camera) const;
  [[nodiscard]] VesselPoint at(int instrument, double t_s, double s_mm) const;

  RoomMistakes mistakes_;
  MistakeDraw draw_;
  RoomDescription room_;
  MonotonicTime epoch_;
  double max_speed_mm_s_;
  std::shared_ptr<const Scenario> scenario_;
  std::shared_ptr<const PlayedRun> run_;
  ViewMotion view_motion_;
  std::vector<int> catheters_;             ///< one an instrument
  std::vector<VesselCentreline> vessels_;  ///< one an instrument
};

}  // namespace tubed
