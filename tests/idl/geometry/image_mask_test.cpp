#include "idl/geometry/image_mask.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace tubed {
namespace {

CameraCalibration camera_with(std::vector<int> masks, int width = 100, int height = 80) {
  CameraCalibration camera;
  camera.width = width;
  camera.height = height;
  camera.masks = std::move(masks);
  return camera;
}

TEST(ImageMask, APixelIsMaskedInsideItsRectangleOnly) {
  const CameraCalibration camera = camera_with({10, 20, 5, 3});
  EXPECT_TRUE(is_masked(camera, {10, 20}));
  EXPECT_TRUE(is_masked(camera, {14.4, 22.4}));
  EXPECT_FALSE(is_masked(camera, {9.4, 20}));
  EXPECT_FALSE(is_masked(camera, {15, 20}));
  EXPECT_FALSE(is_masked(camera, {10, 23}));
  EXPECT_FALSE(is_masked(camera, Eigen::Vector2d::Constant(std::nan(""))));
  EXPECT_FALSE(is_masked(camera, {1e300, -1e300}));
  EXPECT_FALSE(is_masked(camera_with({}), {10, 20}));
}

TEST(ImageMask, OfAMirroredCameraMasksAreWhereTheImageHasThemAsItComes) {
  CameraCalibration camera = camera_with({10, 20, 5, 3});
  camera.mirrored = true;
  EXPECT_TRUE(is_masked(camera, {100 - 1 - 10, 20}));
  EXPECT_TRUE(is_masked(camera, {100 - 1 - 14, 20}));
  EXPECT_FALSE(is_masked(camera, {10, 20}));
}

TEST(ImageMask, WhatCannotBeAMaskIsSaid) {
  EXPECT_EQ(fault_of_masks({}, 100, 80), "");
  EXPECT_EQ(fault_of_masks({0, 0, 100, 80, 99, 79, 1, 1}, 100, 80), "");
  EXPECT_EQ(fault_of_masks({0, 0, 100}, 100, 80),
            "expected four numbers for each mask: x, y, width, height; found 3 numbers");
  EXPECT_EQ(
      fault_of_masks({0, 0, 9, 9, 90, 5, 11, 9}, 100, 80),
      "mask 2: expected a rectangle inside the image of 100 x 80 px, found x 90, y 5, width 11, height 9");
  EXPECT_NE(fault_of_masks({0, 0, 0, 9}, 100, 80), "");
}

RC_GTEST_PROP(ImageMask, ABinnedPixelIsMaskedWhereOneOfItsOwnIs, ()) {
  const int width = *rc::gen::inRange(16, 70);
  const int height = *rc::gen::inRange(16, 70);
  const int x = *rc::gen::inRange(0, width);
  const int y = *rc::gen::inRange(0, height);
  CameraCalibration camera = camera_with(
      {x, y, *rc::gen::inRange(1, width - x + 1), *rc::gen::inRange(1, height - y + 1)}, width, height);
  camera.mirrored = *rc::gen::arbitrary<bool>();
  const int binning = *rc::gen::element(1, 2, 4, 8);
  CameraCalibration binned = camera;
  binned.masks = binned_masks(camera, binning);
  binned.width = width / binning;
  binned.height = height / binning;
  for (int row = 0; row < binned.height; ++row) {
    for (int column = 0; column < binned.width; ++column) {
      bool has_masked = false;
      for (int k = 0; k < binning * binning; ++k) {
        has_masked =
            has_masked || is_masked(camera, {column * binning + k % binning, row * binning + k / binning});
      }
      RC_ASSERT(is_masked(binned, {column, row}) == has_masked);
    }
  }
}

}  // namespace
}  // namespace tubed
