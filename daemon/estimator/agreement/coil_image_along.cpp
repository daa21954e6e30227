// How coils lie along the tube against each other, for CoilImageEvidence: lengths are kept, so that their
// distances along the tube are those of their arc lengths.
#include <cmath>

#include "daemon/estimator/agreement/coil_image_evidence.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kAlong_mm = 0.5;     // how well the shape keeps lengths
constexpr double kStep_mm = 10;       // along the tube, of integrals
constexpr double kOtherView = 0.985;  // cosine of 10 degrees between rays

// What views show of a displacement at the place s: nothing, all but what is along the rays, or all of it.
Eigen::Matrix3d shown_part(std::span<const ViewConstraints> views, double s_mm) {
  Eigen::Matrix3d shown = Eigen::Matrix3d::Zero();
  Eigen::Vector3d first_ray = Eigen::Vector3d::Zero();
  for (const ViewConstraints& view : views) {
    if (!view.shows(s_mm)) continue;
    const Eigen::Vector3d ray = view.camera->calibration().T_camera_world.linear().row(2).transpose();
    if (!shown.isZero() && std::abs(ray.dot(first_ray)) < kOtherView) {
      return Eigen::Matrix3d::Identity();
    }
    first_ray = ray;
    shown = Eigen::Matrix3d::Identity() - ray * ray.transpose();
  }
  return shown;
}

Eigen::Vector3d toward_tip_at(const ConfirmedShape& shape, double s_mm) {
  const CubicBasis basis = shape.spline.basis(s_mm);
  return -combine(shape.C, basis.first, basis.first_derivative).normalized();
}

}  // namespace

// What is wrong with all coils, or with an image, puts each point of the tube off by another way u. The shape
// goes with it by w, which is u where nothing shows the difference, and keeps its lengths, w' . t = 0, as u
// does (u' . t = 0). So how far the coils lie further out along the tube than the shape, r = (u - w) . t,
// grows by
//   r' = (u - w) . t' = (P u) . t'
// where P is what views show: by nothing where the tube is straight, or bends where no view shows it. A view
// of another magnification shows each point off by so much of its way from the axis.
void CoilImageEvidence::add_room_along(const ConfirmedShape& shape, double from_mm, double to_mm) {
  const int steps = static_cast<int>(std::ceil(std::abs(to_mm - from_mm) / kStep_mm));
  Eigen::Vector3d before = toward_tip_at(shape, from_mm);
  for (int i = 1; i <= steps; ++i) {
    const Eigen::Vector3d after = toward_tip_at(shape, from_mm + (to_mm - from_mm) * i / steps);
    const Eigen::Vector3d turned = after - before;
    const double s_mm = from_mm + (to_mm - from_mm) * (i - 0.5) / steps;
    const CubicBasis basis = shape.spline.basis(s_mm);
    const Eigen::Vector3d p_mm = combine(shape.C, basis.first, basis.value);
    model_.add_registration(p_mm, shown_part(shape.views, s_mm) * turned, 1, room_row_);
    for (const ViewConstraints& view : shape.views) {
      for (int k = 0; k < model_.view_count() && view.shows(s_mm); ++k) {
        if (views_[static_cast<std::size_t>(k)].camera == view.camera) {
          room_row_[CoilImageModel::kViews + k] += lateral_mm(*view.camera, p_mm).dot(turned);
        }
      }
    }
    before = after;
  }
}

// t . (coil_k - shape) - the mean of the same over coils 0 .. k - 1, t toward the tip: how far the tube has
// slid is in all of them. So scaled (Helmert's contrasts) their noise is as that of one coil, and
// independent.
void CoilImageEvidence::observe_along(const CoilObservations& coils, const ConfirmedShape& shape, double news,
                                      double noise_mm) {
  const double variance_mm2 = (squared(noise_mm) + squared(kAlong_mm)) / news;
  room_row_.setZero();
  sum_row_.setZero();
  double sum_mm = 0;
  double before_mm = 0;
  int used = 0;
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      continue;
    }
    const CubicBasis basis = shape.spline.basis(coil.s_mm);
    const Eigen::Vector3d toward_tip = toward_tip_at(shape, coil.s_mm);
    const double further_mm = toward_tip.dot(coil.p_world_mm - combine(shape.C, basis.first, basis.value));
    if (used > 0) add_room_along(shape, before_mm, coil.s_mm);
    row_ = room_row_;
    model_.add_errors_along(i, toward_tip, 1, row_);
    if (used > 0) {
      const double scale = std::sqrt(used / (used + 1.0));
      contrast_ = scale * (row_ - sum_row_ / used);
      linear_.add(contrast_, scale * (further_mm - sum_mm / used), variance_mm2, along_part());
    }
    sum_row_ += row_;
    sum_mm += further_mm;
    before_mm = coil.s_mm;
    ++used;
  }
}

}  // namespace tubed
