// What a jump of all coils together leaves open: has the field changed, or the tube moved?
#pragma once

#include <Eigen/Core>
#include <optional>

#include "daemon/estimator/coils/coil_observation.hpp"

namespace tubed {

/// From one measurement to the next a tube is pushed, pulled, or whips somewhere; all of it does not go to
/// the side. Coils that all do have a field that changed (metal that was brought or taken away), or a patient
/// who was moved. Which of the two it was stays open, and with it half of the square of the jump, of the
/// whole tube, but for what images hold. To the other sides it is a quarter of the jump, as far as coils may
/// differ. A jump back takes it away, and so does a minute. Copied with the state; never allocates.
class CommonJump {
 public:
  /// Jumps shorter than this are none.
  static constexpr double kJump_mm = 4;

  /// Takes a measurement, made at `time`, and the one before it, `interval_s` older. `noise_mm`: standard
  /// deviation of what is new in a coil's error with every measurement, an axis. True if they jumped.
  /// Instants do not go back.
  bool observe(const CoilObservations& before, const CoilObservations& now, double interval_s,
               double noise_mm, MonotonicTime time);

  /// Length of what is left of it, mm.
  [[nodiscard]] double left_mm(MonotonicTime now) const;

  /// Mean square of what the whole tube may be off by, mm^2, world, whatever images show.
  [[nodiscard]] Eigen::Matrix3d square_mm2(MonotonicTime now) const;

 private:
  [[nodiscard]] double kept(MonotonicTime now) const;

  Eigen::Vector3d off_mm_ = Eigen::Vector3d::Zero();  ///< the sum of them
  MonotonicTime at_{};
};

/// By how much all coils lie to the side of where they lay before, mm, world: the least squares' answer of
/// what is across the tube at each coil. Nothing where fewer than three coils bear it out (what only one of
/// them sees across itself the others do not contradict), where they do not say the same, or where it is no
/// more than noise makes it.
std::optional<Eigen::Vector3d> common_jump_mm(const CoilObservations& before, const CoilObservations& now,
                                              double noise_mm);

}  // namespace tubed
