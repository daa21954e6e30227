// The patient's reference: where the tracker's frame is now, against where it was when it was registered.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "daemon/estimator/reference/pose_filter.hpp"
#include "drivers/interface/reference_description.hpp"

namespace tubed {

/// What is not known of the reference's pose, as an error that all coils of an instant share: the true place
/// of a point p is off by -w x (p - pivot) - v, (w, v) of N(0, covariance). Far from the reference the turn
/// counts (lever arm).
struct ReferenceError {
  Eigen::Vector3d pivot_mm = Eigen::Vector3d::Zero();
  PoseCovariance covariance = PoseCovariance::Zero();

  /// Of a point in the frame of the pivot, mm^2.
  [[nodiscard]] Eigen::Matrix3d covariance_at(const Eigen::Vector3d& p_mm) const;
  /// The same error in another frame, p_to = T_to_from * p_from.
  [[nodiscard]] ReferenceError in(const RigidTransform& T_to_from) const;
};

/// What takes a measurement to the tracker's frame as it was registered,
///   T_registered_em(t) = T_em_reference_registered * T_em_reference(t)^-1;
/// T_world_em(t) = T_world_em of the registration * that.
struct EmPlacement {
  RigidTransform T_registered_em = RigidTransform::Identity();
  ReferenceError error;  ///< in the registered frame
};

/// May coils be taken to the world?
enum class ReferenceDoubt {
  kNone,
  kDoubtful,  ///< it is missing or contradicts itself just now, or it has jumped: QUESTIONABLE
  kLost,      ///< for longer than its timeout: INVALID
};

/// Follows the reference from measurement to measurement. Without one in the configuration every measurement
/// is where it was registered. What is no pose (missing, out of the volume, repeated bit by bit, two coils
/// that are not the body that was registered) is filled with the pose before for as long as the timeout, and
/// said. A jump is believed when the next measurement confirms it; the one that was not yet confirmed places
/// nothing. When the other coils did not move with a jump, it was not the field generator that moved, but the
/// sensor on the patient: that is said until it is back. A value of one thread; never allocates once it is
/// made, and reads no clock.
class EmReference {
 public:
  explicit EmReference(const std::optional<ReferenceDescription>& description);

  /// The next measurement, later than the one before. Nothing: its coils cannot be taken to the world.
  std::optional<EmPlacement> take(const EmFrame& frame);

  [[nodiscard]] ReferenceDoubt doubt(MonotonicTime now) const;

  /// Writes what is wrong and what to do, zero-terminated; empty when nothing is, or nothing was measured
  /// yet.
  void describe(MonotonicTime now, std::span<char> words) const;

 private:
  enum class Fault {
    kNone,
    kMissing,
    kOutOfVolume,
    kStuck,
    kNoOrientation,
    kContradiction,
    kJump,
    kSettling
  };
  struct Sighting {
    Fault fault = Fault::kMissing;
    SensorPose pose;
  };
  /// The reference's own samples, since when they are the same, and how often they were so.
  struct Repetition {
    std::array<CoilSample, 2> samples;
    MonotonicTime since{};
    int count = 0;
  };
  struct Jump {
    MonotonicTime time{};
    double shift_mm = 0;
    double turn_deg = 0;
  };
  struct Candidate {
    SensorPose pose;
    MonotonicTime time{};
  };

  [[nodiscard]] Sighting sight(const EmFrame& frame);
  [[nodiscard]] Fault fault_of(const EmFrame& frame);
  [[nodiscard]] bool repeats(const EmFrame& frame);
  [[nodiscard]] Fault follow(const SensorPose& pose, const EmFrame& frame);
  void jump(const SensorPose& pose, const EmFrame& frame);
  [[nodiscard]] bool coils_stayed(const EmFrame& frame, const RigidTransform& T_registered_em) const;
  [[nodiscard]] bool is_jump(const PoseError& difference) const;
  [[nodiscard]] bool is_lost(MonotonicTime now) const;
  [[nodiscard]] bool is_of_reference(int index) const;
  [[nodiscard]] RigidTransform T_registered_em(const RigidTransform& T_em_body) const;
  [[nodiscard]] EmPlacement placement() const;

  std::optional<ReferenceDescription> description_;
  SensorSigma sigma_;
  TwoCoils body_;  ///< of two coils, as registered, their middle at the origin
  RigidTransform T_registered_body_ = RigidTransform::Identity();
  PoseFilter filter_;
  std::optional<Candidate> candidate_;  ///< what may be a jump, or the beginning
  Fault fault_ = Fault::kMissing;
  bool begun_ = false;
  bool has_measured_ = false;
  MonotonicTime newest_good_{};
  EmFrame good_;  ///< the newest measurement that had the reference
  Repetition repetition_;
  std::optional<Jump> jump_;
  std::optional<RigidTransform> slip_;  ///< where the reference is, against where it would be had it stayed
};

}  // namespace tubed
