// The paper's MAP in 3D, Eq. (10)-(14): the cubics between the coils that explain them best, by
// Levenberg-Marquardt with finite differences (Sec. 2.2.1), and the same along the depth alone (Sec. 2.2.3).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/estimator/paper/paper_gap_cubics.hpp"

namespace tubed {

/// What Eq. (14) found.
struct PaperEmShape {
  GapCubics cubics;
  Eigen::Matrix3Xd nodes;  ///< 3 x 2 m, mm, world: see GapCubics
  int iterations = 0;
  bool converged = false;

  /// 3 x n, mm: the curve at n equal steps from the tip to length_mm, the new knot points.
  [[nodiscard]] Eigen::Matrix3Xd points(int count, double length_mm) const;
};

/// Coils that are used, in order from the tip. Those at the place of another one are passed over.
std::vector<const CoilObservation*> coils_in_order(const CoilObservations& coils);

/// Solves Eq. (14). Nothing with fewer than two usable coils. Allocates (Ceres).
std::optional<PaperEmShape> solve_paper_em_map(const EstimatorSettings& settings, double length_mm,
                                               const CoilObservations& coils);

/// Depths of a curve whose projection is held.
struct PaperDepths {
  GapCubics cubics;
  Eigen::RowVectorXd nodes;  ///< 1 x 2 m: depth and its derivative at each coil
  int iterations = 0;
  bool converged = false;
};

/// A curve point (mm, world) for a depth at arc length s: the point of the viewing ray there.
using PointAtDepth = std::function<Eigen::Vector3d(double s_mm, double depth_mm)>;

/// Solves Eq. (14) for the depths alone; `start` has the depths of the curve at hand (1 x 2 m). Nothing with
/// fewer than two usable coils. Allocates.
std::optional<PaperDepths> solve_paper_depth_map(const EstimatorSettings& settings, double length_mm,
                                                 const CoilObservations& coils, const PointAtDepth& point,
                                                 const Eigen::RowVectorXd& start);

}  // namespace tubed
