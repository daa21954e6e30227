#include "daemon/estimator/images/misread_images.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>

#include "tests/daemon/estimator/misread_bench.hpp"

namespace tubed {
namespace {

TEST(MisreadImages, NegativesAreFoundWithinTwoSeconds) {
  MisreadBench bench(Picture::kNegative);
  const auto& found = bench.look(2).found();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->reading, Discord::kNegative);
  EXPECT_EQ(found->camera, 0U);
  EXPECT_GT(found->agreeing, 0.7);
}

TEST(MisreadImages, MirroredImagesAreFoundWithinTwoSeconds) {
  MisreadBench bench(Picture::kMirrored);
  const auto& found = bench.look(2).found();
  ASSERT_TRUE(found);
  EXPECT_EQ(found->reading, Discord::kMirrored);
}

TEST(MisreadImages, NothingIsFoundInImagesThatAreReadAsTheyAre) {
  EXPECT_FALSE(MisreadBench(Picture::kAsItIs).look(5).found());
}

TEST(MisreadImages, NothingIsFoundInImagesWithoutATube) {
  EXPECT_FALSE(MisreadBench(Picture::kWithoutTube).look(5).found());
}

TEST(MisreadImages, NobodyLooksWhileImagesShowTheTube) {
  EXPECT_FALSE(MisreadBench(Picture::kNegative).look(5, false).found());
}

TEST(MisreadImages, WhatWasFoundIsForgotten) {
  MisreadBench bench(Picture::kNegative);
  ASSERT_TRUE(bench.look(2).found());
  bench.look(0).forget();
  EXPECT_FALSE(bench.look(0).found());
}

TEST(MisreadImages, TheImageIsLeftAsItWas) {
  MisreadBench bench(Picture::kNegative);
  const ImageMeasurement before = bench.image();
  bench.look(2);
  EXPECT_EQ(bench.image().grey, before.grey);
  EXPECT_EQ(bench.image().vesselness, before.vesselness);
}

/// The last of these estimates with a daemon's estimator, and what it says of coils and images.
std::pair<TubeEstimate, std::string> estimated(Picture picture, EstimatorMode mode) {
  MisreadBench bench(picture);
  EstimatorSettings settings;
  settings.mode = mode;
  const auto estimator = make_estimator(settings, bench.room().instruments.front(), bench.room());
  const auto estimate = std::make_unique<TubeEstimate>();
  for (int i = 0; i < 18; ++i) estimator->estimate(bench.next(), *estimate);
  std::array<char, 256> words{};
  const bool said = estimator->describe_disagreement(words);
  return {*estimate, said ? words.data() : ""};
}

TEST(MisreadImagesEstimator, ANegativeIsQuestionableAndNamed) {
  for (const EstimatorMode mode : {EstimatorMode::kFilter, EstimatorMode::kJoint}) {
    const auto& [estimate, words] = estimated(Picture::kNegative, mode);
    EXPECT_EQ(estimate.validity, Validity::kQuestionable);
    EXPECT_TRUE(estimate.reasons.has(Reason::kEmImageDisagree));
    EXPECT_EQ(estimate.agreement.explanation, Discord::kNegative);
    EXPECT_EQ(words,
              "cath-1: coils and images disagree: images of camera A show the tube when they are read as "
              "negatives: set polarity of [frangi] to the other word");
  }
}

TEST(MisreadImagesEstimator, AMirroredImageIsNamed) {
  const auto& [estimate, words] = estimated(Picture::kMirrored, EstimatorMode::kFilter);
  EXPECT_EQ(estimate.agreement.explanation, Discord::kMirrored);
  EXPECT_NE(words.find("camera A show the tube when they are mirrored left to right"), std::string::npos)
      << words;
}

TEST(MisreadImagesEstimator, NothingIsSaidOfImagesThatShowTheTube) {
  const auto& [estimate, words] = estimated(Picture::kAsItIs, EstimatorMode::kFilter);
  EXPECT_EQ(estimate.validity, Validity::kValid);
  EXPECT_EQ(words, "");
}

}  // namespace
}  // namespace tubed
