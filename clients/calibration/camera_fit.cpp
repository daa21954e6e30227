#include "clients/calibration/camera_fit.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr int kPose = 6;
enum Number { kFx, kAspect, kCx, kCy, kK1, kK2, kP1, kP2, kK3 };
using IntrinsicNumbers = std::array<double, Intrinsics::kNumbers>;
using PoseNumbers = std::array<double, kPose>;  // w (rad), v (mm) as FittedView has them

IntrinsicNumbers numbers_of(const Intrinsics& i) {
  const auto& [k1, k2, p1, p2, k3] = i.distortion;
  return {i.fx, i.aspect, i.cx, i.cy, k1, k2, p1, p2, k3};
}

Intrinsics intrinsics_of(const IntrinsicNumbers& n) {
  return {n[kFx], n[kAspect], n[kCx], n[kCy], {n[kK1], n[kK2], n[kP1], n[kP2], n[kK3]}};
}

/// A small turn about (0, 0, pivot) and a shift of what is in the camera frame.
template <typename T>
void moved(const T* move, const Eigen::Vector3d& p_camera_mm, double pivot_mm, T* p) {
  const T from_pivot[3] = {T(p_camera_mm.x()), T(p_camera_mm.y()), T(p_camera_mm.z() - pivot_mm)};
  ceres::AngleAxisRotatePoint(move, from_pivot, p);
  p[0] += move[3];
  p[1] += move[4];
  p[2] += move[5] + T(pivot_mm);
}

/// Found less projected, in sigmas; OpenCV's camera model as idl/geometry/camera.cpp has it.
struct PointResidual {
  Eigen::Vector3d p_camera_mm;  ///< with the pose from which the fit starts
  double pivot_mm;
  double radius_mm;
  Eigen::Vector2d p_image_px;
  double sigma_px;
  IntrinsicNumbers unit;  ///< of the intrinsics

  template <typename T>
  bool operator()(const T* in_units, const T* move, T* residual) const {
    T intrinsics[Intrinsics::kNumbers];
    for (std::size_t i = 0; i < unit.size(); ++i) intrinsics[i] = in_units[i] * unit[i];
    T p[3];
    moved(move, p_camera_mm, pivot_mm, p);
    const T depth = p[2] - radius_mm * radius_mm / p[2];  // project_ball()
    if (!(depth > T(1.0))) return false;
    const T x = p[0] / depth;
    const T y = p[1] / depth;
    const T r2 = x * x + y * y;
    const T radial = T(1) + r2 * (intrinsics[kK1] + r2 * (intrinsics[kK2] + r2 * intrinsics[kK3]));
    const T u = x * radial + T(2) * intrinsics[kP1] * x * y + intrinsics[kP2] * (r2 + T(2) * x * x);
    const T v = y * radial + intrinsics[kP1] * (r2 + T(2) * y * y) + T(2) * intrinsics[kP2] * x * y;
    residual[0] = (T(p_image_px.x()) - intrinsics[kCx] - intrinsics[kFx] * u) / sigma_px;
    residual[1] =
        (T(p_image_px.y()) - intrinsics[kCy] - intrinsics[kFx] * intrinsics[kAspect] * v) / sigma_px;
    return true;
  }
};

struct PrincipalPrior {
  double cx, cy, sigma_px;
  template <typename T>
  bool operator()(const T* intrinsics, T* residual) const {
    residual[0] = (intrinsics[kCx] - cx) / sigma_px;
    residual[1] = (intrinsics[kCy] - cy) / sigma_px;
    return true;
  }
};

/// What is known of one of the intrinsics before.
struct NumberPrior {
  std::size_t number;
  double mean, sigma;  ///< in units of the number
  template <typename T>
  bool operator()(const T* intrinsics, T* residual) const {
    residual[0] = (intrinsics[number] - mean) / sigma;
    return true;
  }
};

/// Terms of distortion differ by powers of ten: each is counted in its prior's standard deviations, so that
/// the normal equations have one scale.
IntrinsicNumbers units_of(const IntrinsicsModel& model) {
  IntrinsicNumbers unit;
  unit.fill(1);
  if (model.distortion_sigma) {
    std::copy(model.distortion_sigma->begin(), model.distortion_sigma->end(), unit.begin() + kK1);
  }
  return unit;
}

IntrinsicNumbers in_units(IntrinsicNumbers numbers, const IntrinsicNumbers& unit) {
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] /= unit[i];
  return numbers;
}

IntrinsicNumbers from_units(IntrinsicNumbers numbers, const IntrinsicNumbers& unit) {
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] *= unit[i];
  return numbers;
}

/// Without what the model does not have.
Intrinsics within(Intrinsics first, const IntrinsicsModel& model) {
  if (!model.aspect) first.aspect = 1;
  std::fill(first.distortion.begin() + model.distortion_terms, first.distortion.end(), 0.0);
  return first;
}

std::vector<int> constant_numbers(const IntrinsicsModel& model) {
  std::vector<int> constant;
  if (!model.focal) constant.push_back(kFx);
  if (!model.aspect) constant.push_back(kAspect);
  if (!model.principal_point) {
    constant.push_back(kCx);
    constant.push_back(kCy);
  }
  for (int term = model.distortion_terms; term < 5; ++term) constant.push_back(kK1 + term);
  return constant;
}

double mean_depth_mm(const PointView& view) {
  double sum = 0;
  for (const CameraPoint& point : view.points) sum += (view.T_camera_world * point.p_world_mm).z();
  return sum / static_cast<double>(view.points.size());
}

/// One fit under way.
class Fit {
 public:
  Fit(const Intrinsics& first, const std::vector<PointView>& views, const IntrinsicsModel& model,
      Residuals residuals, double noise_factor)
      : views_(views),
        model_(model),
        unit_(units_of(model)),
        intrinsics_(in_units(numbers_of(within(first, model)), unit_)),
        moves_(views.size()) {
    ceres::LossFunction* const loss = residuals == Residuals::kRobust ? new ceres::CauchyLoss(2.0) : nullptr;
    for (std::size_t i = 0; i < views.size(); ++i) {
      pivots_mm_.push_back(mean_depth_mm(views[i]));
      for (const CameraPoint& point : views[i].points) {
        problem_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<PointResidual, 2, Intrinsics::kNumbers, kPose>(
                new PointResidual{views[i].T_camera_world * point.p_world_mm, pivots_mm_[i], point.radius_mm,
                                  point.p_image_px, point.sigma_px * noise_factor, unit_}),
            loss, intrinsics_.data(), moves_[i].data());
      }
    }
    if (model.principal_point && model.principal_sigma_px) {
      problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<PrincipalPrior, 2, Intrinsics::kNumbers>(
                                    new PrincipalPrior{first.cx, first.cy, *model.principal_sigma_px}),
                                nullptr, intrinsics_.data());
    }
    if (model.aspect && model.aspect_sigma) know(kAspect, 1, *model.aspect_sigma);
    for (int term = 0; term < model.distortion_terms && model.distortion_sigma; ++term) {
      know(static_cast<Number>(kK1 + term), 0, 1);
    }
    const std::vector<int> constant = constant_numbers(model);
    if (constant.size() == Intrinsics::kNumbers) {
      problem_.SetParameterBlockConstant(intrinsics_.data());
    } else if (!constant.empty()) {
      problem_.SetManifold(intrinsics_.data(), new ceres::SubsetManifold(Intrinsics::kNumbers, constant));
    }
    if (model.focal) problem_.SetParameterLowerBound(intrinsics_.data(), kFx, 1.0);
  }

  bool solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_QR;
    options.max_num_iterations = 200;
    options.function_tolerance = 1e-12;
    options.parameter_tolerance = 1e-10;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  [[nodiscard]] CameraFit result() const {
    CameraFit fit;
    fit.intrinsics = intrinsics_of(from_units(intrinsics_, unit_));
    fit.covariance.setZero();
    int count = 0;
    double squares_px2 = 0;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      fit.views.push_back(fitted(i));
      for (std::size_t k = 0; k < views_[i].points.size(); ++k) {
        const double square_px2 = fit.views[i].residual_px[k].squaredNorm();
        squares_px2 += square_px2;
        fit.chi2 += square_px2 / std::pow(views_[i].points[k].sigma_px, 2);
        count += 2;
      }
    }
    fit.rms_px = std::sqrt(squares_px2 / (count / 2.0));
    fit.degrees_of_freedom = count - model_.count() - kPose * static_cast<int>(views_.size());
    return fit;
  }

  /// Fills in covariances; false when something cannot be told apart.
  bool covariances(CameraFit& fit) {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::DENSE_SVD;
    options.min_reciprocal_condition_number = 1e-14;  // of J' J
    ceres::Covariance covariance(options);
    std::vector<std::pair<const double*, const double*>> blocks{{intrinsics_.data(), intrinsics_.data()}};
    if (model_.count() == 0) blocks.clear();
    for (const PoseNumbers& move : moves_) blocks.emplace_back(move.data(), move.data());
    if (!covariance.Compute(blocks, &problem_)) return false;
    Eigen::Matrix<double, Intrinsics::kNumbers, Intrinsics::kNumbers, Eigen::RowMajor> intrinsics;
    if (model_.count() > 0) {
      covariance.GetCovarianceBlock(intrinsics_.data(), intrinsics_.data(), intrinsics.data());
      const Eigen::Map<const Eigen::Array<double, Intrinsics::kNumbers, 1>> unit(unit_.data());
      fit.covariance = unit.matrix().asDiagonal() * intrinsics * unit.matrix().asDiagonal();
    }
    for (std::size_t i = 0; i < moves_.size(); ++i) {
      Eigen::Matrix<double, kPose, kPose, Eigen::RowMajor> pose;
      covariance.GetCovarianceBlock(moves_[i].data(), moves_[i].data(), pose.data());
      fit.views[i].covariance = pose;
    }
    return fit.covariance.allFinite();
  }

 private:
  void know(Number number, double mean, double sigma) {
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<NumberPrior, 1, Intrinsics::kNumbers>(
                                  new NumberPrior{static_cast<std::size_t>(number), mean, sigma}),
                              nullptr, intrinsics_.data());
  }

  [[nodiscard]] FittedView fitted(std::size_t i) const {
    FittedView view;
    view.pivot_depth_mm = pivots_mm_[i];
    view.covariance.setZero();
    const Eigen::Vector3d w = Eigen::Map<const Eigen::Vector3d>(moves_[i].data());
    const Eigen::Vector3d pivot(0, 0, pivots_mm_[i]);
    RigidTransform turn = RigidTransform::Identity();
    if (w.norm() > 0) turn.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix();
    turn.translation() =
        pivot - turn.linear() * pivot + Eigen::Map<const Eigen::Vector3d>(moves_[i].data() + 3);
    view.T_camera_world = turn * views_[i].T_camera_world;
    const Camera camera(calibration_of(intrinsics_of(from_units(intrinsics_, unit_)), view.T_camera_world));
    for (const CameraPoint& point : views_[i].points) {
      const auto at = project_ball(camera, point.p_world_mm, point.radius_mm);
      view.residual_px.emplace_back(at ? Eigen::Vector2d(point.p_image_px - *at)
                                       : Eigen::Vector2d::Constant(1e6));
    }
    return view;
  }

  const std::vector<PointView>& views_;
  IntrinsicsModel model_;
  IntrinsicNumbers unit_;
  IntrinsicNumbers intrinsics_;  ///< in units
  std::vector<PoseNumbers> moves_;
  std::vector<double> pivots_mm_;
  ceres::Problem problem_;
};

bool is_determined(const std::vector<PointView>& views, const IntrinsicsModel& model) {
  std::size_t points = 0;
  for (const PointView& view : views) {
    if (view.points.size() < 3) return false;
    points += view.points.size();
  }
  return 2 * static_cast<int>(points) >= model.count() + kPose * static_cast<int>(views.size()) &&
         !views.empty();
}

std::vector<PointView> with_poses_of(std::vector<PointView> views, const CameraFit& fit) {
  for (std::size_t i = 0; i < views.size(); ++i) views[i].T_camera_world = fit.views[i].T_camera_world;
  return views;
}

}  // namespace

std::optional<CameraFit> refine_camera(const Intrinsics& first, const std::vector<PointView>& views,
                                       const IntrinsicsModel& model, Residuals residuals) {
  if (!is_determined(views, model)) return std::nullopt;
  Fit fit(first, views, model, residuals, 1);
  if (!fit.solve()) return std::nullopt;
  CameraFit result = fit.result();
  if (!std::isfinite(result.rms_px) || result.rms_px > 1e5) return std::nullopt;
  return result;
}

std::optional<CameraFit> fit_camera(const Intrinsics& first, const std::vector<PointView>& views,
                                    const IntrinsicsModel& model, Residuals residuals) {
  const auto found = refine_camera(first, views, model, residuals);
  if (!found || found->degrees_of_freedom < 1) return std::nullopt;
  // Once more around what was found, with residuals as large as they are: what is known of the principal
  // point then counts as much as it should, and moves are 0 where the covariance is asked for.
  const double noise_factor = std::max(1e-3, std::sqrt(found->chi2 / found->degrees_of_freedom));
  Intrinsics start = found->intrinsics;
  if (model.principal_sigma_px) {
    start.cx = first.cx;
    start.cy = first.cy;
  }
  const std::vector<PointView> near = with_poses_of(views, *found);
  Fit fit(start, near, model, residuals, noise_factor);
  if (!fit.solve()) return std::nullopt;
  const CameraFit solved = fit.result();
  const std::vector<PointView> nearest = with_poses_of(views, solved);
  Fit last(solved.intrinsics, nearest, model, residuals, noise_factor);
  CameraFit result = last.result();
  result.noise_factor = noise_factor;
  if (!last.covariances(result)) return std::nullopt;
  return result;
}

CameraCalibration calibration_of(const Intrinsics& intrinsics, const RigidTransform& T_camera_world) {
  CameraCalibration camera;
  camera.fx = intrinsics.fx;
  camera.fy = intrinsics.fx * intrinsics.aspect;
  camera.cx = intrinsics.cx;
  camera.cy = intrinsics.cy;
  camera.distortion = intrinsics.distortion;
  camera.T_camera_world = T_camera_world;
  return camera;
}

std::optional<Eigen::Vector2d> project_ball(const Camera& camera, const Eigen::Vector3d& p_world_mm,
                                            double radius_mm) {
  const RigidTransform& T_camera_world = camera.calibration().T_camera_world;
  Eigen::Vector3d p_camera_mm = T_camera_world * p_world_mm;
  if (!(p_camera_mm.z() > radius_mm)) return std::nullopt;
  p_camera_mm.z() -= radius_mm * radius_mm / p_camera_mm.z();
  const auto projection = camera.project(T_camera_world.inverse() * p_camera_mm);
  if (!projection) return std::nullopt;
  return projection->p_image_px;
}

}  // namespace tubed
