#include "idl/geometry/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

namespace tubed {
namespace {

/// The camera of Sec. 3.1: 400 x 600 px, f = 2000 px, principal point (200, 300), 1200 mm from the patient.
CameraCalibration camera_of_the_paper() {
  CameraCalibration calibration;
  calibration.name = "frontal";
  calibration.width = 400;
  calibration.height = 600;
  calibration.fx = calibration.fy = 2000;
  calibration.cx = 200;
  calibration.cy = 300;
  calibration.T_camera_world.translation() = Eigen::Vector3d(0, 0, 1200);
  return calibration;
}

/// A wide camera anywhere, with a distortion that moves points by some tens of pixels and stays invertible.
CameraCalibration random_camera(std::mt19937& random) {
  std::uniform_real_distribution<double> one(-1, 1);
  CameraCalibration calibration;
  calibration.width = 1024;
  calibration.height = 768;
  calibration.fx = 900 + 200 * one(random);
  calibration.fy = 900 + 200 * one(random);
  calibration.cx = 512 + 30 * one(random);
  calibration.cy = 384 + 30 * one(random);
  calibration.distortion = {0.2 * one(random), 0.1 * one(random), 0.01 * one(random), 0.01 * one(random),
                            0.05 * one(random)};
  const Eigen::Vector3d axis(one(random), one(random), one(random));
  calibration.T_camera_world = Eigen::AngleAxisd(3 * one(random), axis.normalized());
  calibration.T_camera_world.translation() << 50 * one(random), 50 * one(random), 1000;
  return calibration;
}

Eigen::Vector3d random_point_in_view_world_mm(const CameraCalibration& calibration, std::mt19937& random) {
  std::uniform_real_distribution<double> one(-1, 1);
  const double depth_mm = 700 + 300 * one(random);
  const Eigen::Vector3d p_camera_mm(0.45 * one(random) * depth_mm, 0.35 * one(random) * depth_mm, depth_mm);
  return calibration.T_camera_world.inverse() * p_camera_mm;
}

Eigen::Vector2d projected_by_opencv_px(const CameraCalibration& calibration,
                                       const Eigen::Vector3d& p_world_mm) {
  const RigidTransform& T = calibration.T_camera_world;
  const Eigen::AngleAxisd turn(T.linear());
  const Eigen::Vector3d rotation = turn.angle() * turn.axis();
  const cv::Matx33d K(calibration.fx, 0, calibration.cx, 0, calibration.fy, calibration.cy, 0, 0, 1);
  const std::vector<double> distortion(calibration.distortion.begin(), calibration.distortion.end());
  std::vector<cv::Point2d> p_image_px;
  cv::projectPoints(std::vector<cv::Point3d>{{p_world_mm.x(), p_world_mm.y(), p_world_mm.z()}},
                    cv::Vec3d(rotation.x(), rotation.y(), rotation.z()),
                    cv::Vec3d(T.translation().x(), T.translation().y(), T.translation().z()), K, distortion,
                    p_image_px);
  return {p_image_px[0].x, p_image_px[0].y};
}

TEST(Camera, ThePapersCameraSeesAMillimetreAtThePatientAsFiveThirdsOfAPixel) {
  const Camera camera(camera_of_the_paper());

  const auto projection = camera.project({30, -60, 0});

  ASSERT_TRUE(projection);
  EXPECT_NEAR(projection->p_image_px.x(), 200 + 30 * 2000.0 / 1200, 1e-12);
  EXPECT_NEAR(projection->p_image_px.y(), 300 - 60 * 2000.0 / 1200, 1e-12);
  EXPECT_NEAR(projection->depth_mm, 1200, 1e-12);
  EXPECT_NEAR(projection->J_image_world(0, 0), 5.0 / 3, 1e-12);
  EXPECT_NEAR(projection->J_image_world(1, 0), 0, 1e-12);
}

TEST(Camera, ProjectsAsOpenCvDoesWhateverTheDistortion) {
  std::mt19937 random(2);
  for (int round = 0; round < 1000; ++round) {
    const CameraCalibration calibration = random_camera(random);
    const Eigen::Vector3d p_world_mm = random_point_in_view_world_mm(calibration, random);

    const auto projection = Camera(calibration).project(p_world_mm);

    ASSERT_TRUE(projection);
    const Eigen::Vector2d expected_px = projected_by_opencv_px(calibration, p_world_mm);
    EXPECT_LT((projection->p_image_px - expected_px).norm(), 1e-8) << "round " << round;
  }
}

TEST(Camera, ItsJacobianIsTheFiniteDifferenceOfItsProjection) {
  constexpr double kStep_mm = 1e-3;
  std::mt19937 random(3);
  for (int round = 0; round < 200; ++round) {
    const CameraCalibration calibration = random_camera(random);
    const Camera camera(calibration);
    const Eigen::Vector3d p_world_mm = random_point_in_view_world_mm(calibration, random);
    Eigen::Matrix<double, 2, 3> difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step_mm = kStep_mm * Eigen::Vector3d::Unit(axis);
      difference.col(axis) = (camera.project(p_world_mm + step_mm)->p_image_px -
                              camera.project(p_world_mm - step_mm)->p_image_px) /
                             (2 * kStep_mm);
    }

    const Eigen::Matrix<double, 2, 3> J_image_world = camera.project(p_world_mm)->J_image_world;

    EXPECT_LT((J_image_world - difference).cwiseAbs().maxCoeff(), 1e-8) << "round " << round;
  }
}

TEST(Camera, ARayThroughAnImagePointProjectsBackOntoIt) {
  std::mt19937 random(4);
  for (int round = 0; round < 1000; ++round) {
    const CameraCalibration calibration = random_camera(random);
    const Camera camera(calibration);
    const Eigen::Vector3d p_world_mm = random_point_in_view_world_mm(calibration, random);
    const Eigen::Vector2d p_image_px = camera.project(p_world_mm)->p_image_px;

    const Eigen::Vector3d ray = camera.ray_camera(p_image_px);

    const Eigen::Vector3d p_camera_mm = calibration.T_camera_world * p_world_mm;
    EXPECT_EQ(ray.z(), 1);
    EXPECT_LT((ray - p_camera_mm / p_camera_mm.z()).norm(), 1e-10) << "round " << round;
  }
}

TEST(Camera, APointBehindTheCameraIsNotInTheImage) {
  const Camera camera(camera_of_the_paper());

  EXPECT_FALSE(camera.project({0, 0, -1200.001}));
  EXPECT_FALSE(camera.project({5, 5, -1200}));  // in the plane of the camera's centre
  EXPECT_TRUE(camera.project({0, 0, -1199.999}));
}

TEST(Camera, APointThatIsNotANumberIsNotInTheImage) {
  const Camera camera(camera_of_the_paper());
  const double nan = std::numeric_limits<double>::quiet_NaN();

  EXPECT_FALSE(camera.project({0, 0, nan}));
  EXPECT_FALSE(camera.contains({nan, 10}));
}

TEST(Camera, TheImageReachesFromTheCentreOfItsFirstPixelToThatOfItsLast) {
  const Camera camera(camera_of_the_paper());

  EXPECT_TRUE(camera.contains({0, 0}));
  EXPECT_TRUE(camera.contains({399, 599}));
  EXPECT_FALSE(camera.contains({-0.01, 10}));
  EXPECT_FALSE(camera.contains({399.01, 10}));
  EXPECT_FALSE(camera.contains({10, -0.01}));
  EXPECT_FALSE(camera.contains({10, 599.01}));
}

TEST(Camera, AMarginShrinksTheImageAndANegativeOneGrowsIt) {
  const Camera camera(camera_of_the_paper());

  EXPECT_FALSE(camera.contains({4, 100}, 5));
  EXPECT_TRUE(camera.contains({5, 100}, 5));
  EXPECT_TRUE(camera.contains({-5, 604}, -5));
  EXPECT_FALSE(camera.contains({-5.1, 604}, -5));
}

}  // namespace
}  // namespace tubed
