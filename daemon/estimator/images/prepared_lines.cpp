#include "daemon/estimator/images/prepared_lines.hpp"

#include <cmath>

#include "daemon/image/correspondence_lines.hpp"
#include "drivers/interface/room.hpp"
#include "idl/estimate.hpp"

namespace tubed {

PreparedLines::PreparedLines() {
  views_.reserve(kMaxCameras);
  // Written once, so that no page of it is new to a real-time thread.
  lines_.resize(static_cast<std::size_t>(kMaxCameras) * (LineSearch::kMaxLines + kMaxMarks + 1));
  lines_.clear();
  reserve(lines_.capacity());
}

// What a kernel reads or writes beyond its last line belongs to the next view, which comes later, or to
// nobody.
void PreparedLines::reserve(std::size_t count) {
  for (auto& values : points_) values.resize(count + kLineLanes);
  for (auto& values : targets_) values.resize(count + kLineLanes);
  for (auto& values : residuals_) values.resize(count + kLineLanes);
}

void PreparedLines::prepare(std::span<const ViewConstraints> views, const UniformCubicBSpline& spline) {
  views_.clear();
  lines_.clear();
  for (const ViewConstraints& view : views) {
    const auto count = static_cast<std::size_t>(view.count);
    if (count == 0) continue;
    const std::size_t begin = lines_.size();
    views_.push_back({LineCamera(view.camera->calibration()), view.pose_sigma, begin, count});
    if (begin + count + kLineLanes > points_[0].size()) reserve(begin + count);
    for (std::size_t i = 0; i < count; ++i) {
      const LineConstraint& line = view.lines[i];
      const CubicBasis basis = spline.basis(line.s_mm);
      lines_.push_back({basis.first, basis.value});
      // r = n . (pi(zeta(s)) - target) / sqrt(v): the normal and its product with the target, whitened.
      const Eigen::Vector2d normal = line.normal / std::sqrt(line.variance_px2);
      targets_[0][begin + i] = normal.x();
      targets_[1][begin + i] = normal.y();
      targets_[2][begin + i] = normal.dot(line.target_px);
    }
  }
}

void PreparedLines::project(const View& view, const Eigen::Matrix3Xd& C) {
  const std::size_t begin = view.begin;
  for (std::size_t i = begin; i < begin + view.count; ++i) {
    const Eigen::Vector3d p_world_mm = combine(C, lines_[i].first, lines_[i].weights);
    points_[0][i] = p_world_mm.x();
    points_[1][i] = p_world_mm.y();
    points_[2][i] = p_world_mm.z();
  }
  auto& [residual, gradient_x, gradient_y, gradient_z] = residuals_;
  project_to_lines(view.camera,
                   {view.count, &points_[0][begin], &points_[1][begin], &points_[2][begin],
                    &targets_[0][begin], &targets_[1][begin], &targets_[2][begin]},
                   {&residual[begin], &gradient_x[begin], &gradient_y[begin], &gradient_z[begin]});
}

// How the residual of a line goes with an error of the pose, in standard deviations: by w, then by v of
// PoseSigma.
SharedError::Parts PreparedLines::by_pose(const View& view, std::size_t line) const {
  const Eigen::Vector3d p_world_mm(points_[0][line], points_[1][line], points_[2][line]);
  const PoseSigma& sigma = view.pose_sigma;
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> T(view.camera.T_camera_world.data());
  const Eigen::Vector3d by_p_camera = T.leftCols<3>() * gradient(line);
  const Eigen::Vector3d from_pivot_mm =
      T * p_world_mm.homogeneous() - sigma.pivot_depth_mm * Eigen::Vector3d::UnitZ();
  // g . (w x d) = w . (d x g)
  SharedError::Parts parts;
  parts << from_pivot_mm.cross(by_p_camera)
               .cwiseProduct(Eigen::Map<const Eigen::Vector3d>(sigma.rotation_rad.data())),
      by_p_camera.cwiseProduct(Eigen::Map<const Eigen::Vector3d>(sigma.translation_mm.data()));
  return parts;
}

}  // namespace tubed
