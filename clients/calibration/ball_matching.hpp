// Which shadow is which ball: a phantom recognised in one image without knowing camera or pose.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "clients/calibration/ball_detection.hpp"
#include "clients/calibration/ball_phantom.hpp"
#include "clients/calibration/camera_fit.hpp"

namespace tubed {

/// A ball of the phantom and its shadow, by their numbers.
struct MatchedBall {
  std::size_t ball;
  std::size_t found;
};

struct PhantomMatch {
  std::vector<MatchedBall> pairs;
  Intrinsics intrinsics;  ///< focal length and k1 roughly; the principal point in the image's middle
  RigidTransform T_camera_phantom = RigidTransform::Identity();
  double rms_px = 0;          ///< of the pairs
  std::size_t in_image = 0;   ///< balls that have to be in the image with that pose
  bool is_ambiguous = false;  ///< another pose explains as many pairs as well

  /// Enough pairs that chance does not explain them.
  [[nodiscard]] bool is_certain() const;
};

/// What is known of the camera before.
struct MatchPrior {
  /// Least and greatest focal length; nothing: 0.9 to 7 times the image's longer side.
  std::optional<std::pair<double, double>> focal_px;
  /// Whether shadows have to be as wide as their balls; kIgnored: to find out that diameters are wrong.
  enum class Sizes { kCount, kIgnored };
  Sizes sizes = Sizes::kCount;
};

/// RANSAC: triples of the largest shadows are taken for triples of the largest balls (P3P at some focal
/// lengths: Ke and Roumeliotis, CVPR 2017); the poses that put most balls near a shadow of their size are
/// refined with focal length and radial distortion while what counts as near shrinks. The same input gives
/// the same result. Nothing when no pose puts 6 balls where shadows are.
std::optional<PhantomMatch> match_balls(const std::vector<FoundBall>& found, const BallPhantom& phantom,
                                        int width, int height, const MatchPrior& prior = {});

/// The pairs with a camera that is known well: each ball's nearest shadow within `near_px`, none twice.
std::vector<MatchedBall> pair_up(const std::vector<FoundBall>& found, const BallPhantom& phantom,
                                 const Intrinsics& intrinsics, const RigidTransform& T_camera_phantom,
                                 double near_px, MatchPrior::Sizes sizes = MatchPrior::Sizes::kCount);

/// The pairs as points of a fit, in the world frame.
std::vector<CameraPoint> points_of(const std::vector<MatchedBall>& pairs, const std::vector<FoundBall>& found,
                                   const BallPhantom& phantom);

/// As they look in the mirror image.
std::vector<FoundBall> mirrored(std::vector<FoundBall> found, int width);

}  // namespace tubed
