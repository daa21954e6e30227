#include "daemon/estimator/agreement/coil_image_model.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kShared_mm = 200;          // along the tube, over which coils share what they are off by
constexpr double kMinVelocityOver_s = 0.2;  // or five images: in less the shape's own noise seems to be fast
constexpr double kVelocityOver_s = 1;       // at most
constexpr double kMoved_mm = 0.85;  // between two images: two sigma of what is no motion, 0.3 mm an image

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

std::vector<double> coil_places_of(const InstrumentDescription& instrument) {
  std::vector<double> places_mm;
  for (const CoilPlacement& coil : instrument.coils) {
    places_mm.push_back(coil.offset_from_tip_mm);
  }
  return places_mm;
}

}  // namespace

Eigen::Vector3d lateral_mm(const Camera& camera, const Eigen::Vector3d& p_world_mm) {
  const RigidTransform& T_camera_world = camera.calibration().T_camera_world;
  const Eigen::Vector3d p_camera_mm = T_camera_world * p_world_mm;
  return T_camera_world.linear().transpose() * Eigen::Vector3d(p_camera_mm.x(), p_camera_mm.y(), 0);
}

CoilImageModel::CoilImageModel(const InstrumentDescription& instrument, int view_count)
    : places_mm_(coil_places_of(instrument)),
      view_count_(view_count),
      neighbours_(shared_by_neighbours(places_mm_)) {}

void CoilImageModel::reset() { past_count_ = 0; }

void CoilImageModel::follow(const ConfirmedShape& shape) {
  if (past_count_ == 0) {
    const CubicBasis middle = shape.spline.basis(shape.spline.length_mm() / 2);
    centre_mm_ = combine(shape.C, middle.first, middle.value);
  }
  std::rotate(past_.begin(), past_.end() - 1, past_.end());
  past_count_ = std::min(past_count_ + 1, kPlaces);
  past_[0].instant = shape.instant;
  past_[0].speed_mm_s = shape.speed_mm_s;
  for (int i = 0; i < coil_count(); ++i) {
    const auto coil = static_cast<std::size_t>(i);
    const CubicBasis basis = shape.spline.basis(places_mm_[coil]);
    past_[0].p_world_mm[coil] = combine(shape.C, basis.first, basis.value);
    past_[0].toward_tip[coil] = -combine(shape.C, basis.first, basis.first_derivative).normalized();
  }
}

// Of the tube at the coil, over the shortest time in which it has moved: over a longer one a tube that turns
// back seems slow. Along itself it goes with its speed, where that is known. Zero until it has moved: a still
// tube's shape drifts after its coils' errors, in the very direction in which they lie beside it, as if
// images came too late.
Eigen::Vector3d CoilImageModel::velocity_mm_s(int coil) const {
  const auto at = static_cast<std::size_t>(coil);
  for (int i = 1; i < past_count_; ++i) {
    const Places& before = past_[static_cast<std::size_t>(i)];
    const double age_s = seconds_between(before.instant, past_[0].instant);
    if (!(age_s > 0) || age_s > kVelocityOver_s) break;
    const Eigen::Vector3d moved_mm = past_[0].p_world_mm[at] - before.p_world_mm[at];
    const bool is_long_enough = age_s >= kMinVelocityOver_s || i == kPlaces - 1;
    if (is_long_enough && moved_mm.norm() > kMoved_mm) {
      const Eigen::Vector3d& along = past_[0].toward_tip[at];
      const Eigen::Vector3d mean_mm_s = moved_mm / age_s;
      const double mean_along_mm_s = along.dot(mean_mm_s);
      return mean_mm_s + (past_[0].speed_mm_s.value_or(mean_along_mm_s) - mean_along_mm_s) * along;
    }
  }
  return Eigen::Vector3d::Zero();
}

void CoilImageModel::add_registration(const Eigen::Vector3d& p_mm, const Eigen::Vector3d& side, double weight,
                                      Eigen::VectorXd& row) const {
  row.head<3>() += weight * side;
  row.segment<3>(kTurn) += weight * (p_mm - centre_mm_).cross(side);
}

void CoilImageModel::add_shared_errors(int coil, const Eigen::Vector3d& side, double weight,
                                       Eigen::VectorXd& row) const {
  row[kClock] += weight * side.dot(velocity_mm_s(coil));
  for (int k = 0; k <= coil; ++k) {
    row.segment<3>(shared_column(k)) += weight * neighbours_(coil, k) * side;
  }
}

// Along the tube a coil's own error looks like a wrong arc length: where that is too large the coil lies
// nearer to the tip. Its three numbers would be told by how the tube turns, in directions in which the shape
// follows.
void CoilImageModel::add_errors_along(int coil, const Eigen::Vector3d& toward_tip, double weight,
                                      Eigen::VectorXd& row) const {
  add_shared_errors(coil, toward_tip, weight, row);
  row[arc_length_column(coil)] += weight;
}

}  // namespace tubed
