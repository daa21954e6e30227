#include "daemon/estimator/coils/loose_ends.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kRadius_mm = 80;  // R, one standard deviation: aortic arches have 30 to 50
constexpr double kStiff_mm = 10;   // so far the covariance of the shape is enough
constexpr double kDrift_mm_s = 3;  // of an end that nobody sees
constexpr double kAcross_mm = 1;   // where an image shows the tube
constexpr double kLoose_mm = 5;    // an end that coils leave less open is not asked whether images show it
constexpr double kLostFor_s = 10;  // of a camera that brings no further image

double moved_mm(MonotonicTime since, MonotonicTime now) {
  return kDrift_mm_s * std::max(seconds_between(since, now), 0.0);
}

}  // namespace

double LooseEnds::bends_away_mm(double distance_mm) {
  const double bent_mm = std::max(distance_mm - kStiff_mm, 0.0);
  return std::min(squared(bent_mm) / (2 * kRadius_mm), bent_mm);
}

void LooseEnds::observe(const CoilObservations& coils, MonotonicTime time) {
  count_ = coils.count;
  first_mm_ = coils.first_used_mm();
  last_mm_ = coils.used_count() > 0 ? coils.last_used_mm() : -1;
  for (std::size_t i = 0; i < static_cast<std::size_t>(coils.count); ++i) {
    const CoilObservation& coil = coils.coils[i];
    if (coil.used()) heard_[i] = {coil.s_mm, time};
  }
}

void LooseEnds::observe(std::span<const ViewConstraints> views, MonotonicTime instant) {
  if (last_mm_ < first_mm_) return;
  for (const ViewConstraints& view : views) {
    const auto place = std::ranges::find_if(
        seen_, [&](const Seen& seen) { return seen.camera == view.camera || seen.camera == nullptr; });
    if (view.seen == nullptr || place == seen_.end()) continue;
    const auto is_lost = [&](const SeenTube::Followed& end) {
      return end.lost_to_mm != end.to_mm && by_coils_mm(end.lost_to_mm, instant) > kLoose_mm;
    };
    const SeenTube::Followed tip = view.seen->followed(first_mm_, SeenTube::Toward::kTip);
    const SeenTube::Followed tail = view.seen->followed(last_mm_, SeenTube::Toward::kTail);
    *place = {view.camera, tip.to_mm, tail.to_mm, {is_lost(tip), is_lost(tail)}, instant};
  }
}

LooseEnds::Lost LooseEnds::lost(MonotonicTime now) const {
  Lost lost;
  for (const Seen& seen : seen_) {
    if (seen.camera == nullptr || std::abs(seconds_between(seen.at, now)) > kLostFor_s) continue;
    lost.tip = lost.tip || seen.lost.tip;
    lost.tail = lost.tail || seen.lost.tail;
  }
  return lost;
}

// For either end: coils further out than the place hold it by themselves, those further in by the tube's
// stiffness as well.
double LooseEnds::by_coils_mm(double s_mm, MonotonicTime now) const {
  double of_tip_mm = std::numeric_limits<double>::infinity();
  double of_tail_mm = of_tip_mm;
  for (const Heard& coil : std::span(heard_).first(static_cast<std::size_t>(count_))) {
    if (to_ns(coil.at) == 0) continue;
    const double moved = moved_mm(coil.at, now);
    of_tip_mm = std::min(of_tip_mm, moved + bends_away_mm(coil.s_mm - s_mm));
    of_tail_mm = std::min(of_tail_mm, moved + bends_away_mm(s_mm - coil.s_mm));
  }
  const double mm = std::max(of_tip_mm, of_tail_mm);
  return std::isfinite(mm) ? mm : 0;
}

// K: what images know of it across their rays.
Eigen::Matrix3d LooseEnds::square_mm2(double s_mm, const Eigen::Vector3d& p_world_mm,
                                      MonotonicTime now) const {
  const double by_coils_mm2 = squared(by_coils_mm(s_mm, now));
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  if (by_coils_mm2 <= 0) return K;
  for (const Seen& seen : seen_) {
    if (seen.camera == nullptr) continue;
    const RigidTransform& T_camera_world = seen.camera->calibration().T_camera_world;
    const Eigen::Vector3d ray =
        T_camera_world.linear().transpose() * (T_camera_world * p_world_mm).normalized();
    const double beyond_mm = std::max({seen.from_mm - s_mm, s_mm - seen.to_mm, 0.0});
    const double sigma_mm = kAcross_mm + bends_away_mm(beyond_mm) + moved_mm(seen.at, now);
    K += (Eigen::Matrix3d::Identity() - ray * ray.transpose()) / squared(sigma_mm);
  }
  return by_coils_mm2 * (Eigen::Matrix3d::Identity() + by_coils_mm2 * K).inverse();
}

}  // namespace tubed
