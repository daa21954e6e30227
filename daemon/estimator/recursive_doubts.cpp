// What the recursive estimator does not believe: an image, itself.
#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "daemon/estimator/recursive_estimator.hpp"

namespace tubed {

namespace {

constexpr double kOutOfTheQuestion = 25;  // chi^2 a coil: no shape has to be asked for
constexpr int kLostImages = 3;
// The instant alone knows better: coils that are further off than their whole error allows (chi^2 a coil, 3
// dof), and half as far off a shape of this instant that the image shows as well, at two EM measurements in a
// row.
constexpr double kDoubtedFrom = 7;
constexpr double kBetterAlone = 0.5;
constexpr double kSeenAsWell = 0.9;
constexpr int kDoubtedTimes = 2;
// A snap: coils off the shape in the mean (chi^2 a coil, 3 dof), at least one of them for certain, and a
// third as far off a shape of this instant. One coil may be wrong by itself: it has to say more, and so in
// two measurements, steadily.
constexpr double kSnappedFrom = 4;
constexpr double kSnappedFromByOne = 5;
constexpr double kContradictingFrom = 7;
constexpr double kFarBetterAlone = 0.33;
// Caught beside the tube. In frames that were not, both shapes were within 2 px, in those that were, 7 to 14
// apart.
constexpr double kSeenWell = 0.85;  // share of lines that agree: nobody else is asked
constexpr double kSeenBetter = 0.03;
constexpr double kElsewhere_px = 5;
constexpr double kElsewhereEach_mm = 2;
constexpr int kMinElsewhere = 3;  // of such places

}  // namespace

// An estimate that images or coils speak against may have to be begun again somewhere else.
ImageNeed RecursiveEstimator::image_need() const noexcept {
  const bool trusted = state_.begun && state_.images_without_tube == 0 && state_.doubted_times == 0 &&
                       images_ != ImageVerdict::kLost;
  return {trusted ? ImageNeed::Kind::kAroundTube : ImageNeed::Kind::kWhole, kFirstReach_px,
          TubeViews::kBeyondTip_px};
}

double RecursiveEstimator::distance_from_coils(const CoilObservations& coils,
                                               const Eigen::Matrix3Xd& C) const {
  double chi_squared = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (coil.used()) {
      chi_squared += off_coil_mm(coil, C).squaredNorm();
    }
  }
  return chi_squared / (settings_.sigma_position_mm * settings_.sigma_position_mm);
}

// Without the error of the coil that stays.
Eigen::Vector3d RecursiveEstimator::off_coil_mm(const CoilObservation& coil,
                                                const Eigen::Matrix3Xd& C) const {
  const CubicBasis basis = map_.spline().basis(coil.s_mm);
  return coil.p_world_mm - combine(C, basis.first, basis.value);
}

// How many coils, left out or not, say that the tube has snapped to where a shape of this instant alone has
// it. Nothing of it is in the image when it has snapped along the rays.
int RecursiveEstimator::coils_of_a_snap(const Observation& observation, const CoilObservations& coils,
                                        const TubeEstimate& estimate) {
  CoilObservations all = coils;
  double distance = 0;
  int contradicting = 0;
  for (int i = 0; i < all.count; ++i) {
    CoilObservation& coil = all.coils[static_cast<std::size_t>(i)];
    const DoubtedCoil& doubted = state_.doubted[static_cast<std::size_t>(i)];
    if (coil.state == CoilState::kOutlier && !doubted.alone_as_well && !doubted.contradicts_itself) {
      coil.state = CoilState::kUsed;
    }
    if (coil.used()) {
      const double chi_squared =
          (off_coil_mm(coil, state_.C) - state_.C.col(map_.position_error_column(i))).squaredNorm() /
          (settings_.sigma_position_mm * settings_.sigma_position_mm);
      distance += chi_squared;
      contradicting += chi_squared > kContradictingFrom ? 1 : 0;
    }
  }
  const double enough = contradicting > 1 ? kSnappedFrom : kSnappedFromByOne;
  const bool snapped = contradicting > 0 && distance > enough * all.used_count() &&
                       better_alone(observation, all, kFarBetterAlone * distance, estimate);
  return snapped ? contradicting : 0;
}

// Is a shape of this instant alone, which begins at the coils and is led by nothing older, nearer to them
// than `distance`, and seen as well?
bool RecursiveEstimator::better_alone(const Observation& observation, const CoilObservations& coils,
                                      double distance, const TubeEstimate& estimate) {
  CoilObservations alone = coils;
  TubeEstimate& second = *second_opinion_;
  second_look_.forget_lines();  // of older instants
  return start_.solve_em(alone, second) &&
         start_.fuse_images(observation, alone, second_look_, ShortPiece::kLost, second) ==
             ImageVerdict::kShowsTube &&
         second.image_inlier_ratio >= static_cast<float>(kSeenAsWell) * estimate.image_inlier_ratio &&
         distance_from_coils(coils, start_.C()) < distance;
}

// An image may have caught a stretch of the shape beside the tube, further off than the lines reach: where a
// shape of this instant alone is elsewhere in the image, more of its lines agree. Each view by itself: what
// one shows well says nothing about the other.
bool RecursiveEstimator::is_caught(const Observation& observation, const CoilObservations& coils,
                                   double distance, const TubeEstimate& estimate) {
  return !is_seen_well(observation.instant) && better_alone(observation, coils, distance, estimate) &&
         is_seen_elsewhere_alone(observation, coils);
}

bool RecursiveEstimator::is_seen_well(MonotonicTime instant) const {
  for (std::size_t view = 0; view < views_.count(); ++view) {
    if (views_.agreeing(view, instant).value_or(1) <= kSeenWell) {
      return false;
    }
  }
  return true;
}

// In a view that does not show the shape well, by the shape that better_alone() has found; and that one is
// much worse in no view.
bool RecursiveEstimator::is_seen_elsewhere_alone(const Observation& observation,
                                                 const CoilObservations& coils) const {
  bool caught = false;
  for (std::size_t view = 0; view < views_.count(); ++view) {
    const std::optional<double> here = views_.agreeing(view, observation.instant);
    const double there = second_look_.agreeing(view, observation.instant).value_or(0);
    if (here && there < kSeenAsWell * *here) {
      return false;
    }
    caught = caught || (here && *here <= kSeenWell && there >= *here + kSeenBetter &&
                        is_elsewhere_alone(views_.camera(view), coils));
  }
  return caught;
}

// Where the nearest coil takes no part, a shape of the instant alone may be anywhere.
bool RecursiveEstimator::is_elsewhere_alone(const Camera& camera, const CoilObservations& coils) const {
  const UniformCubicBSpline& spline = map_.spline();
  int elsewhere = 0;
  for (double s_mm = 0; s_mm <= spline.length_mm(); s_mm += kElsewhereEach_mm) {
    if (!coils.nearest_is_used(s_mm)) {
      continue;
    }
    const CubicBasis basis = spline.basis(s_mm);
    const Eigen::Vector3d p_world_mm = combine(state_.C, basis.first, basis.value);
    const Eigen::Vector3d tangent_world = combine(state_.C, basis.first, basis.first_derivative);
    const auto here = camera.project(p_world_mm);
    const auto ahead = camera.project(p_world_mm + tangent_world);
    const auto there = camera.project(combine(start_.C(), basis.first, basis.value));
    if (!here || !there || !ahead || !camera.contains(here->p_image_px)) {
      continue;
    }
    const Eigen::Vector2d along = (ahead->p_image_px - here->p_image_px).normalized();
    const Eigen::Vector2d way_px = there->p_image_px - here->p_image_px;
    elsewhere += std::abs(along.x() * way_px.y() - along.y() * way_px.x()) > kElsewhere_px ? 1 : 0;
  }
  return elsewhere >= kMinElsewhere;
}

// Two images of one EM measurement are not two witnesses: the error of the coils is the same.
void RecursiveEstimator::doubt(int witnesses) {
  const bool same = state_.doubted_times > 0 && state_.doubted_em == state_.newest_em;
  state_.doubted_times = std::min(
      same ? std::max(state_.doubted_times, witnesses) : state_.doubted_times + witnesses, kDoubtedTimes);
  state_.doubted_em = state_.newest_em;
}

// Images may lead the shape along something else, a little each time, and the errors of the coils grow with
// it. Or the tube has snapped.
void RecursiveEstimator::judge_shape(const Observation& observation, const CoilObservations& coils,
                                     const TubeEstimate& estimate) {
  if (images_ != ImageVerdict::kShowsTube) {
    state_.doubted_times = 0;
    return;
  }
  if (const int witnesses = coils_of_a_snap(observation, coils, estimate); witnesses > 0) {
    doubt(witnesses);
    images_ = state_.doubted_times == kDoubtedTimes ? ImageVerdict::kLost : ImageVerdict::kContradicts;
    return;
  }
  const double distance = distance_from_coils(coils, state_.C);
  if (distance < kDoubtedFrom * coils.used_count()) {
    if (is_caught(observation, coils, distance, estimate)) {
      doubt(1);
    } else {
      state_.doubted_times = 0;
    }
    return;
  }
  images_ = ImageVerdict::kContradicts;
  if (distance > kOutOfTheQuestion * coils.used_count()) {
    images_ = ImageVerdict::kLost;
    state_.doubted_times = kDoubtedTimes;  // no need to ask further
    return;
  }
  if (better_alone(observation, coils, kBetterAlone * distance, estimate)) {
    doubt(1);
  } else {
    state_.doubted_times = 0;
  }
}

// When most coils contradict, the tube has snapped and they are right.
bool RecursiveEstimator::is_lost() const {
  return most_are_out() || state_.disowned || state_.images_without_tube >= kLostImages ||
         state_.doubted_times >= kDoubtedTimes;
}

}  // namespace tubed
