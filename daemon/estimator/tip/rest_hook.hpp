// A tip that its maker has bent, as a term of the MAP: bending is measured from the rest shape.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "daemon/estimator/algebra/normal_equations.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"
#include "drivers/interface/rest_curve.hpp"

namespace tubed {

/// [v]x: cross_with(v) * w = v x w.
inline Eigen::Matrix3d cross_with(const Eigen::Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

/// The rest shape of Eq. (13), a planar curve of the last part of the tube, called hook here whatever arcs it
/// has: instead of zeta'' = 0 a hook has zeta'' = kappa0(s) b x zeta', where b is the
/// binormal of its plane (world, the same along the hook). The direction of b is the roll of the tube, which
/// nobody measures, its length how far the hook is open (1: as made). Bilinear in b and the coefficients, so
/// that there is neither an angle nor a frame to be carried. Memory is taken in the constructor.
/// Called by the optimizer thread.
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

  RestHook(const UniformCubicBSpline& spline, RestCurve curve);

  [[nodiscard]] const RestCurve& curve() const { return curve_; }
  /// From the tip to where the hook begins.
  [[nodiscard]] double length_mm() const { return length_mm_; }
  /// Does a coil at this arc length (mm from the tip) lie far enough inside to say to which side it turns?
  [[nodiscard]] bool is_held_by(double coil_mm) const { return coil_mm <= length_mm_ - kInside_mm; }
  static constexpr double kInside_mm = 5;
  /// Those of the first segment_count() segments of the spline, which stand for the usual ones there.
  [[nodiscard]] std::span<const Node> nodes() const { return nodes_; }
  [[nodiscard]] int segment_count() const { return segment_count_; }
  /// Where the hook begins: its tangent there lies in its plane.
  [[nodiscard]] const CubicBasis& beginning() const { return beginning_; }
  /// kappa0, 1/mm, at arc length s (mm from the tip), signed as the radii are; 0 behind the hook.
  [[nodiscard]] double curvature_per_mm(double s_mm) const;

  [[nodiscard]] const Eigen::Vector3d& binormal() const { return binormal_; }
  void set_binormal(const Eigen::Vector3d& binormal) { binormal_ = binormal; }

  /// What follows weighs bending with ds / (q f) at each node: q of EstimatorSettings times kSoftness, f the
  /// factors of TubeMap::set_bending().
  void weigh(double bending_q_per_mm, const Eigen::VectorXd& factors);

  /// The binormal that costs least for the shape C (3 x n, mm, world): Gauss-Newton in three unknowns from
  /// where it is.
  void fit_binormal(const Eigen::Matrix3Xd& C) { binormal_ = fitted_binormal(C); }
  [[nodiscard]] Eigen::Vector3d fitted_binormal(const Eigen::Matrix3Xd& C) const;

  enum class Binormal {
    kHeld,  ///< as it is
    kFree   ///< an unknown that is eliminated, with two soft rows: SharedError's first three parts
  };
  /// Adds the residuals of bending over the hook's segments, linearised at C and the binormal, to
  /// NormalEquations or CostSum:
  ///   r = sqrt(w) (zeta'' - kappa0 b x zeta'),
  ///   dr/dC_a = sqrt(w) (B''_a I - kappa0 B'_a [b]x),  dr/db = sqrt(w) kappa0 [zeta']x.
  template <typename Sum>
  void add_bending(const Eigen::Matrix3Xd& C, Binormal binormal, Sum& sum) const {
    if (binormal == Binormal::kFree) sum.begin_shared();
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      add_node(nodes_[i], std::sqrt(weights_[i]), C, binormal, sum);
    }
    if (binormal == Binormal::kFree) {
      add_plane(C, sum);
      sum.end_shared();
    }
  }

 private:
  using ByBinormal = Eigen::Matrix<double, 3, SharedError::kParts>;

  template <typename Sum>
  void add_node(const Node& node, double root_weight, const Eigen::Matrix3Xd& C, Binormal binormal,
                Sum& sum) const {
    const CubicBasis& basis = node.basis;
    const Eigen::Vector3d derivative = combine(C, basis.first, basis.first_derivative);
    const Eigen::Vector3d second = combine(C, basis.first, basis.second_derivative);
    const Eigen::Vector3d residual =
        root_weight * (second - node.curvature_per_mm * binormal_.cross(derivative));
    NormalEquations::FourColumns J;
    for (int a = 0; a < 4; ++a) {
      const auto k = static_cast<std::size_t>(a);
      J.middleCols<3>(3 * a) =
          root_weight * (basis.second_derivative[k] * Eigen::Matrix3d::Identity() -
                         node.curvature_per_mm * basis.first_derivative[k] * cross_with(binormal_));
    }
    if (binormal == Binormal::kHeld) {
      sum.add_block(basis.first, J, residual);
      return;
    }
    ByBinormal H = ByBinormal::Zero();
    H.leftCols<3>() = root_weight * node.curvature_per_mm * cross_with(derivative);
    sum.add_shared_block(basis.first, J, residual, H);
  }

  /// b lies across the tube where the hook begins, and is as long as the hook is open.
  template <typename Sum>
  void add_plane(const Eigen::Matrix3Xd& C, Sum& sum) const {
    const Eigen::Vector3d tangent = combine(C, beginning_.first, beginning_.first_derivative);
    SharedError::Parts by_b = SharedError::Parts::Zero();
    by_b.head<3>() = tangent / kSigmaOfPlane;
    const Eigen::Vector3d by_tangent = binormal_ / kSigmaOfPlane;
    const double out_of_plane = binormal_.dot(tangent) / kSigmaOfPlane;
    sum.add(beginning_.first, beginning_.first_derivative, by_tangent, out_of_plane);
    sum.add_shared(beginning_.first, beginning_.first_derivative, by_tangent, out_of_plane, by_b);
    const double opening = std::max(binormal_.norm(), 1e-6);
    by_b.head<3>() = binormal_ / opening / kSigmaOfOpening;
    sum.add_to_shared((opening - 1) / kSigmaOfOpening, by_b);
  }

  RestCurve curve_;
  double length_mm_;
  int segment_count_;
  CubicBasis beginning_;
  std::vector<Node> nodes_;
  std::vector<double> weights_;  ///< ds / (q f) at each of them
  Eigen::Vector3d binormal_ = Eigen::Vector3d::UnitZ();
};

}  // namespace tubed
