#include "daemon/estimator/coils/common_jump.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kJumpMemory_s = 60;    // as of what else stays of coils' errors
constexpr double kFieldChanged = 0.5;   // probability that it was not the tube
constexpr double kJumpedBack = 0.5;     // of the newest jump, that is left of the sum
constexpr double kMaxInterval_s = 0.1;  // in longer ones a tube goes anywhere
constexpr std::size_t kMinCoils = 3;    // that say the same by chance less than once in a procedure
constexpr double kNoise = 6;            // standard deviations of a difference that are no jump
constexpr double kSame = 0.25;          // of the jump, that one coil's may differ from it
constexpr double kSameNoise = 3;        // the same in standard deviations of a coil's noise
constexpr double kSeesNoise = 4;   // standard deviations of noise that a coil sees of it, to bear it out, and
constexpr double kBearsOut = 0.5;  // of what it should see, that it may be off by
constexpr double kUnseenAlong = 0.02;  // of the information, so that a straight tube's length stays unmoved

/// Of one coil.
struct Seen {
  Eigen::Matrix3d P;         ///< onto what is across the tube
  Eigen::Vector3d moved_mm;  ///< across the tube, world
};

Eigen::Matrix3d across(const Eigen::Vector3d& tangent) {
  return Eigen::Matrix3d::Identity() - tangent * tangent.transpose();
}

}  // namespace

std::optional<Eigen::Vector3d> common_jump_mm(const CoilObservations& before, const CoilObservations& now,
                                              double noise_mm) {
  std::array<Seen, kMaxCoils> seen;
  std::size_t coils = 0;
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d n_mm = Eigen::Vector3d::Zero();
  for (int i = 0; i < std::min(before.count, now.count); ++i) {
    const CoilObservation& earlier = before.coils[static_cast<std::size_t>(i)];
    const CoilObservation& coil = now.coils[static_cast<std::size_t>(i)];
    if (!earlier.used() || !coil.used()) continue;
    const Eigen::Matrix3d P = across(earlier.tangent_world);
    seen[coils++] = {P, P * (coil.p_world_mm - earlier.p_world_mm)};
    N += P;
    n_mm += seen[coils - 1].moved_mm;
  }
  if (coils < kMinCoils) return {};
  N.diagonal().array() += kUnseenAlong * static_cast<double>(coils);
  const Eigen::Vector3d jump_mm = N.inverse() * n_mm;
  const double length_mm = jump_mm.norm();
  if (length_mm < std::max(CommonJump::kJump_mm, kNoise * noise_mm)) return {};
  const double same_mm = std::max(kSame * length_mm, kSameNoise * noise_mm);
  double rest_mm2 = 0;
  std::size_t witnesses = 0;
  for (const Seen& coil : std::span(seen).first(coils)) {
    const Eigen::Vector3d expected_mm = coil.P * jump_mm;
    const double off_mm = (coil.moved_mm - expected_mm).norm();
    rest_mm2 += off_mm * off_mm;
    const double seen_mm = expected_mm.norm();
    witnesses += seen_mm >= kSeesNoise * noise_mm && off_mm <= kBearsOut * seen_mm ? 1 : 0;
  }
  const bool all_say_so = std::sqrt(rest_mm2 / static_cast<double>(coils)) <= same_mm;
  return all_say_so && witnesses >= kMinCoils ? std::optional(jump_mm) : std::nullopt;
}

double CommonJump::left_mm(MonotonicTime now) const { return kept(now) * off_mm_.norm(); }

double CommonJump::kept(MonotonicTime now) const {
  return std::exp(-std::max(seconds_between(at_, now), 0.0) / kJumpMemory_s);
}

bool CommonJump::observe(const CoilObservations& before, const CoilObservations& now, double interval_s,
                         double noise_mm, MonotonicTime time) {
  if (interval_s > kMaxInterval_s) return false;
  const auto jump_mm = common_jump_mm(before, now, noise_mm);
  if (!jump_mm) return false;
  off_mm_ = kept(time) * off_mm_ + *jump_mm;
  at_ = time;
  const bool is_back = off_mm_.norm() < std::max(kJump_mm, kJumpedBack * jump_mm->norm());
  if (is_back) off_mm_.setZero();
  return true;
}

Eigen::Matrix3d CommonJump::square_mm2(MonotonicTime now) const {
  const Eigen::Vector3d off_mm = kept(now) * off_mm_;
  return kFieldChanged * (Eigen::Matrix3d(off_mm * off_mm.transpose()) +
                          squared(kSame) * off_mm.squaredNorm() * Eigen::Matrix3d::Identity());
}

}  // namespace tubed
