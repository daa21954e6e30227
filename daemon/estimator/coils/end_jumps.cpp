#include "daemon/estimator/coils/end_jumps.hpp"

#include <algorithm>
#include <cmath>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kJumpMemory_s = 60;  // as of what else stays of a coil's error
constexpr double kDisplaced = 0.5;    // probability that it was not the tube
constexpr double kJumpedBack = 0.5;   // of the newest jump, that is left of the sum
constexpr double kFarthest = 1.5;     // of the jump, beyond the coil
constexpr double kMinBetween_mm = 1;

}  // namespace

double EndJumps::kept(const Jump& jump, MonotonicTime now) {
  return std::exp(-std::max(seconds_between(jump.at, now), 0.0) / kJumpMemory_s);
}

void EndJumps::believe(const CoilObservations& coils, int coil, const Eigen::Vector3d& off_mm,
                       MonotonicTime time) {
  const int next = coil == 0 ? 1 : coil - 1;
  if (next >= coils.count || (coil != 0 && coil != coils.count - 1)) return;
  Jump& jump = jumps_[coil == 0 ? 0 : 1];
  jump.off_mm = kept(jump, time) * jump.off_mm + off_mm;
  jump.s_mm = coils.coils[static_cast<std::size_t>(coil)].s_mm;
  jump.next_mm = coils.coils[static_cast<std::size_t>(next)].s_mm;
  jump.at = time;
  const bool is_back = jump.off_mm.norm() < std::max(kJump_mm, kJumpedBack * off_mm.norm());
  if (is_back) jump.off_mm.setZero();
}

Eigen::Matrix3d EndJumps::square_mm2(double s_mm, MonotonicTime now) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Jump& jump : jumps_) {
    const double between_mm = jump.s_mm - jump.next_mm;
    if (std::abs(between_mm) < kMinBetween_mm) continue;
    const double share = std::clamp((s_mm - jump.next_mm) / between_mm, 0.0, kFarthest);
    const Eigen::Vector3d off_mm = share * kept(jump, now) * jump.off_mm;
    sum += kDisplaced * off_mm * off_mm.transpose();
  }
  return sum;
}

}  // namespace tubed
