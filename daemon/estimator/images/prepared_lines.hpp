// The image lines of one solve, laid out for the kernel that projects them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "daemon/estimator/algebra/line_kernels.hpp"
#include "daemon/estimator/algebra/shared_error.hpp"
#include "daemon/estimator/images/line_constraint.hpp"
#include "daemon/model/uniform_cubic_bspline.hpp"

namespace tubed {

/// What does not change of the lines while the coefficients do: their basis functions and whitened targets.
/// Of one thread; memory is taken in the constructor, unless more lines come than a tube has in all cameras.
class PreparedLines {
 public:
  PreparedLines();

  /// The lines of these views, whose constraints are not needed afterwards.
  void prepare(std::span<const ViewConstraints> views, const UniformCubicBSpline& spline);

  /// Adds r = n . (pi(zeta(s)) - target) / sqrt(v) of every line to `sum` (NormalEquations or CostSum), for
  /// the shape of the coefficients C (3 x n, mm, world). Lines of an image whose pose is not exact share its
  /// error (SharedError).
  template <typename Sum>
  void add(const Eigen::Matrix3Xd& C, Sum& sum) {
    for (const View& view : views_) {
      project(view, C);
      add_view(view, sum);
    }
  }

 private:
  struct Line {
    int first;
    std::array<double, 4> weights;
  };
  /// Its lines in lines_, and its camera for the kernel.
  struct View {
    LineCamera camera;
    PoseSigma pose_sigma;
    std::size_t begin;
    std::size_t count;
  };

  void reserve(std::size_t count);
  void project(const View& view, const Eigen::Matrix3Xd& C);
  [[nodiscard]] SharedError::Parts by_pose(const View& view, std::size_t line) const;

  [[nodiscard]] Eigen::Vector3d gradient(std::size_t line) const {
    return {residuals_[1][line], residuals_[2][line], residuals_[3][line]};
  }

  template <typename Sum>
  void add_view(const View& view, Sum& sum) const {
    const bool is_pose_exact = view.pose_sigma.is_zero();
    if (!is_pose_exact) sum.begin_shared();
    for (std::size_t i = view.begin; i < view.begin + view.count; ++i) {
      const double residual = residuals_[0][i];
      sum.add(lines_[i].first, lines_[i].weights, gradient(i), residual);
      if (!is_pose_exact) {
        sum.add_shared(lines_[i].first, lines_[i].weights, gradient(i), residual, by_pose(view, i));
      }
    }
    if (!is_pose_exact) sum.end_shared();
  }

  std::vector<View> views_;
  std::vector<Line> lines_;                       ///< of all views, one after another; so are the next
  std::array<std::vector<double>, 3> points_;     ///< x, y, z
  std::array<std::vector<double>, 3> targets_;    ///< normal over the standard deviation, target
  std::array<std::vector<double>, 4> residuals_;  ///< residual, gradient
};

}  // namespace tubed
