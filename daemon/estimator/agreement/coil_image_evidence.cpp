#include "daemon/estimator/agreement/coil_image_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimator/coils/coil_error_scale.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kNew_s = 0.13;     // after which an image brings as much as if there had been none before it
constexpr double kMinNews = 1e-3;   // two images of an instant
constexpr double kAcross_mm = 0.3;  // how well the shape is known across an image that shows it, at best
constexpr double kEnd_px = 2.5;     // how well the end of the tube is seen, along it
constexpr double kEndMemory_s = 2;  // of how far the image's end lies beyond the shape's
constexpr double kMinEndShare =
    0.7;  // of its length that must show: a steep tip is longer or shorter by its depth
constexpr double kSuspected_s = 1;  // of a coil, before the gate left it out: once or twice that long

// Of an axis, where the camera's pose is not known better: it is another one with the next image.
double pose_variance_mm2(const ViewConstraints& view) {
  return Eigen::Map<const Eigen::Array3d>(view.pose_sigma.translation_mm.data()).square().maxCoeff();
}

}  // namespace

CoilImageEvidence::CoilImageEvidence(const InstrumentDescription& instrument, int view_count)
    : model_(instrument, view_count),
      linear_(model_.unknowns(), along_part() + 1),
      row_(Eigen::VectorXd::Zero(model_.unknowns())),
      end_row_(row_),
      room_row_(row_),
      sum_row_(row_),
      contrast_(row_),
      views_(static_cast<std::size_t>(view_count),
             {.camera = nullptr, .confirmed = {}, .held = HeldAcross(instrument.length_mm)}) {}

void CoilImageEvidence::forget_held() {
  for (SeenView& view : views_) view.confirmed = MonotonicTime{};
}

void CoilImageEvidence::reset() {
  model_.reset();
  linear_.forget(0);
  for (std::size_t coil = 0; coil < coil_count(); ++coil) {
    retract(coil);
  }
  is_out_ = {};
  end_row_.setZero();
  for (SeenView& view : views_) {
    view.camera = nullptr;
  }
  newest_ = MonotonicTime{};
  beyond_tip_mm_ = 0;
}

void CoilImageEvidence::observe(const CoilObservations& coils, const ConfirmedShape& shape, double noise_mm) {
  const bool begins = to_ns(newest_) == 0;
  const double dt_s = begins ? 0 : std::clamp(seconds_between(newest_, shape.instant), 0.0, 1.0);
  newest_ = shape.instant;
  forget(shape, dt_s);
  model_.follow(shape);
  keep_older();
  double news = 0;
  for (const ViewConstraints& view : shape.views) {
    const std::optional<Sight> sight = look(view, shape);
    if (!sight) continue;
    news = std::max(news, sight->news);
    observe_across(coils, shape, view, *sight, noise_mm);
    observe_end(coils, shape, view, *sight, noise_mm, dt_s);
  }
  if (news > 0) observe_along(coils, shape, news, noise_mm);
}

// A coil that comes back into the gate was off for a while, and what it said meanwhile is over. It may have
// been off before the gate found out: of the last second or two nothing is believed either, and nothing of
// what the coils said of each other.
void CoilImageEvidence::retract(std::size_t coil) {
  for (std::size_t part = 0; part < kParts; ++part) {
    linear_.retract(coil_part(coil, static_cast<Part>(part)));
  }
  linear_.retract(along_part());
}

void CoilImageEvidence::keep_older() {
  if (seconds_between(kept_, newest_) < kSuspected_s) {
    return;
  }
  kept_ = newest_;
  for (std::size_t coil = 0; coil < coil_count(); ++coil) {
    linear_.keep(coil_part(coil, kOlder));
    linear_.keep(coil_part(coil, kNewest), coil_part(coil, kOlder));
  }
}

void CoilImageEvidence::forget(const ConfirmedShape& shape, double dt_s) {
  const CubicBasis middle = shape.spline.basis(shape.spline.length_mm() / 2);
  const Eigen::Vector3d place_mm = combine(shape.C, middle.first, middle.value);
  const double moved_mm = (place_mm - place_mm_).norm();
  place_mm_ = place_mm;
  linear_.forget(std::exp(-dt_s / kMemory_s - moved_mm / CoilErrorScale::kNewAfter_mm));
}

// Where a coil lies beside a shape hardly changes from image to image: of many images a second each brings
// less.
std::optional<CoilImageEvidence::Sight> CoilImageEvidence::look(const ViewConstraints& of,
                                                                const ConfirmedShape& shape) {
  for (int i = 0; i < model_.view_count(); ++i) {
    SeenView& view = views_[static_cast<std::size_t>(i)];
    if (view.camera == nullptr || view.camera == of.camera) {
      const double dt_s = view.camera == nullptr ? kNew_s : seconds_between(view.confirmed, shape.instant);
      view.camera = of.camera;
      view.confirmed = shape.instant;
      view.held.record(of, shape);
      return Sight{i, std::clamp(dt_s / kNew_s, kMinNews, 1.0)};
    }
  }
  return std::nullopt;
}

// side . (coil - shape) = side . (shift + turn x (p - centre) + velocity clock + errors of the coil)
// + magnification times the way from the principal point + noise, with `side` across the tube in the image.
void CoilImageEvidence::observe_across(const CoilObservations& coils, const ConfirmedShape& shape,
                                       const ViewConstraints& view, const Sight& sight, double noise_mm) {
  const HeldAcross& held = views_[static_cast<std::size_t>(sight.index)].held;
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
    model_.add_registration(p_mm, side, 1, row_);
    model_.add_shared_errors(i, side, 1, row_);
    row_.segment<3>(model_.own_column(i)) += side;
    row_[CoilImageModel::kViews + sight.index] =
        across.dot(projection->p_image_px - Eigen::Vector2d(camera.cx, camera.cy)) / px_per_mm;
    const auto index = static_cast<std::size_t>(i);
    const bool is_out = coil.state == CoilState::kOutlier;
    if (is_out_[index] && !is_out) retract(index);
    is_out_[index] = is_out;
    linear_.add(row_, side.dot(coil.p_world_mm - p_mm),
                (squared(noise_mm) + squared(std::max(kAcross_mm, held.sigma_mm(coil.s_mm))) +
                 pose_variance_mm2(view)) /
                    sight.news,
                coil_part(index, is_out ? kOut : kNewest));
  }
}

// How much further out the tube ends in the image than coils and arc lengths have it: from the shape's tip to
// the image's end, less how far the coils lie further out along the tube than the shape, in the mean.
void CoilImageEvidence::observe_end(const CoilObservations& coils, const ConfirmedShape& shape,
                                    const ViewConstraints& view, const Sight& sight, double noise_mm,
                                    double dt_s) {
  const int used = coils.used_count();
  if (!view.end_by_greys || used == 0) {
    return;
  }
  const LineConstraint& end = *view.end_by_greys;
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
    model_.add_registration(p_mm, toward_tip, -1.0 / used, row_);
    model_.add_errors_along(i, toward_tip, -1.0 / used, row_);
  }
  row_[CoilImageModel::kArcLength] = -1;  // where they are too large the coils put the end too far out
  const CameraCalibration& camera = view.camera->calibration();
  row_[CoilImageModel::kViews + sight.index] =
      -end.normal.dot(projection->p_image_px - Eigen::Vector2d(camera.cx, camera.cy)) / px_per_mm;
  linear_.add(
      row_, further_mm,
      (squared(noise_mm) / used + squared(kEnd_px / px_per_mm) + pose_variance_mm2(view)) / sight.news);
  end_row_ = row_;
}

}  // namespace tubed
