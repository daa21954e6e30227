// How much of a camera's model the points ask for, and which of them belong to it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/camera_fit.hpp"

namespace tubed {

/// What is known of a camera before its points are looked at.
struct CameraPrior {
  int width = 0;                   ///< px
  int height = 0;                  ///< px
  std::optional<double> focal_px;  ///< holds it there
  /// The principal point is about the image's middle: standard deviation as a share of the width. A detector
  /// is mounted that well; an image that is cropped to one side is not.
  double principal_sigma = 0.015;
  /// Distortion is about 0: standard deviations of what k1, k2 and k3 move the image's corner by, as shares
  /// of its distance from the middle, of p1 and p2 as they are, and of fy / fx about 1.
  std::array<double, 3> radial_sigma{0.05, 0.02, 0.01};
  double tangential_sigma = 0.005;
  double aspect_sigma = 0.02;
  bool may_distort = true;  ///< fits distortion where it is significant
};

/// A point that no longer counts.
struct LeftOutPoint {
  std::size_t view;
  CameraPoint point;
  double residual_px;
};

struct ChosenFit {
  IntrinsicsModel model;
  CameraFit fit;
  std::vector<PointView> views;  ///< the points that counted, in the order of fit.views' residuals
  std::vector<LeftOutPoint> left_out;
  /// The points know the principal point no better than the prior does.
  bool is_principal_point_held = false;
  /// Standard deviations between the principal point and the image's middle, as the prior counts.
  double principal_offset_in_sigmas = 0;
};

/// Fits a camera without distortion, or where the points contradict that (likelihood ratio, 2 %) one with all
/// of it and with what `prior` knows of each number: a term that points hardly tell is then not held at 0 but
/// left as open as it is, so that the covariances of principal point and poses, which can take its place,
/// have it in. Leaves out points that are off by more than 4.5 robust standard deviations. Nothing when not
/// even the plainest model can be fitted.
std::optional<ChosenFit> choose_fit(const Intrinsics& first, const std::vector<PointView>& views,
                                    const CameraPrior& prior);

/// A pattern in the residuals that the model cannot take up.
struct ResidualPattern {
  /// Correlation of neighbouring points' residuals, and what chance allows (4 standard deviations).
  double neighbour_correlation = 0;
  double correlation_limit = 1;
  /// S distortion, a turn that grows with the square of the distance from the middle (image intensifiers):
  /// displacement at the edge of the points, and its ratio to its standard deviation.
  double s_distortion_px = 0;
  double s_distortion_in_sigmas = 0;

  [[nodiscard]] bool is_systematic() const { return neighbour_correlation > correlation_limit; }
  [[nodiscard]] bool has_s_distortion() const;
};
ResidualPattern residual_pattern(const ChosenFit& chosen);

/// The largest displacement by distortion within the image, px.
double largest_distortion_px(const Intrinsics& intrinsics, int width, int height);

/// Part of the image within the convex hull of the points of all views.
double covered_share(const ChosenFit& chosen, int width, int height);

}  // namespace tubed
