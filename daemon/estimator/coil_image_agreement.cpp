#include "daemon/estimator/coil_image_agreement.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "daemon/estimator/coil_error_scale.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr int kJudgedAtOnce = 6;    // explanations an image
constexpr double kNew_s = 0.13;     // after which an image brings as much as if there had been none before it
constexpr double kMinNews = 1e-3;   // two images of an instant
constexpr double kAcross_mm = 0.3;  // how well the shape is known across an image that shows it
constexpr double kEnd_px = 2.5;     // how well the end of the tube is seen, along it
constexpr double kEndMemory_s = 2;  // of how far the image's end lies beyond the shape's
constexpr double kMinEndShare =
    0.7;  // of its length that must show: a steep tip is longer or shorter by its depth
constexpr double kSuspected_s = 1;  // of a coil, before the gate left it out: once or twice that long
constexpr double kShared_mm = 200;  // along the tube, over which they share it

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
      evidence_(arc_length_column(coil_count()), kParts * places_mm_.size() + 1),
      row_(Eigen::VectorXd::Zero(evidence_.unknowns())),
      end_row_(row_),
      room_row_(row_),
      sum_row_(row_),
      contrast_(row_),
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
    explanations_.push_back({kCoilArcLength, coil});
  }
}

void CoilImageAgreement::reset() {
  evidence_.forget(0);
  for (std::size_t coil = 0; coil < places_mm_.size(); ++coil) {
    retract(coil);
  }
  is_out_ = {};
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
  keep_older();
  lasting_mm_ = std::max(lasting_mm, errors_.coil_mm);
  double news = 0;
  for (const ViewConstraints& view : shape.views) {
    const std::optional<Sight> sight = look(*view.camera, shape.instant);
    if (!sight) continue;
    news = std::max(news, sight->news);
    observe_across(coils, shape, view, *sight, noise_mm);
    observe_end(coils, shape, view, *sight, noise_mm, dt_s);
  }
  if (news > 0) observe_along(coils, shape, news, noise_mm);
  for (int i = 0; i < kJudgedAtOnce; ++i) {
    judge_next();
  }
}

// A coil that comes back into the gate was off for a while, and what it said meanwhile is over. It may have
// been off before the gate found out: of the last second or two nothing is believed either, and nothing of
// what the coils said of each other.
void CoilImageAgreement::retract(std::size_t coil) {
  for (std::size_t part = 0; part < kParts; ++part) {
    evidence_.retract(kParts * coil + part);
  }
  evidence_.retract(along_part());
}

void CoilImageAgreement::keep_older() {
  if (seconds_between(kept_, newest_) < kSuspected_s) {
    return;
  }
  kept_ = newest_;
  for (std::size_t coil = 0; coil < places_mm_.size(); ++coil) {
    evidence_.keep(kParts * coil + kOlder);
    evidence_.keep(kParts * coil + kNewest, kParts * coil + kOlder);
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

// The displacement that a wrong registration makes of p, to a side, so many times.
void CoilImageAgreement::add_registration(const Eigen::Vector3d& p_mm, const Eigen::Vector3d& side,
                                          double weight, Eigen::VectorXd& row) const {
  row.head<3>() += weight * side;
  row.segment<3>(kTurn) += weight * (p_mm - centre_mm_).cross(side);
}

// A displacement of the coil to a side, so many times: what the clock and its neighbours' errors add to it.
void CoilImageAgreement::add_shared_errors(int coil, const Eigen::Vector3d& side, double weight) {
  row_[kClockColumn] += weight * side.dot(velocity_mm_s(coil));
  for (int k = 0; k <= coil; ++k) {
    row_.segment<3>(shared_column(k)) += weight * neighbours_(coil, k) * side;
  }
}

// Along the tube a coil's own error looks like a wrong arc length: where that is too large the coil lies
// nearer to the tip. Its three numbers would be told by how the tube turns, in directions in which the shape
// follows.
void CoilImageAgreement::add_errors_along(int coil, const Eigen::Vector3d& toward_tip, double weight) {
  add_shared_errors(coil, toward_tip, weight);
  row_[arc_length_column(coil)] += weight;
}

// side . (coil - shape) = side . (shift + turn x (p - centre) + velocity clock + errors of the coil)
// + magnification times the way from the principal point + noise, with `side` across the tube in the image.
void CoilImageAgreement::observe_across(const CoilObservations& coils, const Confirmed& shape,
                                        const ViewConstraints& view, const Sight& sight, double noise_mm) {
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if ((coil.state != CoilState::kUsed && coil.state != CoilState::kOutlier) || !view.shows(coil.s_mm)) {
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
    add_registration(p_mm, side, 1, row_);
    add_shared_errors(i, side, 1);
    row_.segment<3>(own_column(i)) += side;
    row_[kViews + sight.index] =
        across.dot(projection->p_image_px - Eigen::Vector2d(camera.cx, camera.cy)) / px_per_mm;
    const auto index = static_cast<std::size_t>(i);
    const bool is_out = coil.state == CoilState::kOutlier;
    if (is_out_[index] && !is_out) retract(index);
    is_out_[index] = is_out;
    evidence_.add(row_, side.dot(coil.p_world_mm - p_mm),
                  (squared(noise_mm) + squared(kAcross_mm) + pose_variance_mm2(view)) / sight.news,
                  kParts * index + (is_out ? kOut : kNewest));
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
    add_registration(p_mm, toward_tip, -1.0 / used, row_);
    add_errors_along(i, toward_tip, -1.0 / used);
  }
  row_[kArcLength] = -1;  // where they are too large the coils put the end too far out
  const CameraCalibration& camera = view.camera->calibration();
  row_[kViews + sight.index] =
      -end.normal.dot(projection->p_image_px - Eigen::Vector2d(camera.cx, camera.cy)) / px_per_mm;
  evidence_.add(
      row_, further_mm,
      (squared(noise_mm) / used + squared(kEnd_px / px_per_mm) + pose_variance_mm2(view)) / sight.news);
  end_row_ = row_;
}

}  // namespace tubed
