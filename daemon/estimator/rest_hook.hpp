// A tip that its maker has bent, as a term of the MAP: bending is measured from the rest shape.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// What a hook is: a circle over the last `length_mm` of the tube.
struct HookShape {
  double radius_mm = 8;
  double length_mm = 14;
  friend bool operator==(const HookShape&, const HookShape&) = default;
};

/// The rest shape of Eq. (13): instead of zeta'' = 0 a hook has zeta'' = kappa0(s) b x zeta', where b is the
/// binormal of its plane (world, the same along the hook). The direction of b is the roll of the tube, which
/// nobody measures, its length how far the hook is open (1: as made). Bilinear in b and the coefficients, so
/// that there is neither an angle nor a frame to be carried. Memory is taken in the constructor.
class RestHook {
 public:
  /// A node of the integral of bending over the hook's segments.
  struct Node {
    CubicBasis basis;
    double s_mm = 0;
    double length_mm = 0;           ///< of the tube that it stands for
    double curvature_per_mm = 0;    ///< kappa0
    Eigen::Index bending_node = 0;  ///< the nearest one of TubeMap::set_bending()
  };

  static constexpr double kSigmaOfPlane = 0.03;    ///< of b . zeta' behind the hook: else it becomes a helix
  static constexpr double kSigmaOfOpening = 0.25;  ///< of |b| about 1
  static constexpr double kSoftness = 3;  ///< of bending_q_per_mm about the rest shape: hooks are not exact

  static constexpr std::size_t kMaxNodes = 6 * 48;

  RestHook(const UniformCubicBSpline& spline, const HookShape& shape);

  [[nodiscard]] const HookShape& shape() const { return shape_; }
  /// Does a coil at this arc length (mm from the tip) lie far enough inside to say to which side it turns?
  [[nodiscard]] bool is_held_by(double coil_mm) const { return coil_mm <= shape_.length_mm - kInside_mm; }
  static constexpr double kInside_mm = 5;
  /// Those of the first segment_count() segments of the spline, which stand for the usual ones there.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  [[nodiscard]] int segment_count() const { return segment_count_; }
  /// Where the hook begins: its tangent there lies in its plane.
  [[nodiscard]] const CubicBasis& beginning() const { return beginning_; }
  /// kappa0, 1/mm, at arc length s (mm from the tip); 0 behind the hook.
  [[nodiscard]] double curvature_per_mm(double s_mm) const;

  [[nodiscard]] const Eigen::Vector3d& binormal() const { return binormal_; }
  void set_binormal(const Eigen::Vector3d& binormal) { binormal_ = binormal; }

  /// The binormal that costs least for the shape C (3 x n, mm, world) and weights 1 / q of bending at each
  /// of nodes(): Gauss-Newton in three unknowns from where it is.
  void fit_binormal(const Eigen::Matrix3Xd& C, std::span<const double> weights);

 private:
  HookShape shape_;
  int segment_count_;
  CubicBasis beginning_;
  std::vector<Node> nodes_;
  Eigen::Vector3d binormal_ = Eigen::Vector3d::UnitZ();
};

/// [v]x: cross_with(v) * w = v x w.
inline Eigen::Matrix3d cross_with(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

}  // namespace tubed
