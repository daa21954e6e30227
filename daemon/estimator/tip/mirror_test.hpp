// Mirror test: one view shows how steep a tube is, but not whether toward the camera or away from it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>

#include "daemon/model/uniform_cubic_bspline.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

/// A shape whose tip no coil holds, and the camera that shows it.
struct LooseShape {
  const Camera& camera;
  const UniformCubicBSpline& spline;
  double loose_mm = 0;                  ///< arc length of the first coil that takes part, from the tip
  double cost = 0;                      ///< chi^2 of the shape
  bool is_seen_from_two_sides = false;  ///< show_tip_from_two_sides()
};

/// Of what coils hold on both sides a solver comes back from the mirror image to the same shape; a tip that
/// none holds may turn to the other side wherever it runs across the view. One an estimator; memory is taken
/// in the constructor, nothing else allocates.
class MirrorTest {
 public:
  /// `coefficient_count`: columns of every C here.
  explicit MirrorTest(Eigen::Index coefficient_count);

  /// Solves from every other start there is, mirrored and leant: `solve(C)` refines C (3 x n, mm, world) and
  /// returns its chi^2. C, which costs `shape.cost`, becomes another one when that costs clearly less; what
  /// is left over is the rival().
  template <typename Solve>
  void run(const LooseShape& shape, Eigen::Matrix3Xd& C, const Solve& solve) {
    const std::size_t starts = find_starts(shape, C);
    for (std::size_t i = 1; i < starts; ++i) {
      costs_[i] = solve(shapes_[i]);
    }
    choose(starts, shape, C);
  }

  /// Way to the other shape that the tip may have, 3 x n, mm, times the square root of its probability: what
  /// rival() rival()^T adds to the covariance of the coefficients. Zero without one.
  [[nodiscard]] const Eigen::Matrix3Xd& rival() const { return rival_; }
  /// Is that shape, or another one, about as likely and somewhere else? Also of a tip that is loose for more
  /// than 100 mm and not seen from two sides: not all is tried that one view may show of it.
  [[nodiscard]] bool is_ambiguous() const { return is_ambiguous_; }
  void clear() {
    rival_.setZero();
    is_ambiguous_ = false;
  }

  /// Where C may be mirrored, arc lengths from the tip, mm: at the first coil, and where C is less steep than
  /// beside it. Valid until the next call of anything here.
  std::span<const double> find_turns(const LooseShape& shape, const Eigen::Matrix3Xd& C);

  /// C, but with the depth of all that comes before `turn_mm` on the other side of the depth there: every
  /// coefficient on its own ray, so that the image is nearly the same.
  static void mirror_before(double turn_mm, const LooseShape& shape, const Eigen::Matrix3Xd& C,
                            Eigen::Matrix3Xd& mirrored);

  /// C, but leaning toward the camera (side -1) or away from it (1), the more the nearer to the tip, each
  /// coefficient on its own ray: a shape that runs across the view is its own mirror image, and a solver that
  /// begins with it has no reason to leave it for either side.
  static void lean(double side, const LooseShape& shape, const Eigen::Matrix3Xd& C, Eigen::Matrix3Xd& leant);

 private:
  static constexpr std::size_t kMaxTurns = 4;
  static constexpr std::size_t kMaxStarts = 1 + kMaxTurns + 2;

  std::size_t find_starts(const LooseShape& shape, const Eigen::Matrix3Xd& C);
  void choose(std::size_t starts, const LooseShape& shape, Eigen::Matrix3Xd& C);

  std::array<double, kMaxTurns> turns_{};
  std::array<Eigen::Matrix3Xd, kMaxStarts> shapes_;  ///< the one given, and what becomes of each other start
  std::array<double, kMaxStarts> costs_{};
  Eigen::Matrix3Xd rival_;
  bool is_ambiguous_ = false;
};

}  // namespace tubed
