// An optical camera from pictures of a chequerboard that are computed ray by ray.
#include "clients/calibration/chequerboard.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/calibration/camera_calibration.hpp"

namespace tubed {
namespace {

constexpr Chequerboard kBoard{8, 6, 10};
constexpr int kWidth_px = 480;
constexpr int kHeight_px = 360;

CameraCalibration camera_before_board(double tilt_x_rad, double tilt_y_rad) {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = kWidth_px;
  camera.height = kHeight_px;
  camera.fx = camera.fy = 700;
  camera.cx = 243;
  camera.cy = 177;
  camera.distortion = {-0.12, 0.03, 0, 0, 0};
  camera.T_camera_world.linear() = (Eigen::AngleAxisd(tilt_x_rad, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(tilt_y_rad, Eigen::Vector3d::UnitY()))
                                       .toRotationMatrix();
  const Eigen::Vector3d middle_mm(35, 25, 0);  // of the inner corners
  camera.T_camera_world.translation() =
      Eigen::Vector3d(0, 0, 220) - camera.T_camera_world.linear() * middle_mm;
  return camera;
}

/// White 220 and black 40 with a white rim, each pixel the mean of 4 x 4 rays.
CalibrationPicture picture_of_board(const CameraCalibration& calibration) {
  const Camera camera(calibration);
  const RigidTransform T_board_camera = calibration.T_camera_world.inverse();
  CalibrationPicture picture{"board", kWidth_px, kHeight_px, {}};
  constexpr int kRays = 4;
  for (int y = 0; y < kHeight_px; ++y) {
    for (int x = 0; x < kWidth_px; ++x) {
      int black = 0;
      for (int ray = 0; ray < kRays * kRays; ++ray) {
        const Eigen::Vector2d at(x + (ray % kRays + 0.5) / kRays - 0.5,
                                 y + (ray / kRays + 0.5) / kRays - 0.5);
        const Eigen::Vector3d direction = T_board_camera.linear() * camera.ray_camera(at);
        const Eigen::Vector3d from = T_board_camera.translation();
        const Eigen::Vector3d p_mm = from - from.z() / direction.z() * direction;
        const int column = static_cast<int>(std::floor(p_mm.x() / kBoard.square_mm)) + 1;
        const int row = static_cast<int>(std::floor(p_mm.y() / kBoard.square_mm)) + 1;
        const bool is_inside = column >= 0 && column <= kBoard.columns && row >= 0 && row <= kBoard.rows;
        black += is_inside && (column + row) % 2 == 0 ? 1 : 0;
      }
      picture.pixels.push_back(220 - 180.0F * static_cast<float>(black) / (kRays * kRays));
    }
  }
  return picture;
}

std::vector<CalibrationPicture> four_pictures() {
  return {picture_of_board(camera_before_board(0, 0.05)), picture_of_board(camera_before_board(0.5, 0)),
          picture_of_board(camera_before_board(-0.2, 0.5)),
          picture_of_board(camera_before_board(-0.4, -0.4))};
}

CameraSettings camera_a() {
  CameraSettings settings;
  settings.camera = "A";
  return settings;
}

TEST(Chequerboard, FourTiltsGiveFocalLengthDistortionAndWhatTheySayOfThem) {
  const CameraFindings findings = calibrate_with_board(four_pictures(), kBoard, camera_a());

  const CameraCalibration found = findings.calibration();
  EXPECT_TRUE(findings.is_usable());
  EXPECT_NEAR(found.fx, 700, std::max(2.0, 3 * *found.focal_sigma * 700));
  EXPECT_NEAR(found.fx, 700, 7);
  EXPECT_NEAR(found.cx, 243, 4);
  EXPECT_NEAR(found.distortion[0], -0.12, 0.03);
  EXPECT_LT(*found.calibration_residual_px, 0.15);
}

TEST(Chequerboard, SquaresThatAreCountedForCornersAreMetWithWords) {
  const auto words_with = [](const std::vector<CalibrationPicture>& pictures, const Chequerboard& board) {
    try {
      calibrate_with_board(pictures, board, camera_a());
    } catch (const PhantomError& error) {
      return std::string(error.what());
    }
    return std::string("it was taken");
  };
  const std::vector<CalibrationPicture> pictures = four_pictures();

  EXPECT_NE(words_with(pictures, {9, 7, 10}).find("where four squares meet"), std::string::npos);
  EXPECT_NE(words_with({pictures[0], pictures[1]}, kBoard).find("a chequerboard is a plane"),
            std::string::npos);
  EXPECT_NE(words_with({pictures[0], pictures[0], pictures[0]}, kBoard).find("directions"), std::string::npos)
      << words_with({pictures[0], pictures[0], pictures[0]}, kBoard);
}

}  // namespace
}  // namespace tubed
