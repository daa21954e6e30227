// D_i of the paper: what the coils of one instrument say at one instant, in the world frame.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/coils/em_history.hpp"
#include "drivers/interface/room.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// One D_i = {p_i, t_i}.
struct CoilObservation {
  CoilState state = CoilState::kMissing;
  double belief = 0.999;  ///< probability that it says where it is, before this measurement was looked at
  double s_mm = 0;        ///< arc length from the tip
  Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d tangent_world = Eigen::Vector3d::Zero();  ///< unit, toward the tip
  [[nodiscard]] bool used() const { return state == CoilState::kUsed; }
};

struct CoilObservations {
  int count = 0;
  std::array<CoilObservation, kMaxCoils> coils;
  [[nodiscard]] int used_count() const;
  /// Arc length of the first one that takes part, mm from the tip; 0 when none does.
  [[nodiscard]] double first_used_mm() const;
  /// The same of the last one.
  [[nodiscard]] double last_used_mm() const;
  /// Does one that takes part lie within kHolds_mm of this place on the tube, mm from the tip?
  [[nodiscard]] bool hold(double s_mm) const;
  /// So far along the tube a coil says about as well where it is as at itself: bending moves it by
  /// sqrt(bending_q_per_mm d^3 / 3), 2.5 mm, which is what a coil errs by.
  static constexpr double kHolds_mm = 30;
  /// Is that near enough to the tip to say where it is?
  [[nodiscard]] bool hold_tip() const { return first_used_mm() <= kTipIsHeldFrom_mm; }
  static constexpr double kTipIsHeldFrom_mm = kHolds_mm;
  /// Does the coil that is nearest to this place on the tube, mm from the tip, take part?
  [[nodiscard]] bool nearest_is_used(double place_mm) const;
};

/// Picks the instrument's coils out of `frame` (nullptr: all missing) and takes them to the world: from where
/// the tracker's frame was then, `history` knows, to where it was registered, and by T_world_em on. A coil
/// that gave bit-equal values for `stuck_ns` in `history` is kStuck. Never allocates.
CoilObservations observe_coils(const EmFrame* frame, const EmHistory& history,
                               const InstrumentDescription& instrument, const RigidTransform& T_world_em,
                               std::int64_t stuck_ns);

}  // namespace tubed
