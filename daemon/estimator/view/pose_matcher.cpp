#include "daemon/estimator/view/pose_matcher.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "daemon/estimator/tip/preshaped_estimator.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

namespace {

constexpr double kShare_mm = 40;  // of the tube, within which the shape's error is one
constexpr int kMinLines = 25;
constexpr double kMinAgreeing = 0.6;
constexpr int kIterations = 4;
constexpr double kConverged = 0.1;  // of its standard deviation, what an iteration still changes
constexpr int kMinReach_px = 8;
constexpr int kNextReach_px = 12;  // of the iterations after the first
constexpr double kMinOwnShare = 0.2;

Eigen::Matrix3d symmetric(const std::array<float, 6>& upper) {
  const auto& u = upper;
  Eigen::Matrix3d m;
  m << u[0], u[1], u[2], u[1], u[3], u[4], u[2], u[4], u[5];
  return m;
}

RoomDescription room_of(const CameraCalibration& camera) {
  RoomDescription room;
  room.cameras = {camera};
  return room;
}

/// An image with another geometry for as long as this lives.
class LentGeometry {
 public:
  LentGeometry(ImageMeasurement& image, const ViewGeometry& geometry) : image_(image), own_(image.geometry) {
    image_.geometry = geometry;
  }
  ~LentGeometry() { image_.geometry = own_; }
  LentGeometry(const LentGeometry&) = delete;
  LentGeometry& operator=(const LentGeometry&) = delete;

 private:
  ImageMeasurement& image_;
  std::optional<ViewGeometry> own_;
};

}  // namespace

Eigen::Matrix3d own_part(const Eigen::Matrix3d& covariance_mm2, double shared_mm2) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(covariance_mm2);
  const Eigen::Array3d all_mm2 = axes.eigenvalues();
  const Eigen::Vector3d own_mm2 = (all_mm2 - shared_mm2).max(kMinOwnShare * all_mm2);
  return axes.eigenvectors() * own_mm2.asDiagonal() * axes.eigenvectors().transpose();
}

PoseMatcher::PoseMatcher(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                         const CameraCalibration& camera)
    : splines_{UniformCubicBSpline(settings.coefficient_count, instrument.length_mm),
               UniformCubicBSpline(
                   PreshapedEstimator::settings_for_hooks(settings, instrument.length_mm).coefficient_count,
                   instrument.length_mm)},
      layout_(instrument.length_mm),
      camera_(camera),
      views_(settings, instrument, room_of(camera)),
      scratch_(std::make_unique<TubeEstimate>()),
      C_(3, splines_[1].coefficient_count()),
      points_mm_(3, layout_.count),
      covariance_(static_cast<std::size_t>(layout_.count)) {}

// False without one.
bool PoseMatcher::take_shape(const TubeEstimate& shape) {
  const auto of_shape = std::ranges::find_if(splines_, [&](const UniformCubicBSpline& spline) {
    return static_cast<std::uint32_t>(spline.coefficient_count()) == shape.coefficient_count;
  });
  const bool has_shape = shape.point_count > 0 && shape.validity != Validity::kInvalid;
  if (of_shape == splines_.end() || !has_shape) return false;
  spline_ = &*of_shape;
  for (Eigen::Index i = 0; i < spline_->coefficient_count(); ++i) {
    C_.col(i) = Eigen::Map<const Eigen::Vector3d>(shape.coefficients_mm[static_cast<std::size_t>(i)].data());
  }
  const double shared_mm2 = static_cast<double>(shape.agreement.unsure_mm * shape.agreement.unsure_mm) / 3;
  const double last_point = static_cast<double>(shape.point_count) - 1;
  for (int i = 0; i < layout_.count; ++i) {
    const CubicBasis basis = spline_->basis(layout_.s_mm(i));
    points_mm_.col(i) = combine(C_, basis.first, basis.value);
    const double place = std::round(layout_.s_mm(i) / static_cast<double>(shape.length_mm) * last_point);
    const auto point = static_cast<std::size_t>(std::clamp(place, 0.0, last_point));
    const Eigen::Matrix3d published_mm2 = symmetric(shape.points[point].covariance_mm2);
    if (!published_mm2.allFinite()) return false;
    covariance_[static_cast<std::size_t>(i)] = own_part(published_mm2, shared_mm2);
  }
  return true;
}

// Three standard deviations, of the line that is known worst.
int PoseMatcher::reach_px(const ViewPose& pose) const {
  double worst_px2 = 0;
  const RigidTransform T = pose.geometry().T_camera_world();
  for (int i = 0; i < layout_.count; i += 4) {
    const double depth_mm = (T * points_mm_.col(i)).z();
    const double px_mm = pose.geometry().fx / std::max(depth_mm, 1.0);
    const Eigen::Matrix3d across =
        pose.covariance_across(points_mm_.col(i)) + covariance_[static_cast<std::size_t>(i)];
    worst_px2 = std::max(worst_px2, px_mm * px_mm * across.trace() / 2);
  }
  return static_cast<int>(
      std::clamp(3 * std::sqrt(worst_px2), double{kMinReach_px}, double{LineSearch::kMaxReach}));
}

double PoseMatcher::share_in_view(const ViewPose& pose) {
  camera_.look_from(pose.geometry());
  const auto is_in_view = [this](const auto& p_mm) {
    const std::optional<Projection> projected = camera_.project(p_mm);
    return projected && camera_.contains(projected->p_image_px);
  };
  Eigen::Index in_view = 0;
  for (Eigen::Index i = 0; i < points_mm_.cols(); ++i) in_view += is_in_view(points_mm_.col(i)) ? 1 : 0;
  return static_cast<double>(in_view) / static_cast<double>(points_mm_.cols());
}

std::size_t PoseMatcher::place_of(double s_mm) const {
  return static_cast<std::size_t>(std::clamp(std::lround(s_mm / layout_.spacing_mm), 0L, layout_.count - 1L));
}

// Where the image shows the tube, seen from that pose; nullptr: nowhere near.
const ViewConstraints* PoseMatcher::look(const MovedImage& moved, const ViewPose& pose, int reach_px) {
  const LentGeometry lent(*moved.image, pose.geometry());
  looked_at_.instant = looked_at_.now = moved.image->exposure;
  looked_at_.image_timeout = std::chrono::milliseconds(1);
  looked_at_.images[0] = moved.image;
  looked_at_.on_demand[0] = moved.on_demand;
  views_.measure(looked_at_, *spline_, C_, {.reach_px = reach_px}, *scratch_);
  const auto views = views_.constraints(looked_at_, 1, true);
  const bool is_seen =
      !views.empty() && views[0].count >= kMinLines && scratch_->image_inlier_ratio >= kMinAgreeing;
  return is_seen ? views.data() : nullptr;
}

// A line's distance is o_i = H_i e + noise of variance R_i, H_i = (J_image_camera^T n)^T jacobian(p_camera).
// `e` is the error that `pose` has taken in already.
PoseMatcher::LeastSquares PoseMatcher::linearise(const ViewConstraints& view, const ViewPose& pose,
                                                 const ViewPose::Error& e, double news) const {
  const double lines_a_share = std::max(1.0, kShare_mm / layout_.spacing_mm);
  const RigidTransform T = pose.geometry().T_camera_world();
  LeastSquares sum;
  for (int i = 0; i < view.count; ++i) {
    const LineConstraint& line = view.lines[i];
    const std::size_t place = place_of(line.s_mm);
    const Eigen::Vector3d p_world_mm = points_mm_.col(static_cast<Eigen::Index>(place));
    const auto here = view.camera->project(p_world_mm);
    if (!here) continue;
    const Eigen::Vector3d gradient_world = here->J_image_world.transpose() * line.normal;
    const Eigen::Matrix<double, 1, 6> H =
        (T.linear() * gradient_world).transpose() * pose.jacobian(T * p_world_mm);
    const double shape_px2 = gradient_world.dot(covariance_[place] * gradient_world);
    const bool is_end = line.s_mm == 0 && i + 1 == view.count;  // of which there is one
    const double R = (shape_px2 + line.variance_px2) * (is_end ? 1 : lines_a_share) / news;
    const double off_px = line.normal.dot(line.target_px - here->p_image_px) + H * e;
    sum.N += H.transpose() * H / R;
    sum.b += H.transpose() * (off_px / R);
    sum.squares += off_px * off_px / R;
  }
  return sum;
}

// Iterated update of a Gaussian of mean m and covariance P. With N = P^-1 + sum H_i^T H_i / R_i its evidence
// is
//   log p(o) = -1/2 (sum (o_i - H_i e)^2 / R_i + (e - m)^T P^-1 (e - m) + log |P N|) + const.
PoseMatch PoseMatcher::match(const MovedImage& moved, const ViewPose& prior, double news,
                             const ViewPose::Error& expected) {
  const ViewPose::Covariance information = prior.covariance().inverse();
  const ViewPose::Error known = information * expected;
  int reach = reach_px(prior);
  PoseMatch found;
  ViewPose::Error e = ViewPose::Error::Zero();
  ViewPose::Covariance P;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    found.pose = prior.with_error(e);
    const ViewConstraints* const view = look(moved, found.pose, reach);
    if (view == nullptr) return found;
    const LeastSquares lines = linearise(*view, found.pose, e, news);
    const ViewPose::Covariance N = information + lines.N;
    P = N.inverse();
    const ViewPose::Error b = lines.b + known;
    const ViewPose::Error next = P * b;
    const double change = (next - e).cwiseQuotient(P.diagonal().cwiseSqrt()).norm();
    e = next;
    found.log_evidence = -0.5 * (lines.squares + expected.dot(known) - b.dot(e) +
                                 std::log(prior.covariance().determinant()) + std::log(N.determinant()));
    if (change < kConverged) break;
    reach = std::min(reach, kNextReach_px);
  }
  found.pose = prior.with_error(e);
  found.pose.set_covariance(P);
  found.is_found = true;
  return found;
}

}  // namespace tubed
