// Geometry of a centreline given as a uniform cubic B-spline: point, tangent, curvature, arc length, and its
// fit to points. `C_mm` is 3 x spline.coefficient_count(), one coefficient a column, tip first, in any
// Cartesian frame; results are in that frame. Arc length s runs from the tip and is exact only as far as the
// curve has unit speed. Pure functions: callable from any thread; all but fit_coefficients never allocate.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

using ConstPoints = Eigen::Ref<const Eigen::Matrix3Xd>;

/// b(s), Eq. (1), mm.
Eigen::Vector3d point(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm);

/// b'(s), mm per mm: of length 1 where s is the true arc length.
Eigen::Vector3d derivative(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm);

/// b''(s), per mm.
Eigen::Vector3d second_derivative(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm);

/// b'(s) / |b'(s)|, from the tip towards the hub; zero where the curve stands still (all four coefficients in
/// one place).
Eigen::Vector3d unit_tangent(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm);

/// |b' x b''| / |b'|^3, per mm, whatever the speed; not finite where the curve stands still.
double curvature_per_mm(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double s_mm);

/// Integral of |b'(s)| ds of Eq. (12), mm, from one parameter to another; negative when `to` lies before
/// `from`. Gauss-Legendre with 5 nodes a segment: exact to 1e-9 of the length for curves that turn less than
/// 0.5 rad a segment.
double arc_length_mm(const UniformCubicBSpline& spline, const ConstPoints& C_mm, double from_mm,
                     double to_mm);

/// Coefficients (3 x n) that minimise the sum of |b(s_i) - p_i|^2 over samples s (m) and p (3 x m, one point
/// a column). Nothing when the samples do not determine every coefficient (fewer than n, or none near one of
/// them), or are not finite. Precondition: s and p have as many columns. Dense, rank-revealing QR: allocates;
/// for initialisation and tests.
std::optional<Eigen::Matrix3Xd> fit_coefficients(const UniformCubicBSpline& spline,
                                                 const Eigen::Ref<const Eigen::VectorXd>& s_mm,
                                                 const ConstPoints& p_mm);

}  // namespace tubed
