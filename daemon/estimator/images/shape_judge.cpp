#include "daemon/estimator/images/shape_judge.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "daemon/estimator/coils/coil_distance.hpp"

namespace tubed {

namespace {

constexpr double kOutOfTheQuestion = 25;  // chi^2 a coil: no shape has to be asked for
// The instant alone knows better: coils that are further off than their whole error allows (chi^2 a coil, 3
// dof), and half as far off a shape of this instant that the image shows as well, at two EM measurements in a
// row.
constexpr double kDoubtedFrom = 7;
constexpr double kBetterAlone = 0.5;
constexpr double kSeenAsWell = 0.9;
// A snap: coils off the shape in the mean (chi^2 a coil, 3 dof), at least one of them for certain, and a
// third as far off a shape of this instant. One coil may be wrong by itself: it has to say more, and so in
// two measurements, steadily.
constexpr double kSnappedFrom = 4;
constexpr double kSnappedFromByOne = 5;
constexpr double kContradictingFrom = 7;
constexpr double kFarBetterAlone = 0.33;
// Caught beside the tube. In frames that were not, both shapes were within 2 px, in those that were, 7 to 14
// apart.
constexpr double kSeenWell = 0.85;  // share of lines that agree: nothing else is asked
constexpr double kSeenBetter = 0.03;
constexpr double kElsewhere_px = 5;
constexpr double kElsewhereEach_mm = 2;
constexpr int kMinElsewhere = 3;  // of such places

bool is_seen_well(const TubeViews& views, MonotonicTime instant) {
  for (std::size_t view = 0; view < views.count(); ++view) {
    if (views.agreeing(view, instant).value_or(1) <= kSeenWell) {
      return false;
    }
  }
  return true;
}

}  // namespace

void ShapeDoubt::add(int witnesses, MonotonicTime newest_em) {
  const bool same = times_ > 0 && newest_em_ == newest_em;
  times_ = std::min(same ? std::max(times_, witnesses) : times_ + witnesses, kCertain);
  newest_em_ = newest_em;
}

ShapeJudge::ShapeJudge(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                       const RoomDescription& room, SingleFrameSolver& solver)
    : sigma_position_mm_(settings.sigma_position_mm),
      solver_(solver),
      views_(settings, instrument, room),
      found_(std::make_unique<TubeEstimate>()) {}

ImageVerdict ShapeJudge::judge(const Observation& observation, const ShownShape& shown, ShapeDoubt& doubt) {
  if (const int witnesses = coils_of_a_snap(observation, shown); witnesses > 0) {
    doubt.add(witnesses, shown.newest_em);
    return doubt.is_certain() ? ImageVerdict::kLost : ImageVerdict::kContradicts;
  }
  const double distance = this->distance(shown.coils, shown.map, shown.C);
  const int used = shown.coils.used_count();
  if (distance > kOutOfTheQuestion * used) {
    doubt.make_certain();  // no need to ask further
    return ImageVerdict::kLost;
  }
  const bool contradicts = !(distance < kDoubtedFrom * used);
  const bool knows_better = contradicts
                                ? is_better_alone(observation, shown, shown.coils, kBetterAlone * distance)
                                : is_caught(observation, shown, distance);
  if (knows_better) {
    doubt.add(1, shown.newest_em);
  } else {
    doubt.clear();
  }
  return contradicts ? ImageVerdict::kContradicts : ImageVerdict::kShowsTube;
}

double ShapeJudge::distance(const CoilObservations& coils, const TubeMap& map,
                            const Eigen::Matrix3Xd& C) const {
  return distance_from_coils(coils, map.spline(), C, sigma_position_mm_);
}

// How many coils, left out or not, say that the tube has snapped to where a shape of this instant alone has
// it. Nothing of it is in the image when it has snapped along the rays.
int ShapeJudge::coils_of_a_snap(const Observation& observation, const ShownShape& shown) {
  CoilObservations all = shown.coils;
  double distance = 0;
  int contradicting = 0;
  for (int i = 0; i < all.count; ++i) {
    CoilObservation& coil = all.coils[static_cast<std::size_t>(i)];
    if (coil.state == CoilState::kOutlier && shown.gate.is_witness(i)) {
      coil.state = CoilState::kUsed;
    }
    if (coil.used()) {
      const double chi_squared = (off_coil_mm(coil, shown.map.spline(), shown.C) -
                                  shown.C.col(shown.map.columns().position_error(i)))
                                     .squaredNorm() /
                                 (sigma_position_mm_ * sigma_position_mm_);
      distance += chi_squared;
      contradicting += chi_squared > kContradictingFrom ? 1 : 0;
    }
  }
  const double enough = contradicting > 1 ? kSnappedFrom : kSnappedFromByOne;
  const bool snapped = contradicting > 0 && distance > enough * all.used_count() &&
                       is_better_alone(observation, shown, all, kFarBetterAlone * distance);
  return snapped ? contradicting : 0;
}

// Is a shape of this instant alone, which begins at the coils and is led by nothing older, nearer to them
// than `distance`, and seen as well?
bool ShapeJudge::is_better_alone(const Observation& observation, const ShownShape& shown,
                                 const CoilObservations& coils, double distance) {
  CoilObservations alone = coils;
  const Asked asked = shown.lost_tail ? Asked::kSecondOpinionOnTail : Asked::kSecondOpinion;
  views_.forget_lines();  // of older instants
  return solver_.solve_em(alone, *found_) &&
         solver_.fuse_images(observation, alone, views_, asked, *found_) == ImageVerdict::kShowsTube &&
         found_->image_inlier_ratio >= static_cast<float>(kSeenAsWell) * shown.agreeing &&
         this->distance(coils, shown.map, solver_.C()) < distance;
}

// An image may have caught a stretch of the shape beside the tube, further off than the lines reach: where a
// shape of this instant alone is elsewhere in the image, more of its lines agree. Each view by itself: what
// one shows well says nothing about the other.
bool ShapeJudge::is_caught(const Observation& observation, const ShownShape& shown, double distance) {
  return !is_seen_well(shown.views, observation.instant) &&
         is_better_alone(observation, shown, shown.coils, distance) && is_seen_elsewhere(observation, shown);
}

// In a view that does not show the shape well, by the shape that is_better_alone() has found; and that one is
// much worse in no view.
bool ShapeJudge::is_seen_elsewhere(const Observation& observation, const ShownShape& shown) const {
  bool caught = false;
  for (std::size_t view = 0; view < shown.views.count(); ++view) {
    const std::optional<double> here = shown.views.agreeing(view, observation.instant);
    const double there = views_.agreeing(view, observation.instant).value_or(0);
    if (here && there < kSeenAsWell * *here) {
      return false;
    }
    caught = caught || (here && *here <= kSeenWell && there >= *here + kSeenBetter &&
                        is_elsewhere(shown.views.camera(view), shown));
  }
  return caught;
}

// Where the nearest coil takes no part, a shape of the instant alone may be anywhere.
bool ShapeJudge::is_elsewhere(const Camera& camera, const ShownShape& shown) const {
  const UniformCubicBSpline& spline = shown.map.spline();
  int elsewhere = 0;
  for (double s_mm = 0; s_mm <= spline.length_mm(); s_mm += kElsewhereEach_mm) {
    if (!shown.coils.nearest_is_used(s_mm)) {
      continue;
    }
    const CubicBasis basis = spline.basis(s_mm);
    const Eigen::Vector3d p_world_mm = combine(shown.C, basis.first, basis.value);
    const Eigen::Vector3d tangent_world = combine(shown.C, basis.first, basis.first_derivative);
    const auto here = camera.project(p_world_mm);
    const auto ahead = camera.project(p_world_mm + tangent_world);
    const auto there = camera.project(combine(solver_.C(), basis.first, basis.value));
    if (!here || !there || !ahead || !camera.contains(here->p_image_px)) {
      continue;
    }
    const Eigen::Vector2d along = (ahead->p_image_px - here->p_image_px).normalized();
    const Eigen::Vector2d way_px = there->p_image_px - here->p_image_px;
    elsewhere += std::abs(along.x() * way_px.y() - along.y() * way_px.x()) > kElsewhere_px ? 1 : 0;
  }
  return elsewhere >= kMinElsewhere;
}

}  // namespace tubed
