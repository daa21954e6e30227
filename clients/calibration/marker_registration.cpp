#include "clients/calibration/marker_registration.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "clients/calibration/tail_probability.hpp"

namespace tubed {

namespace {

constexpr double kMinTouch_mm = 0.3;   ///< along an axis: a hand and a tracker do no better
constexpr double kMinSigma_mm = 0.02;  ///< likewise, for exact numbers of a drawing: nothing divides by zero

/// Sum of |q|^2 I - q q^T over the markers: their inertia about the centroid, mm^2. Its inverse times the
/// variance of a marker along an axis is the covariance of the turn.
Eigen::Matrix3d inertia_mm2(const MarkerRegistration& registration) {
  const Eigen::Matrix3d& scatter_mm2 = registration.scatter_mm2;
  return static_cast<double>(registration.size()) *
         (scatter_mm2.trace() * Eigen::Matrix3d::Identity() - scatter_mm2);
}

/// Covariance of (turn, shift) about the centroid for markers that are off by N(0, sigma^2) along each axis:
/// the normal equations of the linearised fit, whose blocks do not mix about the centroid.
RegistrationCovariance covariance_of(const MarkerRegistration& registration, double sigma2_mm2) {
  RegistrationCovariance covariance = RegistrationCovariance::Zero();
  covariance.topLeftCorner<3, 3>() = sigma2_mm2 * inertia_mm2(registration).inverse();
  covariance.bottomRightCorner<3, 3>() =
      sigma2_mm2 / static_cast<double>(registration.size()) * Eigen::Matrix3d::Identity();
  return covariance;
}

double sigma2_of(double fle_mm) { return fle_mm * fle_mm / 3; }

bool lies_on_a_line(const Eigen::Matrix3d& scatter_mm2) {
  const Eigen::Vector3d spread_mm2 =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter_mm2, Eigen::EigenvaluesOnly).eigenvalues();
  return spread_mm2(1) <= 1e-9 * std::max(spread_mm2(2), 1.0);
}

Eigen::Matrix3d scatter_of(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  return centred * centred.transpose() / static_cast<double>(points.cols());
}

}  // namespace

RigidFit fit_rigid(const Eigen::Matrix3Xd& p_world_mm, const Eigen::Matrix3Xd& p_em_mm) {
  RigidFit fit;
  fit.T_world_em = RigidTransform(Eigen::umeyama(p_em_mm, p_world_mm, false));
  fit.squared_residuals_mm2 = ((fit.T_world_em * p_em_mm) - p_world_mm).squaredNorm();
  return fit;
}

double mirrored_squared_residuals_mm2(const Eigen::Matrix3Xd& p_world_mm, const Eigen::Matrix3Xd& p_em_mm) {
  Eigen::Matrix3Xd mirrored_mm = p_em_mm;
  mirrored_mm.row(0) *= -1;
  return fit_rigid(p_world_mm, mirrored_mm).squared_residuals_mm2;
}

MarkerRegistration register_markers(const MarkerPairs& pairs, std::optional<double> fle_mm) {
  if (pairs.size() < 3) {
    throw MarkerFileError("a registration needs three markers that are in both files, there are " +
                          std::to_string(pairs.size()) + ": touch more of them, better six than three");
  }
  MarkerRegistration registration;
  registration.centroid_world_mm = pairs.p_world_mm.rowwise().mean();
  registration.scatter_mm2 = scatter_of(pairs.p_world_mm);
  if (lies_on_a_line(registration.scatter_mm2) || lies_on_a_line(scatter_of(pairs.p_em_mm))) {
    throw MarkerFileError(
        "the markers lie on one line, about which the room could be turned at will: use markers that are "
        "spread "
        "over a volume");
  }
  const RigidFit fit = fit_rigid(pairs.p_world_mm, pairs.p_em_mm);
  const auto n = static_cast<double>(pairs.size());
  registration.T_world_em = fit.T_world_em;
  registration.residual_world_mm = (fit.T_world_em * pairs.p_em_mm) - pairs.p_world_mm;
  registration.fre_mm = std::sqrt(fit.squared_residuals_mm2 / n);
  registration.degrees_of_freedom = 3 * static_cast<int>(pairs.size()) - 6;
  registration.fle_stated = fle_mm.has_value();
  registration.fle_mm = fle_mm.value_or(registration.fre_mm / std::sqrt(1 - 2 / n));
  const double nu = registration.degrees_of_freedom;
  const double widening = fle_mm ? 1 : nu / (nu - 2);
  registration.quality.centre_world_mm = registration.centroid_world_mm;
  registration.quality.covariance = covariance_of(registration, widening * sigma2_of(registration.fle_mm));
  return registration;
}

double expected_tre_mm(const MarkerRegistration& registration, const Eigen::Vector3d& p_world_mm) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(registration.scatter_mm2);
  const Eigen::Vector3d spread_mm2 = principal.eigenvalues();
  const Eigen::Vector3d place_mm =
      principal.eigenvectors().transpose() * (p_world_mm - registration.centroid_world_mm);
  double sum = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double d2 = place_mm.squaredNorm() - place_mm(k) * place_mm(k);
    const double f2 = spread_mm2.sum() - spread_mm2(k);
    sum += d2 / f2;
  }
  const auto n = static_cast<double>(registration.size());
  return registration.fle_mm * std::sqrt((1 + sum / 3) / n);
}

double freest_turn_rad(const MarkerRegistration& registration) {
  const double sigma2_mm2 = std::max(sigma2_of(registration.fle_mm), kMinTouch_mm * kMinTouch_mm);
  const Eigen::Matrix3d turn_rad2 = covariance_of(registration, sigma2_mm2).topLeftCorner<3, 3>();
  return std::sqrt(
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turn_rad2, Eigen::EigenvaluesOnly).eigenvalues()(2));
}

std::vector<LeftOut> leave_one_out(const MarkerPairs& pairs, std::optional<double> fle_mm) {
  std::vector<LeftOut> all;
  for (std::size_t i = 0; pairs.size() > 3 && i < pairs.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const MarkerPairs others = pairs.without(i);
    LeftOut& left_out = all.emplace_back();
    if (lies_on_a_line(scatter_of(others.p_world_mm)) || lies_on_a_line(scatter_of(others.p_em_mm))) {
      continue;  // the others say nothing of this one
    }
    const MarkerRegistration registration = register_markers(others, fle_mm);
    const Eigen::Vector3d error_mm =
        registration.T_world_em * pairs.p_em_mm.col(column) - pairs.p_world_mm.col(column);
    const double sigma2_mm2 = std::max(sigma2_of(registration.fle_mm), kMinSigma_mm * kMinSigma_mm);
    RegistrationQuality known = registration.quality;
    known.covariance = covariance_of(registration, sigma2_mm2);
    // the marker's own error and that of the registration where it is
    const Eigen::Matrix3d covariance_mm2 =
        sigma2_mm2 * Eigen::Matrix3d::Identity() +
        known.covariance_at(pairs.p_world_mm.col(column)).bottomRightCorner<3, 3>();
    const double squared = error_mm.dot(covariance_mm2.inverse() * error_mm);
    left_out.error_mm = error_mm.norm();
    left_out.p_value = fle_mm ? chi_square_tail(squared, 3)
                              : f_tail(squared / 3, 3, static_cast<double>(registration.degrees_of_freedom));
  }
  return all;
}

}  // namespace tubed
