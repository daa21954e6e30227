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

TEST(MisreadImages, WhereThePolarityIsLeftOpenItIsFoundAndNobodyHasToChangeAnything) {
  MisreadBench bench(Picture::kNegative, PolaritySetting::kAuto);
  EXPECT_FALSE(bench.look(0).polarity_of(0));
  const MisreadImages& misread = bench.look(2);
  EXPECT_EQ(misread.polarity_of(0), RidgePolarity::kBright);
  EXPECT_FALSE(misread.is_wrong());
  bench.measure(RidgePolarity::kBright);
  bench.look(0.14);
  EXPECT_FALSE(misread.found()) << "that was of images that were read as dark";
  bench.look(3);
  EXPECT_FALSE(misread.polarity_of(0)) << "they are read as they are";
}

TEST(MisreadImages, APolarityThatIsStatedIsAPersonsToChange) {
  MisreadBench bench(Picture::kNegative, PolaritySetting::kDark);
  const MisreadImages& misread = bench.look(2);
  EXPECT_FALSE(misread.polarity_of(0));
  EXPECT_TRUE(misread.is_wrong());
}

TEST(MisreadImages, AMirrorIsAPersonsToTurnWhateverIsLeftOpen) {
  MisreadBench bench(Picture::kMirrored, PolaritySetting::kAuto);
  const MisreadImages& misread = bench.look(2);
  EXPECT_FALSE(misread.polarity_of(0));
  EXPECT_TRUE(misread.is_wrong());
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

RoomDescription two_equal_cameras() {
  RoomDescription room = one_view_room();
  room.cameras.push_back(room.cameras.front());
  room.cameras.back().name = "B";
  return room;
}

// An image a second, while the other one shows nothing whichever way it is read.
TEST(MisreadImages, ACameraThatBringsFewImagesDoesNotWaitBehindOneThatBringsMany) {
  MisreadBench bench(Picture::kWithoutTube, PolaritySetting::kAuto, two_equal_cameras());
  bench.look(10);
  bench.of_second_camera = MisreadBench(Picture::kNegative, PolaritySetting::kAuto).image();
  const MisreadImages& misread = bench.look(8);
  ASSERT_TRUE(misread.found());
  EXPECT_EQ(misread.found()->camera, 1U);
  EXPECT_EQ(misread.polarity_of(1), RidgePolarity::kBright);
}

TEST(MisreadImages, WhatWasReadOfACameraIsKeptWhenAnotherOneIsReadOtherwise) {
  MisreadBench bench(Picture::kWithoutTube, PolaritySetting::kAuto, two_equal_cameras());
  bench.of_second_camera = MisreadBench(Picture::kNegative, PolaritySetting::kAuto).image();
  ASSERT_TRUE(bench.look(8).found());
  bench.measure(RidgePolarity::kBright);
  EXPECT_TRUE(bench.look(0.14).polarity_of(1));
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
              "negatives: leave polarity of [frangi] at \"auto\"");
  }
}

TEST(MisreadImagesEstimator, WithThePolarityLeftOpenANegativeIsValidOnceItIsReadAsOne) {
  for (const EstimatorMode mode : {EstimatorMode::kFilter, EstimatorMode::kJoint}) {
    MisreadBench bench(Picture::kNegative, PolaritySetting::kAuto);
    EstimatorSettings settings;
    settings.mode = mode;
    const auto estimator = make_estimator(settings, bench.room().instruments.front(), bench.room());
    const auto estimate = std::make_unique<TubeEstimate>();
    int until_found = 0;
    for (; until_found < 18 && !estimator->polarity_of(0); ++until_found) {
      estimator->estimate(bench.next(), *estimate);
      EXPECT_NE(estimate->validity, Validity::kValid) << until_found;
      EXPECT_FALSE(estimate->reasons.has(Reason::kEmImageDisagree)) << until_found;
    }
    ASSERT_EQ(estimator->polarity_of(0), RidgePolarity::kBright) << name_of(mode);
    bench.measure(estimator->polarity_of(0));
    for (int i = 0; i < 8; ++i) estimator->estimate(bench.next(), *estimate);
    EXPECT_EQ(estimate->validity, Validity::kValid) << name_of(mode);
    EXPECT_GT(estimate->image_inlier_ratio, 0.7F);
    EXPECT_FALSE(estimator->polarity_of(0));
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
