// Intrinsics and poses of a camera from points that are known in space and found in images.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "idl/geometry/camera.hpp"

namespace tubed {

/// A point of the phantom as one image shows it.
struct CameraPoint {
  Eigen::Vector3d p_world_mm;
  double radius_mm = 0;  ///< of the ball around it, whose shadow's middle was found; 0: a point
  Eigen::Vector2d p_image_px;
  double sigma_px = 1;    ///< along either axis
  std::size_t point = 0;  ///< which of the phantom
};

/// One image: what was found on it, and about where it was taken from.
struct PointView {
  std::vector<CameraPoint> points;
  RigidTransform T_camera_world = RigidTransform::Identity();
};

/// Focal length and what else the images of one camera share.
struct Intrinsics {
  double fx = 0;                       ///< px
  double aspect = 1;                   ///< fy / fx
  double cx = 0, cy = 0;               ///< px
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3

  static constexpr int kNumbers = 9;  ///< in this order
};

/// What is fitted beside the poses. Focal length and principal point otherwise stay as they were given,
/// pixels are square, and there is no distortion.
struct IntrinsicsModel {
  bool focal = true;
  bool aspect = false;
  bool principal_point = false;
  int distortion_terms = 0;  ///< 0, 1 (k1), 2 (k1 k2), 4 (k1 k2 p1 p2) or 5
  /// Standard deviation of the principal point about where it was given, px: how well it is known before.
  /// Nothing: not at all. Counts with principal_point only.
  std::optional<double> principal_sigma_px;
  /// Standard deviations of fy / fx about 1 and of k1 k2 p1 p2 k3 about 0, as they are known before; nothing:
  /// not at all. Count for what is fitted.
  std::optional<double> aspect_sigma{};
  std::optional<std::array<double, 5>> distortion_sigma{};

  /// How many numbers that are.
  [[nodiscard]] int count() const {
    return (focal ? 1 : 0) + (aspect ? 1 : 0) + (principal_point ? 2 : 0) + distortion_terms;
  }
};

/// A pose and how well it is known: the true p_camera is p_camera + w x (p_camera - (0, 0, pivot)) + v.
struct FittedView {
  RigidTransform T_camera_world;
  double pivot_depth_mm = 0;                 ///< mean depth of the points
  Eigen::Matrix<double, 6, 6> covariance;    ///< of w (rad) and v (mm), with all that intrinsics leave open
  std::vector<Eigen::Vector2d> residual_px;  ///< found less projected, in the order of the points

  [[nodiscard]] Eigen::Vector3d sigma_rad() const { return covariance.diagonal().head<3>().cwiseSqrt(); }
  [[nodiscard]] Eigen::Vector3d sigma_mm() const { return covariance.diagonal().tail<3>().cwiseSqrt(); }
};

struct CameraFit {
  Intrinsics intrinsics;
  Eigen::Matrix<double, Intrinsics::kNumbers, Intrinsics::kNumbers> covariance;  ///< 0 where not fitted
  std::vector<FittedView> views;
  double rms_px = 0;  ///< distance of found from projected points
  double chi2 = 0;    ///< sum of squares in sigmas as they were given
  int degrees_of_freedom = 0;
  /// By how much residuals are larger than sigma_px said; the covariances allow for it.
  double noise_factor = 1;

  [[nodiscard]] double sigma_of(int number) const { return std::sqrt(covariance(number, number)); }
};

/// How residuals count.
enum class Residuals {
  kSquared,
  kRobust  ///< Cauchy's loss with two sigma: for correspondences that may be wrong
};

/// Least squares over all views by Levenberg's and Marquardt's method (Ceres), shared intrinsics and one pose
/// a view. Nothing when there are fewer numbers than unknowns, the fit does not converge to a camera with all
/// points in front of it, or the numbers asked for cannot be told apart from these views (the Jacobian's
/// condition exceeds 1e7).
std::optional<CameraFit> fit_camera(const Intrinsics& first, const std::vector<PointView>& views,
                                    const IntrinsicsModel& model, Residuals residuals = Residuals::kSquared);

/// The same without covariances (they stay 0): a step on the way.
std::optional<CameraFit> refine_camera(const Intrinsics& first, const std::vector<PointView>& views,
                                       const IntrinsicsModel& model, Residuals residuals);

/// As the configuration has it.
CameraCalibration calibration_of(const Intrinsics& intrinsics, const RigidTransform& T_camera_world);

/// Where the middle of a ball's shadow lies: the silhouette of a sphere around (x, y, z) with radius R is the
/// ellipse whose middle is the projection of (x, y, z - R^2 / z). Nothing behind the camera.
std::optional<Eigen::Vector2d> project_ball(const Camera& camera, const Eigen::Vector3d& p_world_mm,
                                            double radius_mm);

}  // namespace tubed
