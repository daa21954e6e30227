#include "daemon/image/appearance_model.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tubed {
namespace {

/// Rows 0 .. 9 are a tube, grey 40 to 49 and vesselness 0.8; rows 20 .. 59 background, grey 100 to 139 and
/// vesselness 0.
struct Scene {
  explicit Scene(float darker = 0) {
    image.reserve(50, 60);
    for (std::size_t index = 0; index < image.grey.size(); ++index) {
      const auto row = static_cast<float>(index / 50);
      const bool tube = row < 10;
      image.grey[index] = (tube ? 40 : 80) + row - darker;
      image.vesselness[index] = tube ? 0.8F : 0.0F;
      if (tube || row >= 20) pixels.push_back({index, tube ? 1.0F : -8.0F});
    }
  }
  ImageMeasurement image;
  std::vector<PixelDistance> pixels;
};

TEST(AppearanceModel, WithoutLearningTubeAndBackgroundLookAlike) {
  const AppearanceModel model;
  EXPECT_FALSE(model.learned());
  EXPECT_EQ(model.foreground(10, 0.5F), model.background(10, 0.5F));
}

TEST(AppearanceModel, TellsTheTubeFromTheBackgroundItWasShown) {
  const Scene scene;
  AppearanceModel model;
  ASSERT_TRUE(model.learn(scene.image, scene.pixels, 1));
  EXPECT_GT(model.foreground(45, 0.8F), 20 * model.background(45, 0.8F));
  EXPECT_GT(model.background(120, 0), 20 * model.foreground(120, 0));
}

TEST(AppearanceModel, WhatWasNeverSeenIsPossibleInBoth) {
  const Scene scene;
  AppearanceModel model;
  model.learn(scene.image, scene.pixels, 1);
  EXPECT_GT(model.foreground(139, 0.4F), 0);
  EXPECT_GT(model.background(-1e6F, 1), 0);
}

TEST(AppearanceModel, ProbabilitiesOfAllBinsSumToOne) {
  const Scene scene;
  AppearanceModel model;
  model.learn(scene.image, scene.pixels, 1);
  double sum = 0;
  const double grey_bin = (139.0 - 40.0) / AppearanceModel::kGreyBins;
  for (int row = 0; row < AppearanceModel::kGreyBins; ++row) {
    for (int column = 0; column < AppearanceModel::kVesselnessBins; ++column) {
      const double root = (column + 0.5) / AppearanceModel::kVesselnessBins;
      sum += static_cast<double>(
          model.foreground(static_cast<float>(40 + (row + 0.5) * grey_bin), static_cast<float>(root * root)));
    }
  }
  EXPECT_NEAR(sum, 1, 1e-4);
}

TEST(AppearanceModel, PixelsNextToTheContourAreNeitherTubeNorBackground) {
  Scene scene;
  AppearanceModel model;
  model.learn(scene.image, scene.pixels, 1);
  const float before = model.background(45, 0.8F);
  for (PixelDistance& pixel : scene.pixels) {
    if (pixel.signed_distance_px > 0 && pixel.index % 2 == 0) pixel.signed_distance_px = -1;
  }
  ASSERT_TRUE(model.learn(scene.image, scene.pixels, 1));
  EXPECT_FLOAT_EQ(model.background(45, 0.8F), before);
}

TEST(AppearanceModel, LearnsAsSlowlyAsItIsTold) {
  const Scene scene;
  const Scene darker(20);
  AppearanceModel model;
  model.learn(scene.image, scene.pixels, 1);
  const float before = model.background(110, 0);
  AppearanceModel slow = model;
  ASSERT_TRUE(slow.learn(darker.image, darker.pixels, 0.1));
  AppearanceModel faster = model;
  ASSERT_TRUE(faster.learn(darker.image, darker.pixels, 0.2));
  // What two images say is mixed in proportion: twice the share moves twice as far.
  EXPECT_NEAR(static_cast<double>(faster.background(85, 0) - model.background(85, 0)),
              2 * static_cast<double>(slow.background(85, 0) - model.background(85, 0)), 1e-5);
  EXPECT_LT(slow.background(135, 0), model.background(135, 0)) << "grey 135 is in the first image alone";
  EXPECT_GT(before, 0);
}

TEST(AppearanceModel, TooFewPixelsTeachNothing) {
  const Scene scene;
  AppearanceModel model;
  EXPECT_FALSE(model.learn(scene.image, std::span(scene.pixels).first(100), 1)) << "tube alone";
  EXPECT_FALSE(model.learn(scene.image, std::span(scene.pixels).last(100), 1)) << "background alone";
  EXPECT_FALSE(model.learned());
}

}  // namespace
}  // namespace tubed
