#include "daemon/model/spline_geometry.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "daemon/model/dense_solver.hpp"
#include "daemon/model/gauss_legendre.hpp"
#include "idl/geometry/precondition.hpp"

namespace tubed {
namespace {

/// The segment that basis() evaluates at s: 0 before the tip, the last one beyond the end.
int segment_at(const UniformCubicBSpline& spline, double s_mm) { return spline.basis(s_mm).first; }

}  // namespace

Eigen::Vector3d point(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm) {
  const CubicBasis basis = spline.basis(s_mm);
  return combine(C_mm, basis.first, basis.value);
}

Eigen::Vector3d derivative(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm) {
  const CubicBasis basis = spline.basis(s_mm);
  return combine(C_mm, basis.first, basis.first_derivative);
}

Eigen::Vector3d second_derivative(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm) {
  const CubicBasis basis = spline.basis(s_mm);
  return combine(C_mm, basis.first, basis.second_derivative);
}

Eigen::Vector3d unit_tangent(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm) {
  return derivative(spline, C_mm, s_mm).normalized();
}

double curvature_per_mm(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm) {
  const CubicBasis basis = spline.basis(s_mm);
  const Eigen::Vector3d velocity = combine(C_mm, basis.first, basis.first_derivative);
  const Eigen::Vector3d acceleration = combine(C_mm, basis.first, basis.second_derivative);
  const double speed = velocity.norm();
  return velocity.cross(acceleration).norm() / (speed * speed * speed);
}

double arc_length_mm(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double from_mm,
                     double to_mm) {
  if (to_mm < from_mm) return -arc_length_mm(spline, C_mm, to_mm, from_mm);
  const auto speed = [&](double s_mm) { return derivative(spline, C_mm, s_mm).norm(); };
  const int first = segment_at(spline, from_mm);
  const int last = segment_at(spline, to_mm);
  // Segment by segment, since the third derivative of the curve jumps between them.
  double length_mm = 0;
  for (int segment = first; segment <= last; ++segment) {
    const double begin_mm = segment == first ? from_mm : segment * spline.spacing_mm();
    const double end_mm = segment == last ? to_mm : (segment + 1) * spline.spacing_mm();
    length_mm += integrate_gauss_legendre(begin_mm, end_mm, speed);
  }
  return length_mm;
}

std::optional<Eigen::Matrix3Xd> fit_coefficients(const UniformCubicBSpline& spline,
                                                 const Eigen::Ref<const Eigen::VectorXd>& s_mm,
                                                 const ConstPoints& p_mm) {
  require(s_mm.size() == p_mm.cols(), "fit_coefficients: one arc length a point");
  const int n = spline.coefficient_count();
  if (s_mm.size() < n || !s_mm.allFinite() || !p_mm.allFinite()) return std::nullopt;

  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(s_mm.size(), n);
  for (Eigen::Index i = 0; i < s_mm.size(); ++i) {
    const CubicBasis basis = spline.basis(s_mm(i));
    for (int k = 0; k < 4; ++k) weights(i, basis.first + k) = basis.value[static_cast<std::size_t>(k)];
  }
  const LeastSquares fit(weights);
  if (fit.rank() < n) return std::nullopt;
  return Eigen::Matrix3Xd(fit.solve(p_mm.transpose()).transpose());
}

}  // namespace tubed
