// Which coils the recursive estimator believes.
#include <algorithm>
#include <cmath>

#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

constexpr double kGate = 25;  // chi^2 of a coil's position, 3 dof: 1.5e-5
// To be believed again, a coil has to agree as most do (0.03 do not) if the coils of a measurement alone
// contradict it as well, or if it was left out more often than a snap is.
constexpr double kAgrees = 9;
constexpr int kOftenerThanASnap = 3;
// A jerk of the tube: coils further off the prediction than they usually are, by so much and more. In between
// freedom grows evenly: a rounded digit must not decide.
constexpr double kJerkFrom = 1.4;
constexpr double kCertainJerk = 1.6;
constexpr double kFreedomOfAJerk = 20;
constexpr int kFewestMeasurements = 10;  // until it is known what is usual
constexpr int kMostMeasurements = 60;    // that the mean goes back
constexpr double kLostAfter_s = 0.5;     // when a few coils contradict and no image says who is right
constexpr double kLostThoughConfirmed_s = 5;
constexpr double kYoungFor_s = 0.5;  // after a beginning
constexpr double kAskedEvery_s = 0.5;
constexpr double kConfirmedFor_s = 0.5;
// A coil that contradicts itself from one measurement to the next: chi^2 of the difference, 3 dof, 0.001.
constexpr double kErratic = 16.3;
constexpr double kErraticFor_s = 0.3;
constexpr int kFewestToBegin = 2;  // coils: better an erratic one among them than no shape at all
constexpr int kClearedTimes = 3;   // that the coils of a measurement do not name it

}  // namespace

Eigen::Matrix3d RecursiveEstimator::innovation_covariance(const CoilObservation& coil, int index) const {
  const CubicBasis basis = map_.spline().basis(coil.s_mm);
  std::array<Eigen::Index, 5> columns{};
  std::array<double, 5> weights{};
  for (std::size_t a = 0; a < 4; ++a) {
    columns[a] = basis.first + static_cast<Eigen::Index>(a);
    weights[a] = basis.value[a];
  }
  columns[4] = map_.position_error_column(index);
  weights[4] = 1;
  const double noise_mm = state_.noise.noise_position_mm();
  return noise_mm * noise_mm * Eigen::Matrix3d::Identity() + covariance_of(columns, weights);
}

// Of the sum of weights[k] times that column.
Eigen::Matrix3d RecursiveEstimator::covariance_of(std::span<const Eigen::Index> columns,
                                                  std::span<const double> weights) const {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t a = 0; a < columns.size(); ++a) {
    for (std::size_t b = 0; b < columns.size(); ++b) {
      sum += weights[a] * weights[b] * state_.P.block<3, 3>(3 * columns[a], 3 * columns[b]);
    }
  }
  return sum;
}

// A coil whose position the prediction cannot explain takes no part, for a while. Gives how far the others
// are off on the whole: mean chi^2 a degree of freedom, without the coil that is furthest off, which may be
// wrong by itself. 0: too few to say.
double RecursiveEstimator::gate(CoilObservations& coils, MonotonicTime time) {
  double sum = 0;
  double greatest = 0;
  int count = 0;
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    GatedCoil& gated = state_.gated[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      gated.times = 0;  // says nothing, but is no better for that
      gated.off_mm.reset();
      continue;
    }
    const CubicBasis basis = map_.spline().basis(coil.s_mm);
    const Eigen::Vector3d innovation = coil.p_world_mm - combine(state_.C, basis.first, basis.value) -
                                       state_.C.col(map_.position_error_column(i));
    const Eigen::Matrix3d covariance_mm2 = innovation_covariance(coil, i);
    const double chi_squared = innovation.dot(covariance_mm2.inverse() * innovation);
    const double capped = std::min(chi_squared, kGate);
    sum += capped;
    greatest = std::max(greatest, capped);
    ++count;
    const double off_itself_mm2 = gated.off_mm ? (innovation - *gated.off_mm).squaredNorm() : 0;
    if (chi_squared <= gate_of(gated, off_itself_mm2, covariance_mm2)) {
      gated = GatedCoil{};
      continue;
    }
    coil.state = CoilState::kOutlier;
    if (contradicts_itself(off_itself_mm2)) {
      gated.erratic = time;
    }
    gated.since = gated.times == 0 || gated.erratic == time ? time : gated.since;
    gated.off_mm = innovation;
    ++gated.times;
  }
  return count > 2 ? (sum - greatest) / (3 * (count - 1)) : 0;
}

// chi^2 up to which a coil is believed. One that contradicts itself may be near the prediction by chance
// where little is known: that it is right, N(0, s^2) on an axis, has to be likelier than that it is off by as
// much as it contradicts itself, N(0, s^2 + w): chi^2 < 3 ln(1 + w / s^2) (1 + s^2 / w).
double RecursiveEstimator::gate_of(const GatedCoil& gated, double off_itself_mm2,
                                   const Eigen::Matrix3d& covariance_mm2) const {
  const double gate = gated.alone_as_well || gated.times >= kOftenerThanASnap ? kAgrees : kGate;
  if (!is_erratic(gated) || !contradicts_itself(off_itself_mm2)) {
    return gate;
  }
  // The difference of two errors: six times the variance of one on an axis.
  const double w_by_s2 = off_itself_mm2 / (6 * std::cbrt(covariance_mm2.determinant()));
  return std::min(gate, 3 * std::log1p(w_by_s2) * (1 + 1 / w_by_s2));
}

bool RecursiveEstimator::contradicts_itself(double off_itself_mm2) const {
  return off_itself_mm2 > kErratic * 2 * settings_.sigma_position_mm * settings_.sigma_position_mm;
}

// Such a coil says nothing about the tube. A tube that snaps and goes on snapping takes most coils along.
bool RecursiveEstimator::is_erratic(const GatedCoil& gated) const {
  return gated.times > 0 && to_ns(gated.erratic) != 0 && !most_are_gated() &&
         seconds_between(gated.erratic, state_.newest_em) < kErraticFor_s;
}

// Of the sideways motion that the measurement with this surprise needs. How surprising a measurement usually
// is depends on the tracker and on the motion, so that only a mean of earlier ones is a measure.
double RecursiveEstimator::freedom_for(double surprise) {
  if (!(surprise > 0)) {  // too few coils, or no number
    return state_.freedom;
  }
  UsualSurprise& usual = state_.usual;
  const double times = usual.count < kFewestMeasurements ? 1 : surprise / usual.mean;
  usual.count = std::min(usual.count + 1, kMostMeasurements);
  usual.mean *= std::pow(std::min(surprise / usual.mean, kCertainJerk), 1.0 / usual.count);
  const double jerk = std::clamp((times - kJerkFrom) / (kCertainJerk - kJerkFrom), 0.0, 1.0);
  return std::max(state_.freedom, kFreedomOfAJerk * jerk);
}

bool RecursiveEstimator::most_are_gated() const {
  const auto gated = std::count_if(state_.gated.begin(), state_.gated.end(),
                                   [](const GatedCoil& coil) { return coil.times > 0; });
  return 2 * gated > static_cast<std::ptrdiff_t>(instrument_.coils.size());
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
    GatedCoil& gated = state_.gated[static_cast<std::size_t>(i)];
    const CoilObservation& coil = alone.coils[static_cast<std::size_t>(i)];
    const bool named = known && coil.state == CoilState::kOutlier;
    if (gated.times == 0) {
      names_other = names_other || named;
      continue;
    }
    if (named) {
      gated.alone_as_well = true;
      gated.cleared_times = 0;
      gated.since = frame.measured;
    } else if (known && coil.used() && !is_erratic(gated)) {
      ++gated.cleared_times;
      gated.alone_as_well = gated.alone_as_well && gated.cleared_times < kClearedTimes;
    }
    named_before = named_before && gated.alone_as_well;
    longest_s = std::max(longest_s, seconds_between(gated.since, frame.measured));
  }
  const bool confirmed =
      to_ns(state_.confirmed) != 0 && seconds_between(state_.confirmed, frame.measured) < kConfirmedFor_s;
  const double borne_s = confirmed || named_before ? kLostThoughConfirmed_s : kLostAfter_s;
  state_.disowned = names_other || longest_s >= borne_s;
}

// A beginning knows little, and nearly everything agrees with it: a coil that it left out has to agree well,
// and so has one that it could not ask.
void RecursiveEstimator::leave_out_as_found(const CoilObservations& coils) {
  const bool asked = coils.used_count() >= SingleFrameSolver::kFewestForMajority - 1;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    GatedCoil& gated = state_.gated[static_cast<std::size_t>(i)];
    if (coil.state == CoilState::kOutlier) {
      if (!is_erratic(gated)) {
        gated.alone_as_well = true;
        gated.off_mm.reset();  // that was another shape
      }
      gated.times = 1;
      gated.since = state_.time;
    } else {
      const bool as_well = gated.alone_as_well && !(coil.used() && asked);
      gated = GatedCoil{};
      gated.alone_as_well = as_well;
    }
  }
}

void RecursiveEstimator::leave_out_gated(CoilObservations& coils) const {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used() && state_.begun && state_.gated[static_cast<std::size_t>(i)].times > 0) {
      coil.state = CoilState::kOutlier;
    }
  }
}

// Nothing is begun with what contradicts itself, as long as there are others.
void RecursiveEstimator::leave_out_erratic(CoilObservations& coils) const {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used() && coils.used_count() > kFewestToBegin &&
        is_erratic(state_.gated[static_cast<std::size_t>(i)])) {
      coil.state = CoilState::kOutlier;
    }
  }
}

}  // namespace tubed
