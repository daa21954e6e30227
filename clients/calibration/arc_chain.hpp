// Arcs of circles in a plane, one going on where the other ends, fitted to points beside them.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "drivers/interface/rest_curve.hpp"

namespace tubed {

/// Begins somewhere in some direction; each piece has a length and a curvature. Before the first and behind
/// the last piece the arcs go on. mm and rad in the drawing's plane; used by one thread.
class ArcChain {
 public:
  /// So many pieces of equal length along a line of points (2 x n, mm), with the curvature that the line has
  /// there. Precondition: two points or more, none twice in a row.
  static ArcChain along(const Eigen::Matrix2Xd& points_mm, std::size_t pieces);

  enum class Ends {
    kHeld,  ///< lengths stay
    kFree
  };
  /// Gauss-Newton with damping in beginning, direction, curvatures and, if free, lengths, until so many
  /// rounds are over or nothing improves: the least squared distances of the points from the chain.
  void fit(const Eigen::Matrix2Xd& points_mm, Ends ends, int rounds);

  /// This piece and the next one made one.
  [[nodiscard]] ArcChain merged(std::size_t piece) const;

  /// Signed distances of the points from the chain, mm; each from the place nearest to it that lies about as
  /// far along the chain as the point does along the points. Last, one more: how far the chain begins from
  /// the first point, along the chain.
  [[nodiscard]] Eigen::VectorXd residuals_mm(const Eigen::Matrix2Xd& points_mm) const;

  [[nodiscard]] std::size_t piece_count() const { return lengths_mm_.size(); }
  [[nodiscard]] double length_mm() const;
  [[nodiscard]] RestArc arc(std::size_t piece) const;
  /// A point every `step_mm`, 2 x n.
  [[nodiscard]] Eigen::Matrix2Xd sampled(double step_mm) const;

 private:
  struct Place {
    Eigen::Vector2d p_mm;
    double heading_rad;
  };
  [[nodiscard]] Place at(double s_mm) const;
  [[nodiscard]] Eigen::VectorXd parameters(Ends ends) const;
  void set_parameters(const Eigen::VectorXd& parameters, Ends ends);

  Eigen::Vector2d begin_mm_ = Eigen::Vector2d::Zero();
  double heading_rad_ = 0;
  std::vector<double> lengths_mm_;
  std::vector<double> curvatures_per_mm_;
};

}  // namespace tubed
