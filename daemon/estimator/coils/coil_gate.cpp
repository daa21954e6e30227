#include "daemon/estimator/coils/coil_gate.hpp"

#include <algorithm>

#include "daemon/estimator/coils/coil_distance.hpp"
#include "daemon/estimator/single_frame_solver.hpp"

namespace tubed {

namespace {

constexpr double kBeliefOfDoubted =
    0.1;                              // of a coil left out before, or named by the coils of one measurement
constexpr double kLostAfter_s = 0.5;  // when a few coils contradict and no image says which is right
constexpr double kLostThoughConfirmed_s = 5;
constexpr double kYoungFor_s = 0.5;  // after a beginning
constexpr double kAskedEvery_s = 0.5;
constexpr double kSteady = 16.3;     // chi^2 of the difference of two measurements, 3 dof: 0.001
constexpr int kMinCoilsToBegin = 2;  // better a doubtful one among them than no shape at all
constexpr int kClearedTimes = 3;     // that the coils of a measurement do not name it

}  // namespace

CoilGate::CoilGate(const EstimatorSettings& settings, int coil_count)
    : model_(settings.coil_faults),
      steady_mm2_(kSteady * 2 * settings.sigma_position_mm * settings.sigma_position_mm),
      coil_count_(coil_count),
      beliefs_(beliefs_at_first(settings.coil_faults)) {}

void CoilGate::reset() {
  beliefs_ = beliefs_at_first(model_);
  doubts_ = {};
  end_jumps_ = {};
}

void CoilGate::write_beliefs(CoilObservations& coils) const {
  const bool snapped = most_are_out();  // then the shape is what is wrong
  for (int i = 0; i < coils.count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    const Doubt& doubt = doubts_[index];
    const bool is_doubtful = doubt.alone_as_well || (doubt.is_out && !snapped);
    coils.coils[index].belief = is_doubtful ? kBeliefOfDoubted : 1 - model_.probability;
  }
}

bool CoilGate::most_are_out() const {
  const auto out =
      std::count_if(doubts_.begin(), doubts_.end(), [](const Doubt& doubt) { return doubt.is_out; });
  return 2 * out > static_cast<std::ptrdiff_t>(coil_count_);
}

bool CoilGate::is_young(MonotonicTime time) const { return seconds_between(began_, time) < kYoungFor_s; }

void CoilGate::judge(const CoilInnovations& innovations, CoilFaults& faults,
                     const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C, MonotonicTime time,
                     double interval_s, CoilObservations& coils) {
  for (int k = 0; k < innovations.count; ++k) {  // a coil that says nothing is no better for that
    double& belief = beliefs_[static_cast<std::size_t>(innovations.coil[static_cast<std::size_t>(k)])];
    belief = aged_belief(model_, belief, interval_s);
  }
  faults.weigh(innovations, beliefs_);
  int newly_out = 0;
  int newest_out = 0;
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    Doubt& doubt = doubts_[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      doubt.is_out = doubt.contradicts_itself = false;
      doubt.off_mm.reset();
      continue;
    }
    const bool was_out = doubt.is_out;
    judge_coil(i, off_coil_mm(coil, spline, C), time, coils);
    if (doubt.is_out && !was_out) {
      ++newly_out;
      newest_out = i;
    }
  }
  if (newly_out == 1 && !is_young(time)) {
    Doubt& doubt = doubts_[static_cast<std::size_t>(newest_out)];
    (is_end(newest_out) ? doubt.whipped : doubt.jumped) = jumped_alone(newest_out, innovations);
  }
}

void CoilGate::judge_coil(int coil, const Eigen::Vector3d& off_mm, MonotonicTime time,
                          CoilObservations& coils) {
  Doubt& doubt = doubts_[static_cast<std::size_t>(coil)];
  doubt.contradicts_itself = doubt.off_mm && (off_mm - *doubt.off_mm).squaredNorm() > steady_mm2_;
  // The shape without it is known badly enough there to agree with much, in depth above all.
  const bool stays_out = doubt.jumped && off_mm.norm() > EndJumps::kJump_mm;
  if (beliefs_[static_cast<std::size_t>(coil)] >= 0.5 && !doubt.contradicts_itself && !stays_out) {
    if (doubt.whipped) end_jumps_.believe(coils, coil, off_mm, time);
    doubt = Doubt{};
    return;
  }
  coils.coils[static_cast<std::size_t>(coil)].state = CoilState::kOutlier;
  doubt.off_mm = off_mm;
  doubt.since = doubt.is_out && !doubt.contradicts_itself ? doubt.since : time;
  doubt.is_out = true;
}

// From one measurement to the next and no other coil: between others the tube does not move so.
bool CoilGate::jumped_alone(int coil, const CoilInnovations& innovations) const {
  const Eigen::Vector3d& off_mm = *doubts_[static_cast<std::size_t>(coil)].off_mm;
  return off_mm.norm() > EndJumps::kJump_mm && innovations.others_are_calm(coil);
}

bool CoilGate::asks_alone(MonotonicTime measured, double interval_s) const {
  const double nearest_to_it_s = kAskedEvery_s - interval_s / 2;
  return !shape_is_disowned_ && (is_young(measured) || seconds_between(asked_, measured) >= nearest_to_it_s);
}

// A gated coil that they do not name is tolerated for 5 s after images last confirmed the shape, or after
// they have named it; but not for ever: images do not see depth. One that they no longer name may be right.
void CoilGate::take_answer(bool known, const CoilObservations& alone, MonotonicTime measured,
                           bool confirmed) {
  asked_ = measured;
  bool names_other = false;
  bool named_before = true;
  double longest_s = 0;
  for (int i = 0; i < alone.count; ++i) {
    Doubt& doubt = doubts_[static_cast<std::size_t>(i)];
    const CoilObservation& coil = alone.coils[static_cast<std::size_t>(i)];
    const bool named = known && (coil.state == CoilState::kOutlier || doubt.jumped);
    if (!doubt.is_out) {
      names_other = names_other || named;
      continue;
    }
    if (named) {
      doubt.alone_as_well = true;
      doubt.cleared_times = 0;
      doubt.since = measured;
    } else if (known && coil.used() && !doubt.contradicts_itself) {
      ++doubt.cleared_times;
      doubt.alone_as_well = doubt.alone_as_well && doubt.cleared_times < kClearedTimes;
    }
    named_before = named_before && doubt.alone_as_well;
    longest_s = std::max(longest_s, seconds_between(doubt.since, measured));
  }
  const double tolerated_s = confirmed || named_before ? kLostThoughConfirmed_s : kLostAfter_s;
  shape_is_disowned_ = names_other || longest_s >= tolerated_s;
}

bool CoilGate::is_witness(int coil) const {
  const Doubt& doubt = doubts_[static_cast<std::size_t>(coil)];
  return !doubt.alone_as_well && !doubt.contradicts_itself;
}

// After a beginning the covariance is large, so the gate accepts nearly anything: a coil that the beginning
// left out has to agree well, and so has one that it could not ask.
void CoilGate::begin(const CoilObservations& coils, MonotonicTime measured, MonotonicTime state_time) {
  began_ = measured;
  asked_ = measured;
  const bool asked = coils.used_count() >= SingleFrameSolver::kMinForMajority - 1;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    Doubt& doubt = doubts_[static_cast<std::size_t>(i)];
    double& belief = beliefs_[static_cast<std::size_t>(i)];
    if (coil.state == CoilState::kOutlier) {
      if (!doubt.contradicts_itself) {  // such a one was not asked
        doubt.alone_as_well = true;
        doubt.off_mm.reset();  // that was another shape
      }
      doubt.is_out = true;
      doubt.since = state_time;
      belief = std::min(belief, kBeliefOfDoubted);
    } else {
      const bool as_well = doubt.alone_as_well && !(coil.used() && asked);
      if (doubt.whipped && doubt.off_mm) end_jumps_.believe(coils, i, *doubt.off_mm, measured);
      doubt = Doubt{};
      doubt.alone_as_well = as_well;
      belief = as_well ? std::min(belief, kBeliefOfDoubted) : 1 - model_.probability;
    }
  }
}

void CoilGate::leave_out_gated(CoilObservations& coils) const {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used() && doubts_[static_cast<std::size_t>(i)].is_out) {
      coil.state = CoilState::kOutlier;
    }
  }
}

void CoilGate::leave_out_erratic(CoilObservations& coils) const {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    const Doubt& doubt = doubts_[static_cast<std::size_t>(i)];
    if (coil.used() && coils.used_count() > kMinCoilsToBegin && doubt.is_out &&
        (doubt.contradicts_itself || doubt.jumped) && !most_are_out()) {
      coil.state = CoilState::kOutlier;
    }
  }
}

void CoilGate::forget_contradictions() {
  for (Doubt& doubt : doubts_) {
    doubt.contradicts_itself = false;
  }
}

}  // namespace tubed
