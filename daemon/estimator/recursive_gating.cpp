// Which coils the recursive estimator believes.
#include <algorithm>
#include <cmath>

#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

constexpr double kMaxSurprise = 25;  // chi^2 of a coil, 3 dof: more says that it is wrong (1.5e-5)
// A jerk of the tube: coils further off the prediction than they usually are, by so much and more. In between
// freedom grows evenly: a rounded digit must not decide.
constexpr double kJerkFrom = 1.4;
constexpr double kCertainJerk = 1.6;
constexpr double kFreedomOfAJerk = 20;
constexpr int kMinMeasurements = 10;  // until it is known what is usual
constexpr int kMaxMeasurements = 60;  // that the mean goes back
constexpr double kLostAfter_s = 0.5;  // when a few coils contradict and no image says who is right
constexpr double kLostThoughConfirmed_s = 5;
constexpr double kYoungFor_s = 0.5;  // after a beginning
constexpr double kAskedEvery_s = 0.5;
constexpr double kConfirmedFor_s = 0.5;
constexpr double kSteady = 16.3;     // chi^2 of the difference of two measurements, 3 dof: 0.001
constexpr double kCalm = 11.3;       // chi^2 of a coil, 3 dof: 0.01
constexpr double kJump_mm = 6;       // of one coil, from one measurement to the next
constexpr int kMinCoilsToBegin = 2;  // coils: better a doubtful one among them than no shape at all
constexpr int kClearedTimes = 3;     // that the coils of a measurement do not name it

}  // namespace

// A point of the curve; the fifth column is the caller's.
RecursiveEstimator::ColumnSum::ColumnSum(const CubicBasis& basis) {
  for (std::size_t k = 0; k < basis.value.size(); ++k) {
    column[k] = basis.first + static_cast<Eigen::Index>(k);
    weight[k] = basis.value[k];
  }
}

Eigen::Matrix3d RecursiveEstimator::covariance_of(const ColumnSum& a, const ColumnSum& b) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.column.size(); ++i) {
    for (std::size_t j = 0; j < b.column.size(); ++j) {
      sum += a.weight[i] * b.weight[j] * state_.P.block<3, 3>(3 * a.column[i], 3 * b.column[j]);
    }
  }
  return sum;
}

// How far each coil is off the prediction, and the covariance of all that, of which a motion otherwise than
// expected makes much in common.
void RecursiveEstimator::measure_innovations(const CoilObservations& coils) {
  CoilInnovations& all = innovations_;
  all.count = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      continue;
    }
    const auto place = [&](int index) {
      const double s_mm = coils.coils[static_cast<std::size_t>(index)].s_mm;
      ColumnSum sum(map_.spline().basis(s_mm));
      sum.column.back() = map_.position_error_column(index);
      sum.weight.back() = 1;
      return sum;
    };
    const ColumnSum own = place(i);
    const Eigen::Index row = 3 * all.count;
    all.coil[static_cast<std::size_t>(all.count)] = i;
    const CubicBasis basis = map_.spline().basis(coil.s_mm);
    all.innovation_mm.segment<3>(row) = coil.p_world_mm - combine(state_.C, basis.first, basis.value) -
                                        state_.C.col(map_.position_error_column(i));
    for (int k = 0; k < all.count; ++k) {
      const Eigen::Matrix3d shared = covariance_of(own, place(all.coil[static_cast<std::size_t>(k)]));
      all.covariance_mm2.block<3, 3>(row, 3 * k) = shared;
      all.covariance_mm2.block<3, 3>(3 * k, row) = shared.transpose();
    }
    const double noise_mm = state_.noise.noise_position_mm();
    all.covariance_mm2.block<3, 3>(row, row) = covariance_of(own, own);
    all.covariance_mm2.block<3, 3>(row, row).diagonal().array() += noise_mm * noise_mm;
    ++all.count;
  }
}

// A coil that is less likely right than wrong takes no part, and comes back when it says the same twice: what
// contradicts itself may be near the prediction by chance. Gives how far the others are off on the whole.
double RecursiveEstimator::judge_coils(CoilObservations& coils, MonotonicTime time, double interval_s) {
  measure_innovations(coils);
  for (int k = 0; k < innovations_.count; ++k) {  // what says nothing is no better for that
    double& belief = state_.beliefs[static_cast<std::size_t>(innovations_.coil[static_cast<std::size_t>(k)])];
    belief = aged_belief(settings_.coil_faults, belief, interval_s);
  }
  coil_faults_.weigh(innovations_, state_.beliefs);
  int newly_out = 0;
  int newest_out = 0;
  const double steady_mm2 = kSteady * 2 * settings_.sigma_position_mm * settings_.sigma_position_mm;
  for (int i = 0; i < coils.count; ++i) {
    const auto index = static_cast<std::size_t>(i);
    CoilObservation& coil = coils.coils[index];
    DoubtedCoil& doubted = state_.doubted[index];
    if (!coil.used()) {
      doubted.is_out = doubted.contradicts_itself = false;
      doubted.off_mm.reset();
      continue;
    }
    const Eigen::Vector3d off_mm = off_coil_mm(coil, state_.C);
    const bool was_out = doubted.is_out;
    doubted.contradicts_itself = doubted.off_mm && (off_mm - *doubted.off_mm).squaredNorm() > steady_mm2;
    // The shape without it is known badly enough there to agree with much, in depth above all.
    const bool stays_out = doubted.jumped && off_mm.norm() > kJump_mm;
    if (state_.beliefs[index] >= 0.5 && !doubted.contradicts_itself && !stays_out) {
      doubted = DoubtedCoil{};
      continue;
    }
    coil.state = CoilState::kOutlier;
    doubted.off_mm = off_mm;
    doubted.since = doubted.is_out && !doubted.contradicts_itself ? doubted.since : time;
    doubted.is_out = true;
    newly_out += was_out ? 0 : 1;
    newest_out = was_out ? newest_out : i;
  }
  if (newly_out == 1 && seconds_between(state_.began, time) >= kYoungFor_s) {
    DoubtedCoil& newest = state_.doubted[static_cast<std::size_t>(newest_out)];
    newest.jumped = jumped_alone(newest_out, *newest.off_mm);
  }
  return surprise();
}

// From one measurement to the next and no other coil: the tube does not move so. But its ends may whip.
bool RecursiveEstimator::jumped_alone(int coil, const Eigen::Vector3d& off_mm) const {
  const bool is_between = coil > 0 && coil + 1 < static_cast<int>(instrument_.coils.size());
  return is_between && off_mm.norm() > kJump_mm && others_are_calm(coil);
}

bool RecursiveEstimator::others_are_calm(int coil) const {
  for (int k = 0; k < innovations_.count; ++k) {
    const Eigen::Vector3d innovation = innovations_.innovation_mm.segment<3>(3 * k);
    const Eigen::Matrix3d covariance_mm2 = innovations_.covariance_mm2.block<3, 3>(3 * k, 3 * k);
    const bool is_other = innovations_.coil[static_cast<std::size_t>(k)] != coil;
    if (is_other && innovation.dot(covariance_mm2.inverse() * innovation) > kCalm) return false;
  }
  return true;
}

// Mean chi^2 a degree of freedom, without the coil that is furthest off, which may be wrong by itself. 0: too
// few to say.
double RecursiveEstimator::surprise() const {
  double sum = 0;
  double greatest = 0;
  for (int k = 0; k < innovations_.count; ++k) {
    const Eigen::Vector3d innovation = innovations_.innovation_mm.segment<3>(3 * k);
    const Eigen::Matrix3d covariance_mm2 = innovations_.covariance_mm2.block<3, 3>(3 * k, 3 * k);
    const double capped = std::min(innovation.dot(covariance_mm2.inverse() * innovation), kMaxSurprise);
    sum += capped;
    greatest = std::max(greatest, capped);
  }
  return innovations_.count > 2 ? (sum - greatest) / (3 * (innovations_.count - 1)) : 0;
}

// Of the sideways motion that the measurement with this surprise needs. How surprising a measurement usually
// is depends on the tracker and on the motion, so that only a mean of earlier ones is a measure.
double RecursiveEstimator::freedom_for(double surprise) {
  if (!(surprise > 0)) {  // too few coils, or no number
    return state_.freedom;
  }
  UsualSurprise& usual = state_.usual;
  const double times = usual.count < kMinMeasurements ? 1 : surprise / usual.mean;
  usual.count = std::min(usual.count + 1, kMaxMeasurements);
  usual.mean *= std::pow(std::min(surprise / usual.mean, kCertainJerk), 1.0 / usual.count);
  const double jerk = std::clamp((times - kJerkFrom) / (kCertainJerk - kJerkFrom), 0.0, 1.0);
  return std::max(state_.freedom, kFreedomOfAJerk * jerk);
}

bool RecursiveEstimator::most_are_out() const {
  const auto out = std::count_if(state_.doubted.begin(), state_.doubted.end(),
                                 [](const DoubtedCoil& coil) { return coil.is_out; });
  return 2 * out > static_cast<std::ptrdiff_t>(instrument_.coils.size());
}

// Who is wrong, a coil or the shape? The coils of a measurement alone, led by nothing older, may name one:
// asked often while a beginning may have taken in what its own measurement did not show, now and then later.
// A contradicting coil that they do not name is borne for a long while after images have shown the tube where
// it is expected, or after they have named it; but not for ever: images do not see depth. Whom they no longer
// name may be right.
void RecursiveEstimator::ask_alone(const EmFrame& frame, const EmHistory& history, double interval_s) {
  const bool is_young = seconds_between(state_.began, frame.measured) < kYoungFor_s;
  const double nearest_to_it_s = kAskedEvery_s - interval_s / 2;
  if (state_.disowned || (!is_young && seconds_between(state_.asked, frame.measured) < nearest_to_it_s)) {
    return;
  }
  state_.asked = frame.measured;
  CoilObservations alone = observe(&frame, history);
  const bool known = start_.solve_em(alone, *second_opinion_);
  bool names_other = false;
  bool named_before = true;
  double longest_s = 0;
  for (int i = 0; i < alone.count; ++i) {
    DoubtedCoil& doubted = state_.doubted[static_cast<std::size_t>(i)];
    const CoilObservation& coil = alone.coils[static_cast<std::size_t>(i)];
    const bool named = known && (coil.state == CoilState::kOutlier || doubted.jumped);
    if (!doubted.is_out) {
      names_other = names_other || named;
      continue;
    }
    if (named) {
      doubted.alone_as_well = true;
      doubted.cleared_times = 0;
      doubted.since = frame.measured;
    } else if (known && coil.used() && !doubted.contradicts_itself) {
      ++doubted.cleared_times;
      doubted.alone_as_well = doubted.alone_as_well && doubted.cleared_times < kClearedTimes;
    }
    named_before = named_before && doubted.alone_as_well;
    longest_s = std::max(longest_s, seconds_between(doubted.since, frame.measured));
  }
  const bool confirmed =
      to_ns(state_.confirmed) != 0 && seconds_between(state_.confirmed, frame.measured) < kConfirmedFor_s;
  const double borne_s = confirmed || named_before ? kLostThoughConfirmed_s : kLostAfter_s;
  state_.disowned = names_other || longest_s >= borne_s;
}

// A beginning knows little, and nearly everything agrees with it: a coil that it left out has to agree well,
// and so has one that it could not ask.
void RecursiveEstimator::leave_out_as_found(const CoilObservations& coils) {
  const bool asked = coils.used_count() >= SingleFrameSolver::kMinForMajority - 1;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    DoubtedCoil& doubted = state_.doubted[static_cast<std::size_t>(i)];
    double& belief = state_.beliefs[static_cast<std::size_t>(i)];
    if (coil.state == CoilState::kOutlier) {
      if (!doubted.contradicts_itself) {  // such a one was not asked
        doubted.alone_as_well = true;
        doubted.off_mm.reset();  // that was another shape
      }
      doubted.is_out = true;
      doubted.since = state_.time;
      belief = std::min(belief, kBeliefOfDoubted);
    } else {
      const bool as_well = doubted.alone_as_well && !(coil.used() && asked);
      doubted = DoubtedCoil{};
      doubted.alone_as_well = as_well;
      belief = as_well ? std::min(belief, kBeliefOfDoubted) : 1 - settings_.coil_faults.probability;
    }
  }
}

void RecursiveEstimator::leave_out_doubted(CoilObservations& coils) const {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used() && state_.begun && state_.doubted[static_cast<std::size_t>(i)].is_out) {
      coil.state = CoilState::kOutlier;
    }
  }
}

// Nothing is begun with what contradicts itself, as long as there are others.
void RecursiveEstimator::leave_out_erratic(CoilObservations& coils) const {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    const DoubtedCoil& doubted = state_.doubted[static_cast<std::size_t>(i)];
    if (coil.used() && coils.used_count() > kMinCoilsToBegin && doubted.is_out &&
        (doubted.contradicts_itself || doubted.jumped) && !most_are_out()) {
      coil.state = CoilState::kOutlier;
    }
  }
}

}  // namespace tubed
