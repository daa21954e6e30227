// What does one image say of the pose of its view, when the shape of the tube is known without it?
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "daemon/estimator/view/view_pose.hpp"
#include "daemon/image/projected_lines.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// What is left of a point's covariance without what all of the tube is off by together, `shared_mm2` an
/// axis, such as a registration: a pose that is found has that, and a line by itself does not. A fifth stays
/// along each axis at least.
Eigen::Matrix3d own_part(const Eigen::Matrix3d& covariance_mm2, double shared_mm2);

/// TubeViews measures around the projection of a shape that is known without the image; where it finds the
/// tube, and its end, they correct a pose by an iterated Kalman update. The shape's errors last and are
/// shared along the tube: lines within 40 mm of it count as one. Called by the optimizer thread; memory is
/// taken in the constructor.
class PoseMatcher {
 public:
  PoseMatcher(const EstimatorSettings& settings, const InstrumentDescription& instrument,
              const CameraCalibration& camera);

  /// The shape that images are held against from now on. False, and nothing can be held against it, where the
  /// estimate has none, or does not say how sure it is.
  bool take_shape(const TubeEstimate& shape);
  /// Of that shape, at each line, tip first, mm, world.
  [[nodiscard]] const Eigen::Matrix3Xd& points_mm() const { return points_mm_; }
  /// How much of that shape a view with such a pose has in its picture, 0 .. 1.
  [[nodiscard]] double share_in_view(const ViewPose& pose);
  /// As many as points_mm() has columns.
  [[nodiscard]] Eigen::Index line_count() const { return layout_.count; }

  /// `prior`: where the search begins, with the covariance of what is known; `expected`: the error of that
  /// pose by what is known. An image counts as the share `news` of a new one.
  [[nodiscard]] PoseMatch match(const MovedImage& moved, const ViewPose& prior, double news,
                                const ViewPose::Error& expected = ViewPose::Error::Zero());

  /// The images before are no history of the ones to come.
  void forget() { views_.forget(); }

 private:
  /// sum (o_i - H_i e)^2 / R_i = squares - 2 b^T e + e^T N e.
  struct LeastSquares {
    ViewPose::Covariance N = ViewPose::Covariance::Zero();
    ViewPose::Error b = ViewPose::Error::Zero();
    double squares = 0;
  };

  const ViewConstraints* look(const MovedImage& moved, const ViewPose& pose, int reach_px);
  [[nodiscard]] LeastSquares linearise(const ViewConstraints& view, const ViewPose& pose,
                                       const ViewPose::Error& e, double news) const;
  [[nodiscard]] int reach_px(const ViewPose& pose) const;
  [[nodiscard]] std::size_t place_of(double s_mm) const;

  std::array<UniformCubicBSpline, 2> splines_;   ///< that shapes may have: of straight tubes, and of hooks
  const UniformCubicBSpline* spline_ = nullptr;  ///< that of the newest shape
  LineLayout layout_;
  Camera camera_;    ///< with the pose of what is asked
  TubeViews views_;  ///< of this camera alone
  Observation looked_at_;
  std::unique_ptr<TubeEstimate> scratch_;    ///< what TubeViews writes
  Eigen::Matrix3Xd C_;                       ///< of the shape
  Eigen::Matrix3Xd points_mm_;               ///< of the shape, at each line
  std::vector<Eigen::Matrix3d> covariance_;  ///< of each of them, mm^2
};

}  // namespace tubed
