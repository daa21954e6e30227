#include "drivers/aurora/pose_guard.hpp"

namespace tubed::aurora {

namespace {

constexpr std::chrono::milliseconds kForgetAfter{500};

bool has_pose(const CoilSample& coil) noexcept {
  return coil.p_em_mm.allFinite() && coil.tangent_em.allFinite();
}

}  // namespace

bool PoseGuard::believe(const EmFrame& frame) noexcept {
  const bool good = agrees(frame, believed_) || (in_doubt_ && agrees(frame, doubted_));
  in_doubt_ = !good;
  if (good) {
    remember(frame, believed_);
  } else {
    doubted_ = Coils{};
    remember(frame, doubted_);
  }
  return good;
}

bool PoseGuard::agrees(const EmFrame& frame, const Coils& with) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(frame.coil_count); ++i) {
    const CoilSample& coil = frame.coils[i];
    const Seen& seen = with[i];
    const auto since = frame.measured - seen.time;
    if (!has_pose(coil) || !seen.known || since > kForgetAfter) {
      continue;
    }
    const double reach_mm = kLeapMm + kSpeedMmPerSecond * std::chrono::duration<double>(since).count();
    if ((coil.p_em_mm - seen.p_em_mm).norm() > reach_mm ||
        coil.tangent_em.dot(seen.tangent_em) < kLeapCosine) {
      return false;
    }
  }
  return true;
}

void PoseGuard::remember(const EmFrame& frame, Coils& coils) noexcept {
  for (std::size_t i = 0; i < static_cast<std::size_t>(frame.coil_count); ++i) {
    if (has_pose(frame.coils[i])) {
      coils[i] = {true, frame.measured, frame.coils[i].p_em_mm, frame.coils[i].tangent_em};
    }
  }
}

}  // namespace tubed::aurora
