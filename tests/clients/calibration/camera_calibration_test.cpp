// A camera from simulated radiographs of the built-in phantom, against the simulation's truth.
#include "clients/calibration/camera_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "clients/calibration/simulated_phantom.hpp"

namespace tubed {
namespace {

std::vector<CalibrationPicture> pictures_of(const SimulatedCArm& simulated) {
  std::vector<CalibrationPicture> pictures;
  for (std::size_t i = 0; i < simulated.angles.size(); ++i) {
    pictures.push_back(picture_at(simulated, helix_phantom(), i));
  }
  return pictures;
}

CameraSettings camera_a() {
  CameraSettings settings;
  settings.camera = "A";
  return settings;
}

const SimulatedCArm& flat_panel() {
  static const SimulatedCArm simulated = [] {
    SimulatedCArm six = usual_c_arm();
    six.exposure.seed = 401;
    return six;
  }();
  return simulated;
}

const CameraFindings& found_on_flat_panel() {
  static const CameraFindings findings =
      calibrate_with_balls(pictures_of(flat_panel()), helix_phantom(), camera_a());
  return findings;
}

double turn_deg(const RigidTransform& a, const RigidTransform& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear() * b.linear().transpose())).angle() * 180 /
         std::numbers::pi;
}

TEST(CameraCalibration, SixViewsGiveFocalLengthAndPose) {
  const CameraCalibration truth = camera_at(flat_panel(), 0);
  const CameraCalibration found = found_on_flat_panel().calibration();

  EXPECT_TRUE(found_on_flat_panel().is_usable());
  EXPECT_NEAR(found.fx / truth.fx, 1, 0.005);
  EXPECT_LT(turn_deg(found.T_camera_world, truth.T_camera_world), 0.2);
  // Where the phantom stands, not at the camera's centre: the depth goes with the focal length.
  const Eigen::Vector3d off =
      found.T_camera_world * Eigen::Vector3d::Zero() - truth.T_camera_world * Eigen::Vector3d::Zero();
  EXPECT_LT(off.norm(), 1.0) << off.transpose();
}

TEST(CameraCalibration, WhatItSaysOfItsErrorsIsNotFarFromWhatTheyAre) {
  const CameraCalibration truth = camera_at(flat_panel(), 0);
  const CameraCalibration found = found_on_flat_panel().calibration();

  ASSERT_TRUE(found.focal_sigma && found.pose_sigma_deg);
  EXPECT_LT(std::abs(found.fx / truth.fx - 1), 4 * *found.focal_sigma);
  EXPECT_GT(*found.focal_sigma, 1e-5);
  EXPECT_LT(*found.focal_sigma, 0.005);
  EXPECT_LT(*found.calibration_residual_px, 0.2);
}

TEST(CameraCalibration, AFlatPanelHasNoDistortionAndItsProjectionsFit) {
  const CameraCalibration found = found_on_flat_panel().calibration();
  const Camera truth(camera_at(flat_panel(), 0));
  const Camera estimate(found);

  EXPECT_EQ(found.distortion, (std::array<double, 5>{}));
  for (const PhantomBall& ball : helix_phantom().balls) {
    const auto expected = truth.project(ball.p_phantom_mm);
    const auto got = estimate.project(ball.p_phantom_mm);
    ASSERT_TRUE(expected && got);
    EXPECT_LT((expected->p_image_px - got->p_image_px).norm(), 0.2) << ball.name;
  }
}

TEST(CameraCalibration, WithAnglesTheCArmIsFound) {
  CameraSettings settings = camera_a();
  settings.angles = flat_panel().angles;
  settings.pixel_pitch_mm = flat_panel().c_arm.pixel_pitch_mm;

  const CameraFindings findings = calibrate_with_balls(pictures_of(flat_panel()), helix_phantom(), settings);

  ASSERT_TRUE(findings.c_arm.has_value());
  EXPECT_NEAR(findings.c_arm->c_arm.source_isocentre_mm, flat_panel().c_arm.source_isocentre_mm, 3);
  EXPECT_NEAR(findings.c_arm->c_arm.source_detector_mm, flat_panel().c_arm.source_detector_mm, 6);
  EXPECT_LT(findings.c_arm->rms_turn_deg, 0.2);
}

TEST(CameraCalibration, ExchangedAnglesAreNotBelieved) {
  CameraSettings settings = camera_a();
  settings.angles = flat_panel().angles;
  for (GantryAngles& angles : settings.angles) {
    angles.primary_deg = -angles.primary_deg;
  }
  settings.pixel_pitch_mm = flat_panel().c_arm.pixel_pitch_mm;

  EXPECT_FALSE(calibrate_with_balls(pictures_of(flat_panel()), helix_phantom(), settings).is_usable());
}

TEST(CameraCalibration, MirroredImagesAreFoundOut) {
  SimulatedCArm simulated = flat_panel();
  simulated.angles.resize(1);
  simulated.mirrored = true;

  EXPECT_TRUE(calibrate_with_balls(pictures_of(simulated), helix_phantom(), camera_a()).mirrored);
}

TEST(CameraCalibration, WithDistortionSigmaOfThePoseHasWhatIsLeftOpen) {
  SimulatedCArm simulated = flat_panel();
  simulated.angles.resize(3);
  simulated.distortion = {0.8, -1.5, 0.002, -0.001, 0};

  const CameraFindings findings = calibrate_with_balls(pictures_of(simulated), helix_phantom(), camera_a());

  const FittedView& view = findings.chosen.fit.views[0];
  const RigidTransform error = camera_at(simulated, 0).T_camera_world * view.T_camera_world.inverse();
  const Eigen::Vector3d pivot(0, 0, view.pivot_depth_mm);
  const Eigen::Vector3d off_mm = error * pivot - pivot;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LT(std::abs(off_mm[axis]), 3 * view.sigma_mm()[axis]) << axis;
  }
  EXPECT_GT(view.sigma_mm().x(), 0.3) << "the principal point is not known better than by 2 px";
  EXPECT_NEAR(findings.calibration().distortion[0], 0.8, 0.3);
}

TEST(CameraCalibration, AnImageWithoutAPhantomIsRefused) {
  BallPhantom nothing = helix_phantom();
  for (PhantomBall& ball : nothing.balls) ball.p_phantom_mm += Eigen::Vector3d(2000, 2000, 0);

  EXPECT_THROW(calibrate_with_balls({picture_at(flat_panel(), nothing, 0)}, helix_phantom(), camera_a()),
               PhantomError);
}

TEST(CameraCalibration, ImagesOfDifferentSizesAreRefused) {
  SimulatedCArm small = flat_panel();
  small.width = 400;

  EXPECT_THROW(calibrate_with_balls(
                   {picture_at(flat_panel(), helix_phantom(), 0), picture_at(small, helix_phantom(), 1)},
                   helix_phantom(), camera_a()),
               PhantomError);
}

TEST(BallPhantom, APhantomInMetresOrWithoutBallsIsRefused) {
  const std::string file = to_toml(helix_phantom());
  EXPECT_EQ(parse_ball_phantom(file, "p.toml").balls.size(), helix_phantom().balls.size());
  EXPECT_THROW(parse_ball_phantom("format = 1\nname = \"x\"\nballs = []\n", "p.toml"), PhantomError);
  EXPECT_THROW(parse_ball_phantom("format = 1\nname = \n", "p.toml"), PhantomError);
  BallPhantom metres = helix_phantom();
  for (PhantomBall& ball : metres.balls) {
    ball.p_phantom_mm /= 1000;
    ball.diameter_mm /= 1000;
  }
  EXPECT_THROW(parse_ball_phantom(to_toml(metres), "p.toml"), PhantomError);
}

}  // namespace
}  // namespace tubed
