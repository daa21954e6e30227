#include "daemon/image/measured_view.hpp"

#include <gtest/gtest.h>

#include <array>

namespace tubed {
namespace {

/// 1200 mm in front of the world's origin, distorted, with a principal point beside the middle.
CameraCalibration panel_camera(double focal_px, int width = 1024, int height = 1024) {
  CameraCalibration camera;
  camera.name = "A";
  camera.width = width;
  camera.height = height;
  camera.fx = focal_px;
  camera.fy = 1.01 * focal_px;
  camera.cx = width / 2.0 + 7.25;
  camera.cy = height / 2.0 - 3.5;
  camera.distortion = {-0.1, 0.02, 1e-3, -2e-3, 0};
  camera.T_camera_world.translation() = Eigen::Vector3d(3, -5, 1200);
  return camera;
}

std::array<InstrumentDescription, 1> tube_of(double diameter_mm) {
  std::array<InstrumentDescription, 1> instruments;
  instruments[0].diameter_mm = diameter_mm;
  return instruments;
}

int binning_for_width(double width_px) { return binning_of(panel_camera(width_px * 1200 / 3), tube_of(3)); }

// Square c covers the pixels k c .. k c + k - 1, whose middle is k c + (k - 1) / 2.
TEST(MeasuredView, ABinnedCameraSeesAPointInTheSquareThatHoldsItsPixel) {
  const CameraCalibration detector = panel_camera(5600);
  for (const int binning : {2, 4, 8}) {
    const Camera fine(detector);
    const Camera coarse(binned(detector, binning));
    for (const Eigen::Vector3d& p_mm :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(61, -44, 30), Eigen::Vector3d(-80, 90, -120)}) {
      const Eigen::Vector2d fine_px = fine.project(p_mm)->p_image_px;
      const Eigen::Vector2d coarse_px = coarse.project(p_mm)->p_image_px;
      EXPECT_NEAR(binning * coarse_px.x() + (binning - 1) / 2.0, fine_px.x(), 1e-9);
      EXPECT_NEAR(binning * coarse_px.y() + (binning - 1) / 2.0, fine_px.y(), 1e-9);
      EXPECT_NEAR((unbinned_px(coarse_px, binning) - fine_px).norm(), 0, 1e-9);
    }
  }
}

TEST(MeasuredView, AnImageOfItsOwnGeometryIsBinnedLikeItsCamera) {
  const CameraCalibration detector = panel_camera(5600);
  const ViewGeometry of_image = binned(geometry_of(detector), 4);
  const CameraCalibration measured = binned(detector, 4);
  EXPECT_EQ(of_image.fx, measured.fx);
  EXPECT_EQ(of_image.fy, measured.fy);
  EXPECT_EQ(of_image.cx, measured.cx);
  EXPECT_EQ(of_image.cy, measured.cy);
}

TEST(MeasuredView, ASampleNamesAViewInPixelsOfTheDetector) {
  const CameraCalibration detector = panel_camera(5600);
  for (const int binning : {1, 2, 8}) {
    const ViewUsed used = used_view(3, binned(detector, binning), from_ns(77), nullptr);
    EXPECT_EQ(used.camera, 3U);
    EXPECT_FALSE(used.has_own_geometry);
    EXPECT_EQ(used.exposure_monotonic_ns, 77);
    EXPECT_NEAR(used.focal_length_px[0], detector.fx, 1e-9) << binning;
    EXPECT_NEAR(used.focal_length_px[1], detector.fy, 1e-9) << binning;
    EXPECT_NEAR(used.principal_point_px[0], detector.cx, 1e-9) << binning;
    EXPECT_NEAR(used.principal_point_px[1], detector.cy, 1e-9) << binning;
  }
}

TEST(MeasuredView, TheSamplesPoseIsRowByRowWithWhatIsNotKnownOfIt) {
  CameraCalibration camera = panel_camera(2000);
  camera.T_camera_world.linear() << 0, 0, 1, 0, 1, 0, -1, 0, 0;
  PoseSigma sigma;
  sigma.rotation_rad = {0.01, 0.02, 0.03};
  sigma.translation_mm = {1, 2, 3};
  const ViewUsed used = used_view(0, camera, from_ns(1), &sigma);
  EXPECT_TRUE(used.has_own_geometry);
  EXPECT_EQ(used.T_camera_world,
            (std::array<double, 16>{0, 0, 1, 3, 0, 1, 0, -5, -1, 0, 0, 1200, 0, 0, 0, 1}));
  EXPECT_EQ(used.sigma_rotation_rad, (std::array<float, 3>{0.01F, 0.02F, 0.03F}));
  EXPECT_EQ(used.sigma_translation_mm, (std::array<float, 3>{1, 2, 3}));
}

TEST(MeasuredView, WhatDoesNotFillASquareIsLeftOut) {
  const CameraCalibration measured = binned(panel_camera(5600, 1023, 601), 4);
  EXPECT_EQ(measured.width, 255);
  EXPECT_EQ(measured.height, 150);
}

TEST(MeasuredView, ATubeUpToSevenPixelsWideIsMeasuredAsItIs) {
  for (const double width_px : {0.5, 2.0, 3.9, 6.99}) EXPECT_EQ(binning_for_width(width_px), 1) << width_px;
}

TEST(MeasuredView, AWiderTubeIsThreeAndAHalfToSevenPixelsWideInWhatIsMeasured) {
  for (double width_px = 7.01; width_px < 56; width_px *= 1.03) {
    const double measured_px = width_px / binning_for_width(width_px);
    EXPECT_GE(measured_px, 3.5) << width_px;
    EXPECT_LE(measured_px, 7.0) << width_px;
  }
  EXPECT_EQ(binning_for_width(200), kMaxBinning);
}

TEST(MeasuredView, TheThinnestInstrumentDecides) {
  std::array<InstrumentDescription, 2> instruments;
  instruments[0].diameter_mm = 6;
  instruments[1].diameter_mm = 1.5;
  EXPECT_EQ(binning_of(panel_camera(5600), instruments), 1);
}

TEST(MeasuredView, AConfiguredBinningHoldsWhateverTheWidth) {
  CameraCalibration camera = panel_camera(5600);
  camera.binning = 1;
  EXPECT_EQ(binning_of(camera, tube_of(3)), 1);
  camera.binning = 8;
  EXPECT_EQ(binning_of(camera, tube_of(3)), 8);
}

TEST(MeasuredView, ASmallImageKeepsSixtyFourPixelsASide) {
  EXPECT_EQ(binning_of(panel_camera(16000, 300, 2048), tube_of(3)), 4);
  EXPECT_EQ(binning_of(panel_camera(16000, 100, 2048), tube_of(3)), 1);
}

TEST(MeasuredView, AViewThatLooksAwayFromTheWorldIsMeasuredAsItIs) {
  CameraCalibration camera = panel_camera(16000);
  camera.T_camera_world.translation().z() = -100;
  EXPECT_EQ(binning_of(camera, tube_of(3)), 1);
}

// Estimates of ordinary images do not change by a bit.
TEST(MeasuredView, WithoutBinningACameraIsTheSameBitByBit) {
  CameraCalibration camera = panel_camera(2000);
  camera.cx = 0.1;  // (0.1 + 0.5) - 0.5 is another number
  EXPECT_EQ(binned(camera, 1).cx, camera.cx);
  EXPECT_EQ(binned(camera, 1).fx, camera.fx);
  EXPECT_EQ(binned(camera, 1).T_camera_world.matrix(), camera.T_camera_world.matrix());
}

TEST(MeasuredView, AMeasuredRoomMeasuredAgainIsTheSame) {
  for (const int configured : {0, 4}) {
    RoomDescription room;
    room.cameras = {panel_camera(16000, 2048, 2048)};
    room.cameras[0].binning = configured;
    room.instruments = {tube_of(3)[0]};
    const RoomDescription once = measured_room(room);
    const RoomDescription twice = measured_room(once);
    EXPECT_EQ(once.cameras[0].width, configured == 0 ? 256 : 512);
    EXPECT_EQ(twice.cameras[0].width, once.cameras[0].width);
    EXPECT_EQ(twice.cameras[0].fx, once.cameras[0].fx);
  }
}

TEST(MeasuredView, AResidualInPixelsIsOfThePixelsThatAreMeasured) {
  CameraCalibration camera = panel_camera(5600);
  camera.calibration_residual_px = 0.8;
  EXPECT_EQ(binned(camera, 4).calibration_residual_px, 0.2);
}

}  // namespace
}  // namespace tubed
