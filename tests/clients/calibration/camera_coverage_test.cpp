// Does what a camera's calibration says of its errors cover them? Points of the built-in phantom, projected
// by cameras whose distortion, principal point and pose are drawn, against what is found of them.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <iostream>
#include <random>

#include "clients/calibration/ball_phantom.hpp"
#include "clients/calibration/fit_choice.hpp"
#include "clients/calibration/simulated_phantom.hpp"

namespace tubed {
namespace {

constexpr int kDraws = 32;
constexpr int kSize_px = 512;
constexpr double kNoise_px = 0.05;

/// Errors in their own standard deviations.
struct Errors {
  std::vector<double> focal, across, depth, turn;
  double worst_projection_px = 0;
};

/// Shares within 1, 2, 3 standard deviations; Gaussian ones are 0.683, 0.954, 0.997.
std::array<double, 3> shares_of(const std::vector<double>& errors) {
  std::array<double, 3> shares{};
  for (const double error : errors) {
    for (std::size_t k = 0; k < 3; ++k) {
      shares[k] +=
          std::abs(error) <= static_cast<double>(k + 1) ? 1.0 / static_cast<double>(errors.size()) : 0;
    }
  }
  return shares;
}

/// Too few of them within would be overconfidence; all within one that nothing was measured.
void expect_covering(const std::string& what, const std::vector<double>& errors) {
  const auto shares = shares_of(errors);
  const auto words = what + ": " + std::to_string(shares[0]) + " " + std::to_string(shares[1]) + " " +
                     std::to_string(shares[2]);
  std::cout << words << '\n';
  const double sigma = std::sqrt(0.683 * 0.317 / static_cast<double>(errors.size()));
  EXPECT_GT(shares[0], 0.683 - 2.5 * sigma) << words;
  EXPECT_LT(shares[0], 1) << words;
  EXPECT_GT(shares[1], 0.9) << words;
  EXPECT_GT(shares[2], 0.97) << words;
}

SimulatedCArm drawn_c_arm(std::mt19937& random, double distortion) {
  std::normal_distribution<double> normal(0, 1);
  SimulatedCArm arm = usual_c_arm();
  arm.angles = {{0, 0}, {30, 0}, {-30, 5}, {10, 25}};
  for (GantryAngles& angles : arm.angles) {
    angles.primary_deg += 4 * normal(random);
    angles.secondary_deg += 4 * normal(random);
  }
  arm.cx = (kSize_px - 1) / 2.0 + 5 * normal(random);
  arm.cy = (kSize_px - 1) / 2.0 + 5 * normal(random);
  arm.distortion = {0.5 * distortion * normal(random), distortion * normal(random),
                    0.002 * distortion * normal(random), 0.002 * distortion * normal(random), 0};
  return arm;
}

PointView seen_by(const CameraCalibration& truth, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  const BallPhantom phantom = helix_phantom();
  const Camera camera(truth);
  PointView view;
  for (std::size_t i = 0; i < phantom.balls.size(); ++i) {
    const double radius_mm = phantom.balls[i].diameter_mm / 2;
    const auto at = project_ball(camera, phantom.p_world_mm(i), radius_mm);
    if (!at || !camera.contains(*at, 5)) continue;
    const Eigen::Vector2d noise_px(kNoise_px * normal(random), kNoise_px * normal(random));
    view.points.push_back({phantom.p_world_mm(i), radius_mm, *at + noise_px, kNoise_px, i});
  }
  view.T_camera_world = truth.T_camera_world;
  view.T_camera_world.translation() += Eigen::Vector3d(5, -5, 20);
  return view;
}

void add_pose(const FittedView& found, const RigidTransform& truth, Errors& errors) {
  const RigidTransform error = truth * found.T_camera_world.inverse();
  const Eigen::AngleAxisd turn(error.linear());
  const Eigen::Vector3d w = turn.angle() * turn.axis();
  const Eigen::Vector3d pivot(0, 0, found.pivot_depth_mm);
  const Eigen::Vector3d v = error * pivot - pivot;
  errors.across.push_back(v.x() / found.sigma_mm().x());
  errors.across.push_back(v.y() / found.sigma_mm().y());
  errors.depth.push_back(v.z() / found.sigma_mm().z());
  for (int i = 0; i < 3; ++i) errors.turn.push_back(w[i] / found.sigma_rad()[i]);
}

Errors draw(int seed, double distortion) {
  std::mt19937 random(static_cast<unsigned>(seed));
  Errors errors;
  for (int i = 0; i < kDraws; ++i) {
    const SimulatedCArm arm = drawn_c_arm(random, distortion);
    std::vector<PointView> views;
    for (std::size_t k = 0; k < arm.angles.size(); ++k) views.push_back(seen_by(camera_at(arm, k), random));
    CameraPrior prior;
    prior.width = prior.height = kSize_px;
    const auto chosen = choose_fit({1900, 1, 255.5, 255.5, {}}, views, prior);
    if (!chosen) {
      ADD_FAILURE() << "draw " << i << " gave no camera";
      continue;
    }
    const CameraCalibration truth = camera_at(arm, 0);
    errors.focal.push_back((chosen->fit.intrinsics.fx - truth.fx) / chosen->fit.sigma_of(0));
    add_pose(chosen->fit.views[0], truth.T_camera_world, errors);
    const Camera found(calibration_of(chosen->fit.intrinsics, chosen->fit.views[0].T_camera_world));
    for (const CameraPoint& point : views[0].points) {
      const auto expected = Camera(truth).project(point.p_world_mm);
      const auto got = found.project(point.p_world_mm);
      errors.worst_projection_px =
          std::max(errors.worst_projection_px, (expected->p_image_px - got->p_image_px).norm());
    }
  }
  return errors;
}

TEST(CameraCoverage, WithDistortionFocalLengthAndPoseAreAsFarOffAsTheySay) {
  const Errors errors = draw(11, 1);

  expect_covering("focal length", errors.focal);
  expect_covering("pose across the view", errors.across);
  expect_covering("pose in depth", errors.depth);
  expect_covering("pose's turn", errors.turn);
  EXPECT_LT(errors.worst_projection_px, 10 * kNoise_px);
}

TEST(CameraCoverage, WithoutDistortionTheyAreAsWell) {
  const Errors errors = draw(12, 0);

  expect_covering("focal length", errors.focal);
  expect_covering("pose across the view", errors.across);
  expect_covering("pose in depth", errors.depth);
  expect_covering("pose's turn", errors.turn);
}

}  // namespace
}  // namespace tubed
