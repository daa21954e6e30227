// How much each part of a tube bends, learnt from its shape.
#pragma once

#include <Eigen/Core>

#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// One bending_q_per_mm for a whole tube is too firm for a pre-shaped tip or an arch, whose bends it
/// flattens, and far too soft for the straight rest, which it lets noise bend. So the variance of the
/// curvature is learnt along the tube: its expectation by the newest shape and that shape's covariance (an EM
/// algorithm's step, one a shape; "automatic relevance determination": MacKay, Neural Computation 4:415,
/// 1992, Sec. 4.4), averaged along the tube and over time. The covariance belongs to it: where the shape is
/// known badly it may be bent more than it seems. Called by the optimizer thread; never allocates.
class LearntBending {
 public:
  LearntBending(Eigen::Index node_count, double spacing_mm);

  /// Takes the shape C, which `map` has just inverted (TubeMap::invert_at()), `interval_s` after the last
  /// one. `factors` are those of TubeMap::set_bending().
  void learn(const TubeMap& map, const Eigen::Matrix3Xd& C, double interval_s, Eigen::VectorXd& factors);

 private:
  Eigen::MatrixXd averaging_;  ///< of nodes; rows sum up to 1
  Eigen::VectorXd expected_;   ///< scratch
  Eigen::VectorXd averaged_;   ///< scratch
};

}  // namespace tubed
