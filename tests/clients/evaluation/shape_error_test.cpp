#include "clients/evaluation/shape_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

/// Looks along world z from the origin; f = 100 px, image 101 x 101 px around the axis.
Camera camera_along_z() {
  return Camera({.name = "A", .width = 101, .height = 101, .fx = 100, .fy = 100, .cx = 50, .cy = 50});
}

SampledCentreline curve(const std::vector<double>& s_mm, const std::vector<Eigen::Vector3d>& points_mm) {
  SampledCentreline result{s_mm, Eigen::Matrix3Xd(3, static_cast<Eigen::Index>(points_mm.size()))};
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    result.p_world_mm.col(static_cast<Eigen::Index>(i)) = points_mm[i];
  }
  return result;
}

ShapeError error_of(const SampledCentreline& estimate, const SampledCentreline& truth,
                    ShapeErrorSettings settings = {}) {
  const Camera camera = camera_along_z();
  return shape_error(estimate, truth, {camera, camera}, settings).value();
}

TEST(ShapeError, OfTwoSamplingsOfTheSameLineIsZero) {
  const auto coarse = curve({0, 100}, {{0, 0, 100}, {100, 0, 100}});
  const auto fine = curve({0, 30, 70, 100}, {{0, 0, 100}, {30, 0, 100}, {70, 0, 100}, {100, 0, 100}});

  EXPECT_NEAR(error_of(coarse, fine).hausdorff_mm, 0, 1e-12);
  EXPECT_NEAR(error_of(coarse, fine).rms_mm, 0, 1e-12);
}

TEST(ShapeError, HausdorffSeesAnInventedHookThatNoTruePointIsNear) {
  const auto truth = curve({0, 50, 100}, {{0, 0, 100}, {50, 0, 100}, {100, 0, 100}});
  // A bulge 7 mm high between two true points: every true point still lies on the estimate.
  const auto estimate =
      curve({0, 20, 25, 30, 50, 100},
            {{0, 0, 100}, {20, 0, 100}, {25, 7, 100}, {30, 0, 100}, {50, 0, 100}, {100, 0, 100}});

  EXPECT_NEAR(error_of(estimate, truth).rms_mm, 0, 1e-12);
  EXPECT_NEAR(error_of(estimate, truth).hausdorff_mm, 7, 1e-12);
  EXPECT_NEAR(error_of(truth, estimate).hausdorff_mm, 7, 1e-12);
}

TEST(ShapeError, HausdorffIsFoundBetweenThePointsOfAPolyline) {
  const auto truth = curve({0, 40, 100, 140}, {{-30, 0, 100}, {-30, 40, 100}, {30, 40, 100}, {30, 0, 100}});
  // The estimate goes on straight back to the beginning: its points all lie on the truth, the middle of its
  // last segment is 30 mm from either end.
  const auto estimate = curve({0, 40, 100, 140, 200},
                              {{-30, 0, 100}, {-30, 40, 100}, {30, 40, 100}, {30, 0, 100}, {-30, 0, 100}});

  EXPECT_NEAR(error_of(estimate, truth).hausdorff_mm, 30, 1e-9);
}

TEST(ShapeError, WhatLiesBehindTheLastCoilIsNotJudged) {
  const auto truth = curve({0, 370, 380}, {{0, 0, 100}, {370, 0, 100}, {380, 0, 100}});
  const auto estimate = curve({0, 370, 380}, {{0, 0, 100}, {370, 0, 100}, {370, 10, 100}});

  EXPECT_NEAR(error_of(estimate, truth).hausdorff_mm, 0, 1e-12);
  EXPECT_NEAR(error_of(estimate, truth, {.s_max_mm = 380}).hausdorff_mm, 10, 1e-12);
}

TEST(ShapeError, SquaresOfTheAxesAddUpToTheWhole) {
  const auto truth = curve({0, 50}, {{0, 0, 100}, {50, 0, 100}});
  const auto estimate = curve({0, 50}, {{0, 2, 103}, {50, 1, 101}});

  const ShapeError error = error_of(estimate, truth, {.match = PointMatch::kArcLength});

  EXPECT_NEAR(error.y_mm, std::sqrt((4 + 1) / 2.0), 1e-12);
  EXPECT_NEAR(error.z_mm, std::sqrt((9 + 1) / 2.0), 1e-12);
  EXPECT_NEAR(error.rms_mm, std::sqrt(15 / 2.0), 1e-12);
}

TEST(ShapeError, InViewLooksOnlyAtWhatTheImageShows) {
  // At depth 100 mm one mm is one pixel: x = 0 .. 50 mm is in the image, 80 mm is not.
  const auto truth = curve({0, 40, 80}, {{0, 0, 100}, {40, 0, 100}, {80, 0, 100}});
  const auto estimate = curve({0, 40, 80}, {{0, 1, 100}, {40, 1, 100}, {80, 30, 100}});

  const ShapeError in_view =
      error_of(estimate, truth, {.match = PointMatch::kArcLength, .part = JudgedPart::kInView});

  EXPECT_EQ(in_view.point_count, 2U);
  EXPECT_NEAR(in_view.rms_mm, 1, 1e-12);
  EXPECT_LT(in_view.hausdorff_mm, 30);
}

TEST(ShapeError, OfATruthOutsideTheImageDoesNotExist) {
  const Camera camera = camera_along_z();
  const auto behind = curve({0, 10}, {{0, 0, -100}, {10, 0, -100}});

  EXPECT_FALSE(shape_error(behind, behind, {camera, camera}, {.part = JudgedPart::kInView}).has_value());
}

TEST(ShapeError, OfASinglePointDoesNotExist) {
  const Camera camera = camera_along_z();
  const auto point = curve({0}, {{0, 0, 100}});
  const auto line = curve({0, 10}, {{0, 0, 100}, {10, 0, 100}});

  EXPECT_FALSE(shape_error(point, line, {camera, camera}, {}).has_value());
}

TEST(PointAt, IsLinearBetweenPointsAndStopsAtTheEnds) {
  const auto line = curve({0, 10}, {{0, 0, 0}, {0, 0, 20}});

  EXPECT_TRUE(point_at(line, 2.5).isApprox(Eigen::Vector3d(0, 0, 5)));
  EXPECT_TRUE(point_at(line, 99).isApprox(Eigen::Vector3d(0, 0, 20)));
}

}  // namespace
}  // namespace tubed
