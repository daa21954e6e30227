#include "bench/stages/ceres_map.hpp"

#include <array>
#include <cmath>

namespace tubed {

namespace {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// sum of weights[k] * C_k.
template <typename T>
Vector3<T> combined(const std::array<const T*, 4>& C, const std::array<double, 4>& weights) {
  Vector3<T> sum = Vector3<T>::Zero();
  for (std::size_t k = 0; k < 4; ++k) sum += Eigen::Map<const Vector3<T>>(C[k]) * T(weights[k]);
  return sum;
}

struct CoilCost {
  CubicBasis basis;
  CoilObservation coil;
  double sigma_position_mm;
  double sigma_tangent;

  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* r) const {
    const std::array<const T*, 4> C{a, b, c, d};
    Eigen::Map<Vector3<T>> off(r);
    Eigen::Map<Vector3<T>> turned(r + 3);
    off = (combined(C, basis.value) - coil.p_world_mm.cast<T>()) / T(sigma_position_mm);
    turned =
        (-combined(C, basis.first_derivative).normalized() - coil.tangent_world.cast<T>()) / T(sigma_tangent);
    return true;
  }
};

struct StiffnessCost {
  CubicBasis basis;
  double bending_weight;
  double strain_weight;

  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* r) const {
    const std::array<const T*, 4> C{a, b, c, d};
    Eigen::Map<Vector3<T>> bending(r);
    bending = combined(C, basis.second_derivative) * T(bending_weight);
    r[3] = (combined(C, basis.first_derivative).norm() - T(1)) * T(strain_weight);
    return true;
  }
};

struct LineCost {
  CubicBasis basis;
  LineConstraint line;
  CameraCalibration camera;  // without distortion

  template <typename T>
  bool operator()(const T* a, const T* b, const T* c, const T* d, T* r) const {
    const std::array<const T*, 4> C{a, b, c, d};
    const Vector3<T> p_camera = camera.T_camera_world.linear().cast<T>() * combined(C, basis.value) +
                                camera.T_camera_world.translation().cast<T>();
    const T x = T(camera.fx) * p_camera.x() / p_camera.z() + T(camera.cx);
    const T y = T(camera.fy) * p_camera.y() / p_camera.z() + T(camera.cy);
    r[0] = (T(line.normal.x()) * (x - T(line.target_px.x())) +
            T(line.normal.y()) * (y - T(line.target_px.y()))) /
           T(std::sqrt(line.variance_px2));
    return true;
  }
};

}  // namespace

void CeresMap::add(ceres::CostFunction* function, int first) {
  problem_.AddResidualBlock(function, nullptr, C_.col(first).data(), C_.col(first + 1).data(),
                            C_.col(first + 2).data(), C_.col(first + 3).data());
}

CeresMap::CeresMap(const EstimatorSettings& settings, const UniformCubicBSpline& spline,
                   const CoilObservations& coils, const CameraCalibration& camera,
                   std::span<const LineConstraint> lines, ceres::LinearSolverType linear_solver)
    : C_(Eigen::Matrix3Xd::Zero(3, spline.coefficient_count())) {
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) continue;
    const CubicBasis basis = spline.basis(coil.s_mm);
    add(new ceres::AutoDiffCostFunction<CoilCost, 6, 3, 3, 3, 3>(
            new CoilCost{basis, coil, settings.sigma_position_mm, settings.sigma_tangent}),
        basis.first);
  }
  const double h = spline.spacing_mm();
  const double node_offset = 0.5 / std::sqrt(3.0);  // Gauss-Legendre with two points
  for (int segment = 0; segment < spline.coefficient_count() - 3; ++segment) {
    for (const double node : {0.5 - node_offset, 0.5 + node_offset}) {
      const CubicBasis basis = spline.basis((segment + node) * h);
      add(new ceres::AutoDiffCostFunction<StiffnessCost, 4, 3, 3, 3, 3>(
              new StiffnessCost{basis, std::sqrt(h / 2 / settings.bending_q_per_mm),
                                std::sqrt(h / 2) / settings.sigma_strain_sqrt_mm}),
          basis.first);
    }
  }
  for (const LineConstraint& line : lines) {
    const CubicBasis basis = spline.basis(line.s_mm);
    add(new ceres::AutoDiffCostFunction<LineCost, 1, 3, 3, 3, 3>(new LineCost{basis, line, camera}),
        basis.first);
  }
  options_.linear_solver_type = linear_solver;
  options_.num_threads = 1;
  options_.logging_type = ceres::SILENT;
}

double CeresMap::solve(const Eigen::Matrix3Xd& start) {
  C_ = start;
  ceres::Solver::Summary summary;
  ceres::Solve(options_, &problem_, &summary);
  return 2 * summary.final_cost;
}

double CeresMap::cost_at(const Eigen::Matrix3Xd& C) {
  C_ = C;
  double cost = 0;
  problem_.Evaluate({}, &cost, nullptr, nullptr, nullptr);
  return 2 * cost;
}

}  // namespace tubed
