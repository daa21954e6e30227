#include "daemon/estimator/coils/coil_observation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tubed {

namespace {

CoilState state_of(const CoilSample& sample) {
  switch (sample.status) {
    case CoilStatus::kMissing:
      return CoilState::kMissing;
    case CoilStatus::kOutOfVolume:
      return CoilState::kOutOfVolume;
    case CoilStatus::kDisabled:
      return CoilState::kDisabled;
    case CoilStatus::kOk:
      break;
  }
  // OK without a finite pose or direction is a contradiction: nothing was measured.
  const double length = sample.tangent_em.norm();
  const bool usable = sample.p_em_mm.allFinite() && std::isfinite(length) && std::abs(length - 1) < 0.1;
  return usable ? CoilState::kUsed : CoilState::kMissing;
}

// A real coil always shows noise. Equal to the last bit over the whole window is a tracker that repeats
// itself. One that says nothing now and then is no better for that.
bool is_stuck(const EmFrame& frame, const EmHistory& history, std::size_t sensor, std::int64_t stuck_ns) {
  constexpr std::size_t kMinRepeats = 3;
  std::size_t repeats = 0;
  for (std::size_t steps = 1;; ++steps) {
    const EmFrame* earlier = history.before(&frame, steps);
    if (earlier == nullptr) return false;
    if (earlier->coils[sensor].status != CoilStatus::kOk) continue;
    if (earlier->coils[sensor].p_em_mm != frame.coils[sensor].p_em_mm ||
        earlier->coils[sensor].tangent_em != frame.coils[sensor].tangent_em) {
      return false;
    }
    if (++repeats >= kMinRepeats && to_ns(frame.measured) - to_ns(earlier->measured) >= stuck_ns) {
      return true;
    }
  }
}

}  // namespace

int CoilObservations::used_count() const {
  int used = 0;
  for (int i = 0; i < count; ++i) {
    used += coils[static_cast<std::size_t>(i)].used() ? 1 : 0;
  }
  return used;
}

double CoilObservations::first_used_mm() const {
  double first_mm = std::numeric_limits<double>::infinity();
  for (int i = 0; i < count; ++i) {
    const CoilObservation& coil = coils[static_cast<std::size_t>(i)];
    first_mm = coil.used() ? std::min(first_mm, coil.s_mm) : first_mm;
  }
  return std::isfinite(first_mm) ? first_mm : 0;
}

double CoilObservations::last_used_mm() const {
  double last_mm = 0;
  for (int i = 0; i < count; ++i) {
    const CoilObservation& coil = coils[static_cast<std::size_t>(i)];
    last_mm = coil.used() ? std::max(last_mm, coil.s_mm) : last_mm;
  }
  return last_mm;
}

bool CoilObservations::hold(double s_mm) const {
  return std::any_of(coils.begin(), coils.begin() + count, [s_mm](const CoilObservation& coil) {
    return coil.used() && std::abs(coil.s_mm - s_mm) <= kHolds_mm;
  });
}

bool CoilObservations::nearest_is_used(double place_mm) const {
  const auto nearest = std::min_element(coils.begin(), coils.begin() + count,
                                        [place_mm](const CoilObservation& a, const CoilObservation& b) {
                                          return std::abs(a.s_mm - place_mm) < std::abs(b.s_mm - place_mm);
                                        });
  return count > 0 && nearest->used();
}

CoilObservations observe_coils(const EmFrame* frame, const EmHistory& history,
                               const InstrumentDescription& instrument, const RigidTransform& T_world_em,
                               std::int64_t stuck_ns) {
  CoilObservations observations;
  const RigidTransform T_world_em_then = T_world_em * history.placement(frame).T_registered_em;
  for (const CoilPlacement& placement : instrument.coils) {
    CoilObservation& coil = observations.coils[static_cast<std::size_t>(observations.count++)];
    coil.s_mm = placement.offset_from_tip_mm;
    if (frame == nullptr || placement.sensor > frame->coil_count) {
      continue;
    }
    const auto sensor = static_cast<std::size_t>(placement.sensor - 1);
    const CoilSample& sample = frame->coils[sensor];
    coil.state = state_of(sample);
    if (!coil.used()) {
      continue;
    }
    coil.p_world_mm = T_world_em_then * sample.p_em_mm;
    coil.tangent_world =
        T_world_em_then.linear() * sample.tangent_em.normalized() * (placement.flipped ? -1.0 : 1.0);
    if (is_stuck(*frame, history, sensor, stuck_ns)) {
      coil.state = CoilState::kStuck;
    }
  }
  return observations;
}

}  // namespace tubed
