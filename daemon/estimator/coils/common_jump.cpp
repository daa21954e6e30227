#include "daemon/estimator/coils/common_jump.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kJumpMemory_s = 60;    // as of what else stays of coils' errors
constexpr double kFieldChanged = 0.5;   // probability that it was not the tube
constexpr double kJumpedBack = 0.5;     // of the newest jump, that is left of the sum
constexpr double kMaxInterval_s = 0.1;  // in longer ones a tube goes anywhere
constexpr int kMinCoils = 3;            // that say the same by chance less than once in a procedure
constexpr double kNoise = 6;            // standard deviations of a difference that are no jump
constexpr double kSame = 0.25;          // of the jump, that one coil's may differ from it
constexpr double kSameNoise = 3;        // the same in standard deviations of a coil's noise
constexpr double kUnseenAlong = 0.02;   // of the information, so that a straight tube's length stays unmoved

Eigen::Matrix3d across(const Eigen::Vector3d& tangent) {
  return Eigen::Matrix3d::Identity() - tangent * tangent.transpose();
}

}  // namespace

std::optional<Eigen::Vector3d> common_jump_mm(const CoilObservations& before, const CoilObservations& now,
                                              double noise_mm) {
  std::array<Eigen::Vector3d, kMaxCoils> moved_mm;
  std::array<Eigen::Matrix3d, kMaxCoils> P;
  int coils = 0;
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d n_mm = Eigen::Vector3d::Zero();
  for (int i = 0; i < std::min(before.count, now.count); ++i) {
    const auto index = static_cast<std::size_t>(i);
    const CoilObservation& earlier = before.coils[index];
    const CoilObservation& coil = now.coils[index];
    if (!earlier.used() || !coil.used()) continue;
    const auto k = static_cast<std::size_t>(coils++);
    P[k] = across(earlier.tangent_world);
    moved_mm[k] = P[k] * (coil.p_world_mm - earlier.p_world_mm);
    N += P[k];
    n_mm += moved_mm[k];
  }
  if (coils < kMinCoils) return {};
  N.diagonal().array() += kUnseenAlong * coils;
  const Eigen::Vector3d jump_mm = N.inverse() * n_mm;
  const double length_mm = jump_mm.norm();
  if (length_mm < std::max(CommonJump::kJump_mm, kNoise * noise_mm)) return {};
  double rest_mm2 = 0;
  for (int i = 0; i < coils; ++i) {
    const auto k = static_cast<std::size_t>(i);
    rest_mm2 += (moved_mm[k] - P[k] * jump_mm).squaredNorm();
  }
  const double rest_mm = std::sqrt(rest_mm2 / coils);
  if (rest_mm > std::max(kSame * length_mm, kSameNoise * noise_mm)) return {};
  return jump_mm;
}

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
