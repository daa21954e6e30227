// Scale and direction of ridges, depths of images, polarity, instruction sets.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <stdexcept>

#include "tests/daemon/image/frangi_bed.hpp"

namespace tubed {
namespace {

constexpr std::size_t kCentre = kBedHeight / 2 * kBedWidth + kBedWidth / 2;

/// A dark Gaussian ridge of standard deviation `sigma` through the centre, along the direction `angle`.
std::vector<float> ridge(double sigma, double angle) {
  std::vector<float> grey;
  for (int y = 0; y < kBedHeight; ++y) {
    for (int x = 0; x < kBedWidth; ++x) {
      const double across = -std::sin(angle) * (x - kBedWidth / 2) + std::cos(angle) * (y - kBedHeight / 2);
      grey.push_back(static_cast<float>(200 - 60 * std::exp(-0.5 * across * across / (sigma * sigma))));
    }
  }
  return grey;
}

// sigma^2 times the second derivative across a Gaussian ridge of width w is w sigma^2 / (w^2 +
// sigma^2)^(3/2), greatest at sigma = sqrt(2) w.
TEST(FrangiMaps, TheScaleIsThatOfTheRidgeTimesRootTwo) {
  FrangiSettings settings = fixed_settings();
  settings.scales_px = {1.0, 1.5, 2.0, 3.0, 4.5};
  for (const double sigma : settings.scales_px) {
    FrangiFilter filter(kBedWidth, kBedHeight, settings);
    OwnedMaps maps;
    filter.filter(ridge(sigma / std::sqrt(2.0), 0.4), maps.all());
    EXPECT_FLOAT_EQ(maps.scale_px[kCentre], static_cast<float>(sigma));
  }
}

TEST(FrangiMaps, TheDirectionIsAlongTheRidge) {
  FrangiFilter filter(kBedWidth, kBedHeight, fixed_settings());
  for (const double angle : {-1.5, -1.0, -0.3, 0.0, 0.2, 0.785, 1.3, 1.55}) {
    OwnedMaps maps;
    filter.filter(ridge(1.6, angle), maps.all());
    const double found = static_cast<double>(ridge_angle_rad(maps.cosine[kCentre], maps.sine[kCentre]));
    EXPECT_NEAR(std::remainder(found - angle, M_PI), 0, 0.01) << angle;
    EXPECT_NEAR(std::hypot(maps.cosine[kCentre], maps.sine[kCentre]), 1, 1e-5);
  }
}

TEST(FrangiMaps, WhereNothingAnswersThereIsNeitherScaleNorDirection) {
  FrangiFilter filter(kBedWidth, kBedHeight, fixed_settings());
  OwnedMaps maps;
  filter.filter(tubes<float>(), maps.all());
  std::size_t silent = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (maps.vesselness[i] == 0) {
      ++silent;
      ASSERT_EQ(maps.scale_px[i], 0);
      ASSERT_EQ(std::hypot(maps.cosine[i], maps.sine[i]), 0);
    } else {
      ASSERT_GE(maps.scale_px[i], 1.0F);
      ASSERT_NEAR(std::hypot(maps.cosine[i], maps.sine[i]), 1, 1e-4);
    }
  }
  EXPECT_GT(silent, 0U);
}

TEST(FrangiMaps, VesselnessIsTheSameWithAndWithoutTheOtherMaps) {
  FrangiFilter filter(kBedWidth, kBedHeight, FrangiSettings{});
  OwnedMaps maps;
  std::vector<float> alone(kPixels);
  filter.filter(tubes<float>(), maps.all());
  filter.filter(tubes<float>(), alone);
  EXPECT_EQ(maps.vesselness, alone);
}

TEST(FrangiMaps, EqualGreyValuesOfAnyDepthHaveEqualVesselness) {
  FrangiFilter filter(kBedWidth, kBedHeight, FrangiSettings{});
  std::vector<float> from_bytes(kPixels);
  std::vector<float> from_words(kPixels);
  std::vector<float> from_floats(kPixels);
  filter.filter(tubes<std::uint8_t>(), from_bytes);
  filter.filter(tubes<std::uint16_t>(), from_words);
  filter.filter(tubes<float>(), from_floats);
  EXPECT_EQ(from_bytes, from_floats);
  EXPECT_EQ(from_words, from_floats);
}

TEST(FrangiMaps, ABrightRidgeIsADarkOneOfTheNegative) {
  FrangiSettings settings = fixed_settings();
  FrangiFilter dark(kBedWidth, kBedHeight, settings);
  settings.polarity = PolaritySetting::kBright;
  FrangiFilter bright(kBedWidth, kBedHeight, settings);
  std::vector<float> negative = tubes<float>();
  for (float& pixel : negative) {
    pixel = 255 - pixel;
  }
  OwnedMaps of_dark;
  OwnedMaps of_bright;
  dark.filter(tubes<float>(), of_dark.all());
  bright.filter(negative, of_bright.all());
  for (std::size_t i = 0; i < kPixels; ++i) {
    ASSERT_NEAR(of_dark.vesselness[i], of_bright.vesselness[i], 1e-3);
  }
}

TEST(FrangiMaps, EveryInstructionSetFindsTheSame) {
  for (const FrangiSmoothing smoothing : {FrangiSmoothing::kFloat, FrangiSmoothing::kInteger16}) {
    FrangiSettings settings;
    settings.smoothing = smoothing;
    FrangiFilter filter(kBedWidth, kBedHeight, settings);
    OwnedMaps best;
    filter.filter(tubes<std::uint8_t>(), best.all());
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().DeInit();
      OwnedMaps maps;
      filter.filter(tubes<std::uint8_t>(), maps.all());
      EXPECT_STREQ(frangi_instruction_set(), hwy::TargetName(target));
      for (std::size_t i = 0; i < kPixels; ++i) {
        ASSERT_NEAR(maps.vesselness[i], best.vesselness[i], 1e-4) << hwy::TargetName(target);
      }
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().DeInit();
  }
}

TEST(Frangi, RefusesWhatItCannotFilter) {
  FrangiSettings none;
  none.scales_px.clear();
  FrangiSettings coarse;
  coarse.scales_px = {2.0, 21.0};
  EXPECT_THROW(FrangiFilter(64, 64, none), std::invalid_argument);
  EXPECT_THROW(FrangiFilter(64, 64, coarse), std::invalid_argument);
  EXPECT_THROW(FrangiFilter(15, 64, FrangiSettings{}), std::invalid_argument);
  EXPECT_THROW(FrangiFilter(64, 0, FrangiSettings{}), std::invalid_argument);
}

}  // namespace
}  // namespace tubed
