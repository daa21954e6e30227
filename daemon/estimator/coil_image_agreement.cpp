#include "daemon/estimator/coil_image_agreement.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "daemon/estimator/coil_error_scale.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr int kJudgedAtOnce = 4;    // explanations an image
constexpr double kNew_s = 0.13;     // after which an image brings as much as if there had been none before it
constexpr double kMinNews = 1e-3;   // two images of an instant
constexpr double kNearest_mm = 5;   // of an image line to a coil, along the tube
constexpr double kAcross_mm = 0.3;  // how well the shape is known across an image that shows it
constexpr double kEnd_px = 2.5;     // how well the end of the tube is seen, along it
constexpr double kEndMemory_s = 2;  // of how far the image's end lies beyond the shape's
constexpr double kEndSeen_mm = 0.6;  // nearer than that it is not known where the image has the end: 1 px
constexpr double kEndContradicts_mm = 3.5;  // the shape is seen to end elsewhere, whatever explains it
constexpr double kEndAgrees_mm = 2.5;
constexpr double kMinEndShare =
    0.7;  // of its length that must show: a steep tip is longer or shorter by its depth
constexpr double kHeld_mm = 0.15;  // what an image leaves open across itself
constexpr double kHeldFor_s = 1;
constexpr double kSharedShare = 0.7;  // of what stays of a coil's error, its neighbours' share
constexpr double kShared_mm = 200;    // along the tube, over which they share it
constexpr double kPriorOdds =
    1e-2;  // of each explanation that is not "as stated": a mistake in a hundred procedures
constexpr double kFieldOdds = 1e-3;  // of coils that are off each in its own way, which explains anything
constexpr double kMagnificationOdds =
    1e-3;                         // of a view: found when it is set up, and shown to be wrong for hours
constexpr double kCertain = 0.8;  // of "as stated", to take back that they disagree

// Standard deviations where an explanation holds.
constexpr double kWrongShift_mm = 8;
constexpr double kWrongTurn_rad = 0.06;
constexpr double kWrongArcLength_mm = 10;
constexpr double kWrongClock_s = 0.15;
constexpr double kWrongMagnification = 0.08;
constexpr double kWrongField_mm = 4;
constexpr double kWrongCoil_mm = 20;

constexpr double square(double x) { return x * x; }

// Lower triangular L with L L^T = covariance of what coils share, of unit variance.
Eigen::MatrixXd shared_by_neighbours(const std::vector<double>& places_mm) {
  const auto count = static_cast<Eigen::Index>(places_mm.size());
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index k = 0; k < count; ++k) {
      const double apart_mm = places_mm[static_cast<std::size_t>(i)] - places_mm[static_cast<std::size_t>(k)];
      covariance(i, k) = std::exp(-std::abs(apart_mm) / kShared_mm) + (i == k ? 1e-9 : 0);
    }
  }
  return covariance.llt().matrixL();
}

// Of an axis, where the camera's pose is not known better: it is another one with the next image.
double pose_variance_mm2(const ViewConstraints& view) {
  return Eigen::Map<const Eigen::Array3d>(view.pose_sigma.translation_mm.data()).square().maxCoeff();
}

// Against "as stated", before anything was seen.
double prior_odds(Discord discord) {
  switch (discord) {
    case Discord::kNone:
      return 1;
    case Discord::kField:
      return kFieldOdds;
    case Discord::kMagnification:
      return kMagnificationOdds;
    default:
      return kPriorOdds;
  }
}

std::vector<double> coil_places_of(const InstrumentDescription& instrument) {
  std::vector<double> places_mm;
  for (const CoilPlacement& coil : instrument.coils) {
    places_mm.push_back(coil.offset_from_tip_mm);
  }
  return places_mm;
}

}  // namespace

CoilImageAgreement::CoilImageAgreement(const RoomErrors& errors, const InstrumentDescription& instrument,
                                       int view_count)
    : errors_(errors),
      places_mm_(coil_places_of(instrument)),
      view_count_(view_count),
      neighbours_(shared_by_neighbours(places_mm_)),
      evidence_(shared_column(coil_count())),
      row_(Eigen::VectorXd::Zero(evidence_.unknowns())),
      end_row_(row_),
      D_(row_) {
  using enum Discord;
  for (const Discord discord : {kNone, kRegistration, kArcLengths, kClock, kField}) {
    explanations_.push_back({discord});
  }
  for (int view = 0; view < view_count_; ++view) {
    explanations_.push_back({kMagnification, view});
  }
  for (int coil = 0; coil < coil_count(); ++coil) {
    explanations_.push_back({kCoil, coil});
  }
}

void CoilImageAgreement::reset() {
  evidence_.forget(0);
  end_row_.setZero();
  next_ = 0;
  views_ = {};
  past_count_ = 0;
  newest_ = MonotonicTime{};
  verdict_ = Verdict{};
  disagree_ = false;
  end_contradicts_ = false;
  registration_square_.setZero();
  field_square_mm2_ = 0;
  beyond_tip_mm_ = 0;
}

void CoilImageAgreement::observe(const CoilObservations& coils, const Confirmed& shape, double noise_mm,
                                 double lasting_mm) {
  const bool begins = to_ns(newest_) == 0;
  const double dt_s = begins ? 0 : std::clamp(seconds_between(newest_, shape.instant), 0.0, 1.0);
  newest_ = shape.instant;
  forget(shape, begins ? -1 : dt_s);
  remember_places(shape);
  lasting_mm_ = std::max(lasting_mm, errors_.coil_mm);
  for (const ViewConstraints& view : shape.views) {
    const std::optional<Sight> sight = look(*view.camera, shape.instant);
    if (!sight) continue;
    observe_across(coils, shape, view, *sight, noise_mm);
    observe_end(coils, shape, view, *sight, noise_mm, dt_s);
  }
  for (int i = 0; i < kJudgedAtOnce; ++i) {
    judge_next();
  }
}

// dt_s < 0: nothing was seen before.
void CoilImageAgreement::forget(const Confirmed& shape, double dt_s) {
  const CubicBasis middle = shape.spline.basis(shape.spline.length_mm() / 2);
  const Eigen::Vector3d place_mm = combine(shape.C, middle.first, middle.value);
  if (dt_s < 0) {
    centre_mm_ = place_mm;
    place_mm_ = place_mm;
  }
  const double moved_mm = (place_mm - place_mm_).norm();
  place_mm_ = place_mm;
  evidence_.forget(std::exp(-std::max(dt_s, 0.0) / kMemory_s - moved_mm / CoilErrorScale::kNewAfter_mm));
}

void CoilImageAgreement::remember_places(const Confirmed& shape) {
  std::rotate(past_.begin(), past_.end() - 1, past_.end());
  past_count_ = std::min(past_count_ + 1, kPlaces);
  past_[0].instant = shape.instant;
  for (int i = 0; i < coil_count(); ++i) {
    const CubicBasis basis = shape.spline.basis(places_mm_[static_cast<std::size_t>(i)]);
    past_[0].p_world_mm[static_cast<std::size_t>(i)] = combine(shape.C, basis.first, basis.value);
  }
}

// Of the tube there; zero until it is known.
Eigen::Vector3d CoilImageAgreement::velocity_mm_s(int coil) const {
  const Places& oldest = past_[kPlaces - 1];
  const double dt_s = seconds_between(oldest.instant, past_[0].instant);
  if (past_count_ < kPlaces || !(dt_s > 0) || dt_s > 1) {
    return Eigen::Vector3d::Zero();
  }
  const auto at = static_cast<std::size_t>(coil);
  return (past_[0].p_world_mm[at] - oldest.p_world_mm[at]) / dt_s;
}

// Where a coil lies beside a shape hardly changes from image to image: of many images a second each brings
// less.
std::optional<CoilImageAgreement::Sight> CoilImageAgreement::look(const Camera& camera,
                                                                  MonotonicTime instant) {
  for (int i = 0; i < view_count_; ++i) {
    SeenView& view = views_[static_cast<std::size_t>(i)];
    if (view.camera == nullptr || view.camera == &camera) {
      const double dt_s = view.camera == nullptr ? kNew_s : seconds_between(view.confirmed, instant);
      view.camera = &camera;
      view.confirmed = instant;
      return Sight{i, std::clamp(dt_s / kNew_s, kMinNews, 1.0)};
    }
  }
  return std::nullopt;
}

// A displacement of the coil at p along `side`, so many times: what every unknown adds to it.
void CoilImageAgreement::add_coil_to_row(int coil, const Eigen::Vector3d& p_mm, const Eigen::Vector3d& side,
                                         double weight) {
  row_.segment<3>(0) += weight * side;
  row_.segment<3>(kTurn) += weight * (p_mm - centre_mm_).cross(side);
  row_[kClockColumn] += weight * side.dot(velocity_mm_s(coil));
  row_.segment<3>(own_column(coil)) += weight * side;
  for (int k = 0; k <= coil; ++k) {
    row_.segment<3>(shared_column(k)) += weight * neighbours_(coil, k) * side;
  }
}

// side . (coil - shape) = side . (shift + turn x (p - centre) + velocity clock + errors of the coil)
// + magnification times the way from the principal point + noise, with `side` across the tube in the image.
void CoilImageAgreement::observe_across(const CoilObservations& coils, const Confirmed& shape,
                                        const ViewConstraints& view, const Sight& sight, double noise_mm) {
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    const bool is_shown = std::any_of(
        view.lines, view.lines + view.count,
        [&coil](const LineConstraint& line) { return std::abs(line.s_mm - coil.s_mm) <= kNearest_mm; });
    if ((coil.state != CoilState::kUsed && coil.state != CoilState::kOutlier) || !is_shown) {
      continue;
    }
    const CubicBasis basis = shape.spline.basis(coil.s_mm);
    const Eigen::Vector3d p_mm = combine(shape.C, basis.first, basis.value);
    const auto projection = view.camera->project(p_mm);
    if (!projection) {
      continue;
    }
    const Eigen::Vector2d along =
        projection->J_image_world * combine(shape.C, basis.first, basis.first_derivative);
    const Eigen::Vector2d across = Eigen::Vector2d(-along.y(), along.x()).normalized();
    const Eigen::Vector3d gradient = projection->J_image_world.transpose() * across;
    const double px_per_mm = gradient.norm();
    const Eigen::Vector3d side = gradient / px_per_mm;
    const CameraCalibration& camera = view.camera->calibration();
    row_.setZero();
    add_coil_to_row(i, p_mm, side, 1);
    row_[kViews + sight.index] =
        across.dot(projection->p_image_px - Eigen::Vector2d(camera.cx, camera.cy)) / px_per_mm;
    evidence_.add(row_, side.dot(coil.p_world_mm - p_mm),
                  (square(noise_mm) + square(kAcross_mm) + pose_variance_mm2(view)) / sight.news);
  }
}

// How much further out the tube ends in the image than coils and arc lengths have it: from the shape's tip to
// the image's end, less how far the coils lie further out along the tube than the shape, in the mean.
void CoilImageAgreement::observe_end(const CoilObservations& coils, const Confirmed& shape,
                                     const ViewConstraints& view, const Sight& sight, double noise_mm,
                                     double dt_s) {
  const LineConstraint& end = view.lines[view.count - 1];
  const int used = coils.used_count();
  if (view.count < 2 || end.s_mm != 0 || used == 0) {
    return;
  }
  const CubicBasis tip = shape.spline.basis(0);
  const Eigen::Vector3d tip_mm = combine(shape.C, tip.first, tip.value);
  const Eigen::Vector3d outward = -combine(shape.C, tip.first, tip.first_derivative).normalized();
  const auto projection = view.camera->project(tip_mm);
  if (!projection) {
    return;
  }
  const double px_per_mm = end.normal.dot(projection->J_image_world * outward);
  const double px_per_mm_across = projection->J_image_world.norm() / std::numbers::sqrt2;
  if (px_per_mm < kMinEndShare * px_per_mm_across) {
    return;
  }
  row_.setZero();
  double further_mm = end.normal.dot(end.target_px - projection->p_image_px) / px_per_mm;
  beyond_tip_mm_ += std::min(dt_s / kEndMemory_s, 1.0) * (further_mm - beyond_tip_mm_);
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      continue;
    }
    const CubicBasis basis = shape.spline.basis(coil.s_mm);
    const Eigen::Vector3d p_mm = combine(shape.C, basis.first, basis.value);
    const Eigen::Vector3d toward_tip = -combine(shape.C, basis.first, basis.first_derivative).normalized();
    further_mm -= toward_tip.dot(coil.p_world_mm - p_mm) / used;
    add_coil_to_row(i, p_mm, toward_tip, -1.0 / used);
  }
  row_[kArcLength] = -1;  // where they are too large the coils put the end too far out
  const CameraCalibration& camera = view.camera->calibration();
  row_[kViews + sight.index] =
      -end.normal.dot(projection->p_image_px - Eigen::Vector2d(camera.cx, camera.cy)) / px_per_mm;
  evidence_.add(
      row_, further_mm,
      (square(noise_mm) / used + square(kEnd_px / px_per_mm) + pose_variance_mm2(view)) / sight.news);
  end_row_ = row_;
}

// D of LinearEvidence.
void CoilImageAgreement::allow(const Explanation& explanation) {
  const auto holds = [&explanation](Discord discord) { return explanation.discord == discord; };
  const bool registration = holds(Discord::kRegistration);
  D_.segment<3>(0).setConstant(registration ? kWrongShift_mm : errors_.shift_mm);
  D_.segment<3>(kTurn).setConstant(registration ? kWrongTurn_rad : errors_.turn_rad);
  D_[kArcLength] = holds(Discord::kArcLengths) ? kWrongArcLength_mm : errors_.arc_length_mm;
  D_[kClockColumn] = holds(Discord::kClock) ? kWrongClock_s : errors_.clock_s;
  D_.segment(kViews, view_count_).setConstant(errors_.magnification);
  const double own_mm = lasting_mm_ * std::sqrt(1 - kSharedShare);
  D_.segment(own_column(0), 3 * coil_count())
      .setConstant(holds(Discord::kField) ? std::hypot(kWrongField_mm, own_mm) : own_mm);
  D_.segment(shared_column(0), 3 * coil_count()).setConstant(lasting_mm_ * std::sqrt(kSharedShare));
  if (holds(Discord::kMagnification)) {
    D_[kViews + explanation.index] = kWrongMagnification;
  } else if (holds(Discord::kCoil)) {
    D_.segment<3>(own_column(explanation.index)).setConstant(kWrongCoil_mm);
  }
}

// One explanation of what was seen until the first of them was judged.
void CoilImageAgreement::judge_next() {
  if (next_ == 0) {
    evidence_.freeze();
  }
  Explanation& explanation = explanations_[next_];
  allow(explanation);
  explanation.log_evidence = evidence_.explain(D_) + std::log(prior_odds(explanation.discord));
  const Eigen::VectorXd& mean = evidence_.mean();
  explanation.end_mm = end_row_.dot(mean);
  explanation.registration = mean.head<6>();
  explanation.arc_length_mm = mean[kArcLength];
  explanation.clock_s = mean[kClockColumn];
  const int index = explanation.index;
  explanation.magnification =
      view_count_ > 0 ? mean[kViews + (explanation.discord == Discord::kMagnification ? index : 0)] : 0;
  explanation.coil_mm = mean.segment<3>(own_column(explanation.discord == Discord::kCoil ? index : 0));
  // Of "as stated" only what it has found out: what may be wrong in every room is in the shape's own sigma.
  explanation.covariance.setZero();
  if (explanation.discord == Discord::kRegistration) {
    evidence_.covariance_of_first(explanation.covariance);
  }
  if (++next_ == explanations_.size()) {
    next_ = 0;
    conclude();
  }
}

// Moments of the mixture of all explanations.
void CoilImageAgreement::conclude() {
  const auto best = std::max_element(
      explanations_.begin(), explanations_.end(),
      [](const Explanation& a, const Explanation& b) { return a.log_evidence < b.log_evidence; });
  if (!std::isfinite(best->log_evidence)) {
    return;
  }
  double sum = 0;
  for (const Explanation& explanation : explanations_) {
    sum += std::exp(explanation.log_evidence - best->log_evidence);
  }
  registration_square_.setZero();
  field_square_mm2_ = 0;
  for (SeenView& view : views_) {
    view.magnification_square = 0;
  }
  verdict_.as_stated = 0;
  for (const Explanation& explanation : explanations_) {
    const double probability = std::exp(explanation.log_evidence - best->log_evidence) / sum;
    registration_square_ += probability * (explanation.covariance +
                                           explanation.registration * explanation.registration.transpose());
    if (explanation.discord == Discord::kNone) {
      verdict_.as_stated = probability;
    } else if (explanation.discord == Discord::kField) {
      field_square_mm2_ = probability * square(kWrongField_mm);
    } else if (explanation.discord == Discord::kMagnification) {
      views_[static_cast<std::size_t>(explanation.index)].magnification_square =
          probability * square(explanation.magnification);
    }
  }
  verdict_.explanation = best->discord;
  verdict_.index = best->index;
  verdict_.probability = 1 / sum;
  verdict_.shift_mm = best->registration.head<3>();
  verdict_.turn_rad = best->registration.tail<3>();
  verdict_.coil_mm = best->coil_mm;
  verdict_.arc_length_mm = best->arc_length_mm;
  verdict_.clock_s = best->clock_s;
  verdict_.magnification = best->magnification;
  verdict_.end_mm = best->end_mm;
  disagree_ = verdict_.as_stated < (disagree_ ? kCertain : 0.5);
  const double contradicts_mm = end_contradicts_ ? kEndAgrees_mm : kEndContradicts_mm;
  end_contradicts_ = std::abs(beyond_tip_mm_) > contradicts_mm;
  if (end_contradicts_ && verdict_.explanation == Discord::kNone) {
    verdict_.explanation = Discord::kArcLengths;
    verdict_.end_mm = beyond_tip_mm_;
  }
}

// The registration's error at p is [I, -[p - c]x] (shift, turn). An image holds the point across its rays to
// kHeld_mm: with K the information of that, M becomes (K + M^-1)^-1 = M (I + K M)^-1.
Eigen::Matrix3d CoilImageAgreement::doubt(const Eigen::Vector3d& p_world_mm,
                                          const Eigen::Vector3d& tangent_world, MonotonicTime now) const {
  const Eigen::Vector3d r_mm = p_world_mm - centre_mm_;
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.leftCols<3>().setIdentity();
  J.rightCols<3>() << 0, r_mm.z(), -r_mm.y(), -r_mm.z(), 0, r_mm.x(), r_mm.y(), -r_mm.x(), 0;
  Eigen::Matrix3d M =
      J * registration_square_ * J.transpose() + field_square_mm2_ * Eigen::Matrix3d::Identity();
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d scaled = Eigen::Matrix3d::Zero();
  for (const SeenView& view : views_) {
    if (view.camera == nullptr || std::abs(seconds_between(view.confirmed, now)) > kHeldFor_s) {
      continue;
    }
    const auto projection = view.camera->project(p_world_mm);
    if (!projection || !view.camera->contains(projection->p_image_px) ||
        is_masked(view.camera->calibration(), projection->p_image_px)) {
      continue;
    }
    const RigidTransform& T_camera_world = view.camera->calibration().T_camera_world;
    const Eigen::Vector3d p_camera_mm = T_camera_world * p_world_mm;
    const Eigen::Vector3d ray = T_camera_world.linear().transpose() * p_camera_mm.normalized();
    K += (Eigen::Matrix3d::Identity() - ray * ray.transpose()) / square(kHeld_mm);
    const Eigen::Vector3d lateral =
        T_camera_world.linear().transpose() * Eigen::Vector3d(p_camera_mm.x(), p_camera_mm.y(), 0);
    scaled += view.magnification_square * lateral * lateral.transpose();
  }
  M = M * (Eigen::Matrix3d::Identity() + K * M).inverse();
  const double along_mm2 = std::max(square(beyond_tip_mm_) - square(kEndSeen_mm), 0.0);
  return M + scaled + along_mm2 * tangent_world * tangent_world.transpose();
}

}  // namespace tubed
