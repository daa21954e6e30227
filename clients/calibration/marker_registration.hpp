// Registration by markers: the rigid transform from the tracker's frame to the world that takes touched
// markers onto the same markers in the world with the least squared distances, and how well it is known.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "clients/calibration/marker_pairs.hpp"
#include "drivers/interface/registration_quality.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// What a least-squares fit of two point sets left.
struct RigidFit {
  RigidTransform T_world_em = RigidTransform::Identity();
  double squared_residuals_mm2 = 0;  ///< their sum
};

/// Umeyama, "Least-squares estimation of transformation parameters between two point patterns", IEEE PAMI 13
/// (1991) 376-380, without scale. 3 x n both, n >= 3, not all on a line.
RigidFit fit_rigid(const Eigen::Matrix3Xd& p_world_mm, const Eigen::Matrix3Xd& p_em_mm);

/// The same with a mirror image of the touched points: what is left when one axis had the wrong sign.
double mirrored_squared_residuals_mm2(const Eigen::Matrix3Xd& p_world_mm, const Eigen::Matrix3Xd& p_em_mm);

/// A registration of n markers. FLE, FRE and TRE are those of Fitzpatrick, West and Maurer, "Predicting error
/// in rigid-body point-based registration", IEEE TMI 17 (1998) 694-702: root mean squares of lengths in 3D.
/// FLE is that of both frames together: of the touch and of the marker in the world.
struct MarkerRegistration {
  RigidTransform T_world_em = RigidTransform::Identity();
  Eigen::Matrix3Xd residual_world_mm;  ///< 3 x n: registered touch minus marker
  double fre_mm = 0;
  double fle_mm = 0;  ///< from the residuals, FRE^2 = (1 - 2/n) FLE^2, or as it was stated
  bool fle_stated = false;
  int degrees_of_freedom = 0;  ///< 3 n - 6
  /// Of a registered point about the true one, about the markers' centroid. Where FLE comes from the
  /// residuals the covariance is that of Student's t with that many degrees of freedom, which is nu / (nu -
  /// 2) times that of a known FLE: few markers know their own error badly.
  RegistrationQuality quality;
  Eigen::Vector3d centroid_world_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d scatter_mm2 =
      Eigen::Matrix3d::Zero();  ///< mean of q q^T, q = marker minus centroid, world axes

  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(residual_world_mm.cols()); }
  [[nodiscard]] double residual_mm(std::size_t marker) const {
    return residual_world_mm.col(static_cast<Eigen::Index>(marker)).norm();
  }
};

/// Registers `pairs`. `fle_mm`: what is known of FLE beforehand. Throws MarkerFileError for fewer than three
/// markers and for markers that all lie on a line (exactly: turns_too_freely() asks for more).
MarkerRegistration register_markers(const MarkerPairs& pairs, std::optional<double> fle_mm = std::nullopt);

/// Expected target registration error (TRE) at a point of the world, root mean square, mm: Fitzpatrick and
/// West, "The distribution of target registration error in rigid-body point-based registration", IEEE TMI 20
/// (2001) 917-927, TRE^2 = FLE^2 / n (1 + 1/3 sum_k d_k^2 / f_k^2) with the distances d_k of the point from
/// the principal axes of the markers and f_k the markers' own RMS distances from them.
double expected_tre_mm(const MarkerRegistration& registration, const Eigen::Vector3d& p_world_mm);

/// Standard deviation of the turn about the markers' longest axis, rad: what nearly collinear markers do not
/// know. A touch is never taken as better than 0.3 mm along each axis.
double freest_turn_rad(const MarkerRegistration& registration);

/// A marker against a registration of the others.
struct LeftOut {
  double error_mm = 0;  ///< distance of the registered touch from its marker
  /// Probability of an error as large if the marker is like the others: F test with 3 and 3 (n - 1) - 6
  /// degrees of freedom of the error's square in its own covariance; with a stated FLE chi-square of 3.
  double p_value = 1;
};

/// One of each marker; empty for three markers, of which none can be left out.
std::vector<LeftOut> leave_one_out(const MarkerPairs& pairs, std::optional<double> fle_mm = std::nullopt);

}  // namespace tubed
