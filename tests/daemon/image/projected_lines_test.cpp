#include "daemon/image/projected_lines.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <memory>

#include "tests/daemon/image/camera_above.hpp"

namespace tubed {
namespace {

constexpr double kLength_mm = 100;
constexpr double kRadius_mm = 1.5;

/// A straight tube from its tip at `tip_mm` along `direction`, and the lines across it.
struct StraightTube {
  StraightTube(const Eigen::Vector3d& tip_mm, const Eigen::Vector3d& direction,
               const Camera& camera = camera_above()) {
    Eigen::Matrix3Xd C(3, spline.coefficient_count());
    for (Eigen::Index i = 0; i < C.cols(); ++i) {
      C.col(i) = tip_mm + static_cast<double>(i - 1) * spline.spacing_mm() * direction;
    }
    in_view = project_lines(camera, spline, C, layout, kRadius_mm, *lines);
  }
  UniformCubicBSpline spline{8, kLength_mm};
  LineLayout layout{kLength_mm};
  std::unique_ptr<CorrespondenceLines> lines = std::make_unique<CorrespondenceLines>();
  int in_view = 0;
};

TEST(ProjectedLines, LieTwoMillimetresApartAcrossTheTube) {
  const StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());
  EXPECT_EQ(tube.layout.count, 51);
  EXPECT_EQ(tube.in_view, 51);
  const CorrespondenceLine& line = (*tube.lines)[10];
  EXPECT_NEAR(line.base_px.x(), 100, 1e-9);
  EXPECT_NEAR(line.base_px.y(), 150 + 2 * (-60 + 20), 1e-9);
  EXPECT_NEAR(std::abs(line.normal.x()), 1, 1e-9);
  EXPECT_NEAR(line.half_width_px, 2 * kRadius_mm, 1e-9);
}

TEST(ProjectedLines, BehindAMaskAreNotInView) {
  CameraCalibration calibration = camera_above().calibration();
  calibration.masks = {90, 70, 20, 40};  // of rows 30, 34, 38 ...: from 70 to 106
  const StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY(), Camera(calibration));
  EXPECT_EQ(tube.in_view, 51 - 10);
  EXPECT_TRUE((*tube.lines)[9].in_view);
  EXPECT_FALSE((*tube.lines)[10].in_view);
  EXPECT_FALSE((*tube.lines)[19].in_view);
  EXPECT_TRUE((*tube.lines)[20].in_view);
}

TEST(ProjectedLines, OutsideTheImageAreNotInView) {
  const StraightTube tube({0, -100, 0}, Eigen::Vector3d::UnitY());
  // Rows 3 .. 296 are 3 px inside; the tip lies at row -50.
  EXPECT_FALSE((*tube.lines)[13].in_view);
  EXPECT_TRUE((*tube.lines)[14].in_view);
  EXPECT_EQ(tube.in_view, 51 - 14);
}

TEST(ProjectedLines, ATubeThatRunsTowardTheSourceHasNoSideToLookTo) {
  const StraightTube tube(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  EXPECT_EQ(tube.in_view, 0);
}

TEST(ProjectedLines, WhatASearchReadsIsTheReachAroundTheLinesAndMoreAroundTheTip) {
  const StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());
  ImageArea area(200, 300);
  add_lines(*tube.lines, tube.layout, 10, 22, area);
  // Column 100, rows 30 .. 230.
  EXPECT_TRUE(area.covers_box({89, 30}, {111, 230}));
  EXPECT_TRUE(area.covers_box({100, 7}, {100, 30}));
  EXPECT_FALSE(area.covers_box({70, 150}, {111, 150}));
}

TEST(ProjectedLines, ALineOfWhichNotAllIsMeasuredIsNotInView) {
  StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());
  ImageArea measured(200, 300);
  measured.add_box({0, 0}, {199, 159});
  const int dropped = drop_unmeasured_lines(measured, tube.layout, 10, 22, *tube.lines);
  // Line i at row 30 + 4 i; one pixel below is read as well: the last one before row 159 is 32.
  EXPECT_EQ(dropped, 51 - 33);
  EXPECT_TRUE((*tube.lines)[32].in_view);
  EXPECT_FALSE((*tube.lines)[33].in_view);
}

/// Noise of 40 .. 59 in 200 x 300 pixels.
ImageMeasurement noisy_image() {
  ImageMeasurement image;
  image.reserve(200, 300);
  for (std::size_t i = 0; i < image.grey.size(); ++i) {
    image.grey[i] = 40 + static_cast<float>(i * 7919 % 20);
  }
  image.darkest = 40;
  image.brightest = 59;
  return image;
}

/// Rows `first` to the last one, columns `from` to the last one.
void cover(ImageMeasurement& image, int first, int from, float grey) {
  for (int row = first; row < image.height; ++row) {
    const auto begin = image.grey.begin() + static_cast<std::ptrdiff_t>(row) * image.width;
    std::fill(begin + from, begin + image.width, grey);
  }
  image.darkest = std::min(image.darkest, grey);
  image.brightest = std::max(image.brightest, grey);
}

TEST(ProjectedLines, BehindABladeNoTubeCouldBeSeen) {
  for (const RidgePolarity polarity : {RidgePolarity::kDark, RidgePolarity::kBright}) {
    StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());
    ImageMeasurement image = noisy_image();
    image.polarity = polarity;
    cover(image, 150, 0, polarity == RidgePolarity::kDark ? 1 : 250);
    // Line i at row 30 + 4 i: 29 at 146, four pixels before the blade; 28 at 142.
    EXPECT_EQ(drop_blind_lines(image, tube.layout, 10, *tube.lines), 51 - 29);
    EXPECT_TRUE((*tube.lines)[28].in_view);
    EXPECT_FALSE((*tube.lines)[29].in_view);
    EXPECT_FALSE((*tube.lines)[50].in_view);
  }
}

TEST(ProjectedLines, ATubeDarkOnWhiteOrBrightOnBlackIsSeen) {
  for (const RidgePolarity polarity : {RidgePolarity::kDark, RidgePolarity::kBright}) {
    StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());
    ImageMeasurement image = noisy_image();
    image.polarity = polarity;
    cover(image, 150, 0, polarity == RidgePolarity::kDark ? 250 : 1);
    EXPECT_EQ(drop_blind_lines(image, tube.layout, 10, *tube.lines), 0);
  }
}

TEST(ProjectedLines, BesideABladeATubeIsSeen) {
  StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());  // at column 100
  ImageMeasurement image = noisy_image();
  cover(image, 0, 101, 1);
  EXPECT_EQ(drop_blind_lines(image, tube.layout, 10, *tube.lines), 0);
  cover(image, 0, 100, 1);
  EXPECT_EQ(drop_blind_lines(image, tube.layout, 10, *tube.lines), 51);
}

TEST(ProjectedLines, AnEvenImageIsNotBlind) {
  StraightTube tube({0, -60, 0}, Eigen::Vector3d::UnitY());
  ImageMeasurement image;
  image.reserve(200, 300);
  EXPECT_EQ(drop_blind_lines(image, tube.layout, 10, *tube.lines), 0);
}

TEST(ProjectedLines, OfAVeryLongTubeLieFurtherApart) {
  const LineLayout layout(1020);
  EXPECT_EQ(layout.count, LineSearch::kMaxLines);
  EXPECT_NEAR(layout.s_mm(layout.count - 1), 1020, 1e-9);
}

}  // namespace
}  // namespace tubed
