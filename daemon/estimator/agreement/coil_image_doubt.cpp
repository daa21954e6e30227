#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "daemon/estimator/agreement/coil_image_agreement.hpp"
#include "idl/geometry/image_mask.hpp"
#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kEndSeen_mm = 0.6;  // nearer than that it is not known where the image has the end: 1 px
constexpr double kHeldFor_s = 1;

}  // namespace

// The registration's error by that explanation. Where it allows the registration as little as
// RoomErrors does (D), that is what it would be with the prior of what was never checked (D'): with
// covariance V and mean m of D, V' = (V^-1 - D^-2 + D'^-2)^-1 and m' = V' V^-1 m.
CoilImageAgreement::RegistrationError CoilImageAgreement::registration_error(
    const Explanation& explanation) const {
  RegistrationError error{explanation.registration, explanation.covariance};
  if (explanation.discord != Discord::kRegistration) {
    const double share = explanation.registration_share;
    Eigen::Matrix<double, 6, 1> change;
    change.head<3>().setConstant(1 / squared(errors_.unchecked_shift_mm) -
                                 1 / squared(share * errors_.shift_mm));
    change.tail<3>().setConstant(1 / squared(errors_.unchecked_turn_rad) -
                                 1 / squared(share * errors_.turn_rad));
    const Matrix6 information = error.covariance.inverse();
    const Eigen::LLT<Matrix6> unchecked(information + Matrix6(change.asDiagonal()));
    if (unchecked.info() == Eigen::Success) {
      error.mean = unchecked.solve(information * error.mean);
      error.covariance = unchecked.solve(Matrix6::Identity());
    }
  }
  return error;
}

// The same of a view's magnification, by itself.
double CoilImageAgreement::magnification_square(const Explanation& explanation, std::size_t view) const {
  const double mean = explanation.magnification[view];
  const double variance = explanation.magnification_variance[view];
  const bool is_explained_by_it =
      explanation.discord == Discord::kMagnification && static_cast<std::size_t>(explanation.index) == view;
  if (is_explained_by_it || variance <= 0) {
    return squared(mean) + variance;
  }
  const double unchecked =
      1 / (1 / variance - 1 / squared(errors_.magnification) + 1 / squared(errors_.unchecked_magnification));
  return squared(mean * unchecked / variance) + unchecked;
}

// What lies between coils and images may be the registration's error or that of a camera's pose: of one as
// good as of the other, where no calibration says more. Images hold the shape where the pose has it.
void CoilImageAgreement::doubt_poses() {
  pose_square_.setZero();
  const Explanation* off = nullptr;  // how far, were it one of the two
  for (const Explanation& explanation : explanations_) {
    if (explanation.discord != Discord::kRegistration) continue;
    if (off == nullptr || explanation.log_evidence > off->log_evidence) off = &explanation;
  }
  if (off == nullptr) return;
  Eigen::Matrix<double, 6, 1> of_pose = off->registration;
  of_pose.head<3>() *= std::sqrt(errors_.pose_share_of_shift);
  of_pose.tail<3>() *= std::sqrt(errors_.pose_share_of_turn);
  pose_square_ = of_pose * of_pose.transpose();
}

// Of the mixture of all explanations.
void CoilImageAgreement::take_moments() {
  registration_square_.setZero();
  field_square_mm2_ = 0;
  magnification_square_ = {};
  for (const Explanation& explanation : explanations_) {
    const RegistrationError error = registration_error(explanation);
    registration_square_ +=
        explanation.probability * (error.covariance + error.mean * error.mean.transpose());
    if (explanation.discord == Discord::kField) {
      field_square_mm2_ += explanation.probability * squared(kWrongField_mm);
    }
    for (std::size_t view = 0; view < magnification_square_.size(); ++view) {
      magnification_square_[view] += explanation.probability * magnification_square(explanation, view);
    }
  }
  doubt_poses();
}

// The registration's error at p is [I, -[p - c]x] (shift, turn). An image holds the point across its rays:
// with K the information of that, M becomes (K + M^-1)^-1 = M (I + K M)^-1. What the images' own poses are
// off by moves the point by the share of it that they hold, M K (I + M K)^-1 = I - ((I + K M)^-1)'.
Eigen::Matrix3d CoilImageAgreement::doubt(const Place& place, MonotonicTime now) const {
  const CoilImageModel& model = seen_.model();
  const Eigen::Vector3d& p_world_mm = place.p_world_mm;
  const Eigen::Vector3d r_mm =
      model.has_centre() ? Eigen::Vector3d(p_world_mm - model.centre_mm()) : Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
  J.leftCols<3>().setIdentity();
  J.rightCols<3>() << 0, r_mm.z(), -r_mm.y(), -r_mm.z(), 0, r_mm.x(), r_mm.y(), -r_mm.x(), 0;
  Eigen::Matrix3d M = J * registration_square_ * J.transpose() +
                      field_square_mm2_ * Eigen::Matrix3d::Identity() + place.coils_mm2;
  Eigen::Matrix3d K = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d scaled = Eigen::Matrix3d::Zero();
  const std::span<const CoilImageEvidence::SeenView> views = seen_.views();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const CoilImageEvidence::SeenView& view = views[i];
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
    K += (Eigen::Matrix3d::Identity() - ray * ray.transpose()) / squared(view.held.sigma_mm(place.s_mm));
    const Eigen::Vector3d lateral = lateral_mm(*view.camera, p_world_mm);
    scaled += magnification_square_[i] * lateral * lateral.transpose();
  }
  const Eigen::Matrix3d left_open = (Eigen::Matrix3d::Identity() + K * M).inverse();
  const Eigen::Matrix<double, 3, 6> by_pose = (Eigen::Matrix3d::Identity() - left_open).transpose() * J;
  M = M * left_open + by_pose * pose_square_ * by_pose.transpose();
  const double beyond_tip_mm = seen_.beyond_tip_mm();
  const double along_mm2 = std::max(squared(beyond_tip_mm) - squared(kEndSeen_mm), 0.0);
  return M + scaled + along_mm2 * place.tangent_world * place.tangent_world.transpose();
}

}  // namespace tubed
