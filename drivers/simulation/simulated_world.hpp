// The truth of the simulation: where every catheter is at any time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/interface/timestamps.hpp"
#include "drivers/simulation/played_run.hpp"
#include "drivers/simulation/scenario.hpp"
#include "drivers/simulation/vessel_centreline.hpp"

namespace tubed {

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
  /// `settings`: the described keys of the simulation driver; `epoch_ns`, `speed_mm_s`, `preset` and `seed`
  /// are used here.
  SimulatedWorld(RoomDescription room, const DriverSettings& settings);

  /// Seconds since the epoch of the simulation.
  [[nodiscard]] double seconds(MonotonicTime time) const { return seconds_between(epoch_, time); }

  /// Centreline of the instrument (index in the room's list) at `t_s` seconds since the epoch, `s_mm` from
  /// its tip; s_mm may be beyond its length. World frame, mm.
  [[nodiscard]] Eigen::Vector3d point(int instrument, double t_s, double s_mm) const;
  /// Unit tangent there, toward the tip, world frame.
  [[nodiscard]] Eigen::Vector3d tangent(int instrument, double t_s, double s_mm) const;
  /// How far the tip has come along its vessel, mm from the entry.
  [[nodiscard]] double insertion_mm(int instrument, double t_s) const;

  /// The catheter that an instrument is: its own index, or that of an earlier instrument with the same coils
  /// (one catheter may be tracked twice, e.g. by two estimators).
  [[nodiscard]] int catheter_of(int instrument) const {
    return catheters_[static_cast<std::size_t>(instrument)];
  }

  [[nodiscard]] const RoomDescription& room() const { return room_; }
  /// What is simulated; nullptr for "arch".
  [[nodiscard]] const Scenario* scenario() const { return scenario_.get(); }
  /// The preset's time at `t_s`: it begins again when the catheter is back. The same time for "arch".
  [[nodiscard]] double scenario_time_s(double t_s) const;

 private:
  [[nodiscard]] VesselPoint at(int instrument, double t_s, double s_mm) const;

  RoomDescription room_;
  MonotonicTime epoch_;
  double greatest_speed_mm_s_;
  std::shared_ptr<const Scenario> scenario_;
  std::shared_ptr<const PlayedRun> run_;
  std::vector<int> catheters_;             ///< one an instrument
  std::vector<VesselCentreline> vessels_;  ///< one an instrument
};

}  // namespace tubed
