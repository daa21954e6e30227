#include "daemon/model/knot_point_spline.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "daemon/model/gauss_legendre.hpp"
#include "idl/geometry/precondition.hpp"

namespace tubed {
namespace {

// The inner rows of Eq. (3) and (4).
constexpr double kBeside = 1.0 / 6;
constexpr double kCentre = 2.0 / 3;

/// Row vector [t^3 t^2 t 1] of Eq. (2), or one of its derivatives, times the matrix of Eq. (2).
Eigen::Vector4d weights_of(const Eigen::RowVector4d& powers) {
  Eigen::Matrix4d M;
  M << -1, 3, -3, 1, 3, -6, 3, 0, -3, 0, 3, 0, 1, 4, 1, 0;
  return (powers * M / 6).transpose();
}

}  // namespace

Eigen::Matrix3Xd knot_points_from_control_points(const ConstPoints& C_mm) {
  Eigen::Matrix3Xd K_mm = C_mm;
  for (Eigen::Index i = 1; i + 1 < C_mm.cols(); ++i) {
    K_mm.col(i) = kBeside * C_mm.col(i - 1) + kCentre * C_mm.col(i) + kBeside * C_mm.col(i + 1);
  }
  return K_mm;
}

KnotPointSpline::KnotPointSpline(const ConstPoints& K_mm) : C_mm_(3, K_mm.cols()), elimination_(K_mm.cols()) {
  require(K_mm.cols() >= 4, "a clamped cubic B-spline needs at least 4 knot points");
  elimination_.setZero();
  for (Eigen::Index i = 1; i + 1 < K_mm.cols(); ++i) {
    elimination_(i) = kBeside / (kCentre - kBeside * elimination_(i - 1));
  }
  set_knot_points(K_mm);
}

void KnotPointSpline::set_knot_points(const ConstPoints& K_mm) {
  require(K_mm.cols() == C_mm_.cols(), "the number of knot points of a spline cannot change");
  const Eigen::Index n = K_mm.cols();
  // Eq. (4) is tridiagonal and diagonally dominant: eliminate forwards, substitute backwards, no pivots
  // needed.
  C_mm_.col(0) = K_mm.col(0);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    C_mm_.col(i) = (K_mm.col(i) - kBeside * C_mm_.col(i - 1)) / (kCentre - kBeside * elimination_(i - 1));
  }
  C_mm_.col(n - 1) = K_mm.col(n - 1);
  for (Eigen::Index i = n - 2; i >= 1; --i) C_mm_.col(i) -= elimination_(i) * C_mm_.col(i + 1);
}

double KnotPointSpline::parameter_of_knot_point(int index) const {
  if (index <= 0) return 0;
  if (index >= knot_point_count() - 1) return segment_count();
  return index + 1;
}

Eigen::Vector3d KnotPointSpline::point(double parameter) const {
  const auto [segment, t] = place(parameter);
  return combine_in(segment, weights_of({t * t * t, t * t, t, 1}));
}

Eigen::Vector3d KnotPointSpline::derivative(double parameter) const {
  const auto [segment, t] = place(parameter);
  return combine_in(segment, weights_of({3 * t * t, 2 * t, 1, 0}));
}

Eigen::Vector3d KnotPointSpline::second_derivative(double parameter) const {
  const auto [segment, t] = place(parameter);
  return combine_in(segment, weights_of({6 * t, 2, 0, 0}));
}

Eigen::Vector3d KnotPointSpline::unit_tangent(double parameter) const {
  const int segment = place(parameter).segment;
  const int n = knot_point_count();
  if (segment == 0) return (C_mm_.col(1) - C_mm_.col(0)).normalized();
  if (segment == n) return (C_mm_.col(n - 1) - C_mm_.col(n - 2)).normalized();
  return derivative(parameter).normalized();
}

double KnotPointSpline::curvature_per_mm(double parameter) const {
  const int segment = place(parameter).segment;
  if (segment == 0 || segment == knot_point_count()) return 0;
  const Eigen::Vector3d velocity = derivative(parameter);
  const double speed = velocity.norm();
  return velocity.cross(second_derivative(parameter)).norm() / (speed * speed * speed);
}

double KnotPointSpline::arc_length_mm(double from, double to) const {
  if (to < from) return -arc_length_mm(to, from);
  const auto speed = [this](double parameter) { return derivative(parameter).norm(); };
  const double begin = std::clamp<double>(from, 0, segment_count());
  const double end = std::clamp<double>(to, 0, segment_count());
  const int first = place(begin).segment;
  const int last = place(end).segment;
  double length_mm = 0;
  for (int segment = first; segment <= last; ++segment) {
    length_mm += integrate_gauss_legendre(segment == first ? begin : segment,
                                          segment == last ? end : segment + 1, speed);
  }
  return length_mm;
}

double KnotPointSpline::parameter_at_arc_length(double s_mm) const {
  int segment = 0;
  double before_mm = 0;  // arc length at the beginning of the segment
  double segment_mm = arc_length_mm(0, 1);
  while (segment < knot_point_count() && s_mm > before_mm + segment_mm) {
    before_mm += segment_mm;
    ++segment;
    segment_mm = arc_length_mm(segment, segment + 1);
  }
  // Bisection: Newton would divide by the speed, which is zero at the ends. The speed is t^2-like there, so t
  // is found to 2^-50 and s far better.
  double low = segment;
  double high = segment + 1;
  for (int round = 0; round < 50; ++round) {
    const double middle = (low + high) / 2;
    (before_mm + arc_length_mm(segment, middle) < s_mm ? low : high) = middle;
  }
  return s_mm <= 0 ? 0 : high;
}

KnotPointSpline::Place KnotPointSpline::place(double parameter) const {
  // Written so that NaN ends in segment 0 with t NaN: a conversion of NaN to int would be undefined.
  const double last = knot_point_count();
  const double inside = parameter < 0 ? 0 : (parameter > last + 1 ? last + 1 : parameter);
  const double segment = std::max(0.0, std::min(std::floor(inside), last));
  return {static_cast<int>(segment), inside - segment};
}

Eigen::Vector3d KnotPointSpline::combine_in(int segment, const Eigen::Vector4d& weights) const {
  // Segment i blends C_{i-1} .. C_{i+2}, counted from 1; the clamp repeats C_1 and C_n.
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 4; ++k) {
    sum += weights(k) * C_mm_.col(std::clamp(segment - 2 + k, 0, knot_point_count() - 1));
  }
  return sum;
}

Eigen::Matrix3Xd knot_points_on(const UniformCubicBSpline& spline, const ConstPoints& C_mm,
                                int knot_point_count) {
  require(knot_point_count >= 4, "a clamped cubic B-spline needs at least 4 knot points");
  Eigen::Matrix3Xd K_mm(3, knot_point_count);
  for (int i = 0; i < knot_point_count; ++i) {
    K_mm.col(i) = point(spline, C_mm, spline.length_mm() * i / (knot_point_count - 1));
  }
  return K_mm;
}

std::optional<ArcLengthCurve> arc_length_curve_of(const KnotPointSpline& knot_point_spline,
                                                  int coefficient_count) {
  const double length_mm = knot_point_spline.length_mm();
  if (!(length_mm > 0) || !std::isfinite(length_mm)) return std::nullopt;
  const UniformCubicBSpline spline(coefficient_count, length_mm);
  const Eigen::VectorXd s_mm = Eigen::VectorXd::LinSpaced(8 * coefficient_count, 0, length_mm);
  Eigen::Matrix3Xd p_mm(3, s_mm.size());
  for (Eigen::Index i = 0; i < s_mm.size(); ++i) {
    p_mm.col(i) = knot_point_spline.point(knot_point_spline.parameter_at_arc_length(s_mm(i)));
  }
  std::optional<Eigen::Matrix3Xd> C_mm = fit_coefficients(spline, s_mm, p_mm);
  if (!C_mm) return std::nullopt;
  return ArcLengthCurve{spline, *std::move(C_mm)};
}

}  // namespace tubed
