// The paper's centreline: a clamped cubic B-spline driven by its knot points, Eq. (1)-(4). Used by the
// paper's mode; the default form is UniformCubicBSpline, because this one has traps. Knot points K are points
// ON the curve, control points C shape it. Segments i = 0 .. n of Eq. (2), with C_{j<1} = C_1 and C_{j>n} =
// C_n, make n + 1 segments of n knot points:
//
//   parameter   0     1                       2     3   ...  n - 1    n                          n + 1
//   point      K_1   5/6 C_1 + 1/6 C_2       K_2   K_3      K_{n-1}  1/6 C_{n-1} + 5/6 C_n      K_n
//
// The traps, each measured in tests/daemon/model/knot_point_spline_test.cpp:
//   * Eq. (3) taken literally at i = 1 gives 5/6 C_1 + 1/6 C_2, which is the joint at parameter 1 and no knot
//   point; K_1 is
//     C_1, as the first row of Eq. (4) has it. Two parameter steps, not one, lie between K_1 and K_2.
//   * The parameter is far from arc length at the ends: on a straight line with a knot point every 20 mm,
//   halfway
//     (in parameter) from K_1 to K_2 lies 3.33 mm = 20 mm / 6 from the tip, not 10 mm.
//   * The speed is zero at both ends (it grows as t^2), so b' / |b'| is 0 / 0 there. The limit is the
//   direction from C_1
//     to C_2, and unit_tangent returns it.
//   * The whole first and last segments are straight lines (b_0(t) = C_1 + t^3 / 6 (C_2 - C_1)): the
//   curvature there is 0
//     whatever the catheter does, and the tip's tangent is wrong by 8.4 deg on an arch of 40 mm radius with a
//     knot point every 20 mm.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "daemon/model/spline_geometry.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// Inverse of Eq. (4): inside by Eq. (3), K_1 = C_1 and K_n = C_n at the ends. 3 x n each, tip first.
/// Allocates the result.
Eigen::Matrix3Xd knot_points_from_control_points(const ConstPoints& C_mm);

/// A clamped cubic B-spline given by n >= 4 knot points, 3 x n, one a column, tip first, mm, in any Cartesian
/// frame. `parameter` runs over [0, segment_count()] and is clamped to it. Allocates only in the constructor,
/// so that an optimiser can move the knot points in a step that must not; const members are callable from any
/// thread.
class KnotPointSpline {
 public:
  /// Precondition: at least 4 knot points.
  explicit KnotPointSpline(const ConstPoints& K_mm);

  /// Solves Eq. (4) for the control points. Precondition: as many knot points as before. Never allocates.
  void set_knot_points(const ConstPoints& K_mm);

  /// C of Eq. (1), 3 x n, mm.
  [[nodiscard]] const Eigen::Matrix3Xd& control_points_mm() const { return C_mm_; }
  [[nodiscard]] int knot_point_count() const { return static_cast<int>(C_mm_.cols()); }
  [[nodiscard]] int segment_count() const { return knot_point_count() + 1; }

  /// The parameter at which the curve passes knot point `index` (0 is the tip).
  [[nodiscard]] double parameter_of_knot_point(int index) const;

  /// b_i(t) of Eq. (2) with i + t = parameter, mm.
  [[nodiscard]] Eigen::Vector3d point(double parameter) const;
  /// d b / d parameter, mm.
  [[nodiscard]] Eigen::Vector3d derivative(double parameter) const;
  /// d^2 b / d parameter^2, mm.
  [[nodiscard]] Eigen::Vector3d second_derivative(double parameter) const;

  /// Unit vector from the tip towards the hub; at the ends the limit, see above. Zero where the curve stands
  /// still.
  [[nodiscard]] Eigen::Vector3d unit_tangent(double parameter) const;

  /// |b' x b''| / |b'|^3, per mm; 0 in the first and the last segment, which are straight, the ends included.
  [[nodiscard]] double curvature_per_mm(double parameter) const;

  /// Length of the curve between two parameters, mm; negative when `to` lies before `from`.
  [[nodiscard]] double arc_length_mm(double from, double to) const;
  [[nodiscard]] double length_mm() const { return arc_length_mm(0, segment_count()); }

  /// The parameter at s mm of curve from the tip, to 1e-10 of the curve's length; the ends' for s outside it.
  [[nodiscard]] double parameter_at_arc_length(double s_mm) const;

 private:
  struct Place {
    int segment;
    double t;
  };
  [[nodiscard]] Place place(double parameter) const;
  [[nodiscard]] Eigen::Vector3d combine_in(int segment, const Eigen::Vector4d& weights) const;

  Eigen::Matrix3Xd C_mm_;
  Eigen::VectorXd
      elimination_;  ///< the super-diagonal of Eq. (4) after forward elimination: the same for all K
};

/// n knot points at equal arc lengths of a uniform spline whose parameter is arc length: K_i = b((i - 1) L /
/// (n - 1)). They lie on the curve exactly and the knot-point spline meets it there. Between them, on an arch
/// of 80 mm radius, it strays by 0.002 mm inside and by 0.23 mm near the ends, which the clamp straightens,
/// with a knot point every 20 mm (0.0005 and 0.057 mm with one every 10 mm).
Eigen::Matrix3Xd knot_points_on(const UniformCubicBSpline& spline, const ConstPoints& C_mm,
                                int knot_point_count);

/// A uniform spline in arc length, and its coefficients.
struct ArcLengthCurve {
  UniformCubicBSpline spline;
  Eigen::Matrix3Xd C_mm;
};

/// The least-squares uniform spline with `coefficient_count` coefficients of a knot-point spline, resampled
/// by arc length (8 points a coefficient). 60 coefficients repeat 20 knot points on 380 mm of that arch to
/// 0.001 mm, with a speed of 1 to 0.0005; 20 coefficients to 0.03 mm. Nothing for a curve of no length.
/// Allocates.
std::optional<ArcLengthCurve> arc_length_curve_of(const KnotPointSpline& knot_point_spline,
                                                  int coefficient_count);

}  // namespace tubed
