// What a jump of the first or the last coil leaves open: did the tube's end whip, or is the coil displaced?
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/coils/coil_observation.hpp"

namespace tubed {

/// A coil between others that jumps from one measurement to the next is displaced: the tube does not move so.
/// At an end the tube may: what is left out comes back, and the shape follows it. Which of the two it was
/// stays open, and with it half of the square of the jump, from that coil to the next one, where it ends. A
/// jump back takes it away, and so does a minute. Copied with the state; never allocates.
class EndJumps {
 public:
  /// Jumps shorter than this are none.
  static constexpr double kJump_mm = 6;

  /// An end coil (the first or the last of `coils`) that had jumped, and no other with it, is believed again
  /// although the shape without it lies `off_mm` (world) away. Instants do not go back.
  void believe(const CoilObservations& coils, int coil, const Eigen::Vector3d& off_mm, MonotonicTime time);

  /// Mean square of what the tube may be off by at s_mm from its tip, mm^2, world, whatever images show
  /// there.
  [[nodiscard]] Eigen::Matrix3d square_mm2(double s_mm, MonotonicTime now) const;

 private:
  struct Jump {
    Eigen::Vector3d off_mm = Eigen::Vector3d::Zero();  ///< the sum of them
    double s_mm = 0;                                   ///< of the coil, and
    double next_mm = 0;                                ///< of the one beside it
    MonotonicTime at{};
  };

  [[nodiscard]] static double kept(const Jump& jump, MonotonicTime now);

  std::array<Jump, 2> jumps_{};  ///< of the first coil and of the last
};

}  // namespace tubed
