#include "daemon/image/vesselness_meter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace tubed {
namespace {

using Eigen::Vector2d;

constexpr int kWidth = 203;
constexpr int kHeight = 170;

/// Two dark wires on noise, as whole grey values; `contrast` 1 is 60 grey levels. The steep one lies
/// `right_px` further right.
ImageMeasurement image_of_wires(double contrast, unsigned seed, double right_px = 0) {
  ImageMeasurement image;
  image.reserve(kWidth, kHeight);
  image.state = ImageState::kMeasured;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double first = (x - right_px - 60 - 0.3 * y) / 1.6;
      const double second = (y - 120 - 0.1 * x) / 2.0;
      const double wires = std::exp(-0.5 * first * first) + 0.7 * std::exp(-0.5 * second * second);
      const double grey = std::round(std::clamp(170 + contrast * (noise(random) - 60 * wires), 0.0, 255.0));
      image.grey[static_cast<std::size_t>(y * kWidth + x)] = static_cast<float>(grey);
      image.brightest = std::max(image.brightest, static_cast<float>(grey));
    }
  }
  std::fill(image.vesselness.begin(), image.vesselness.end(), -1.0F);
  return image;
}

ImageArea whole_area() {
  ImageArea area(kWidth, kHeight);
  area.add_whole();
  return area;
}

ImageArea left_wire() {
  ImageArea area(kWidth, kHeight);
  for (int y = 0; y < kHeight; y += 8) {
    const Vector2d centre(60 + 0.3 * y, y);
    area.add_box(centre.array() - 14, centre.array() + 14);
  }
  return area;
}

class Meters : public testing::TestWithParam<FrangiSmoothing> {
 protected:
  Meters() { settings_.smoothing = GetParam(); }
  FrangiSettings settings_;
};

TEST_P(Meters, ABandHoldsThePixelsOfTheWholeImageAndOnlyItCountsAsMeasured) {
  VesselnessMeter of_band(kWidth, kHeight, settings_);
  VesselnessMeter of_whole(kWidth, kHeight, settings_);
  for (unsigned seed = 1; seed < 5; ++seed) {
    ImageMeasurement band = image_of_wires(1, seed);
    ImageMeasurement whole = band;
    of_band.take(band, left_wire());
    of_whole.take(whole, whole_area());
    EXPECT_EQ(band.measured, left_wire());
    EXPECT_LT(band.measured.share(), 0.4);
    EXPECT_EQ(band.structureness, whole.structureness);
    for (std::size_t i = 0; i < whole.vesselness.size(); ++i) {
      if (band.measured.holds_pixel(i)) {
        ASSERT_EQ(band.vesselness[i], whole.vesselness[i]) << "image " << seed << ", pixel " << i;
      }
    }
  }
}

TEST_P(Meters, WhatIsCompletedLaterByAnotherMeterIsAsIfMeasuredAtOnce) {
  VesselnessMeter of_band(kWidth, kHeight, settings_);
  VesselnessMeter of_whole(kWidth, kHeight, settings_);
  VesselnessMeter completing(kWidth, kHeight, settings_, MeterUse::kComplete);
  for (unsigned seed = 1; seed < 4; ++seed) {
    ImageMeasurement band = image_of_wires(1, seed);
    ImageMeasurement whole = band;
    of_band.take(band, left_wire());
    of_whole.take(whole, whole_area());
    completing.complete(band, whole_area());
    EXPECT_EQ(band.measured, whole_area());
    EXPECT_EQ(band.vesselness, whole.vesselness) << "image " << seed;
  }
}

/// What a meter measures of the image's negative, after it was told to.
ImageMeasurement as_negative(const ImageMeasurement& image, VesselnessMeter& meter) {
  ImageMeasurement negative = image;
  for (float& grey : negative.grey) grey = image.brightest - grey;
  meter.take(negative, whole_area());
  return negative;
}

TEST_P(Meters, WhichRidgesCountIsTakenFromTheNextImageOnAndTravelsWithIt) {
  VesselnessMeter meter(kWidth, kHeight, settings_);
  VesselnessMeter completing(kWidth, kHeight, settings_, MeterUse::kComplete);
  ImageMeasurement dark = image_of_wires(1, 1);
  dark.brightest = 255;
  meter.take(dark, whole_area());
  EXPECT_TRUE(dark.finds_polarity);
  EXPECT_FALSE(meter.reads_otherwise());
  meter.read_as(RidgePolarity::kBright);
  EXPECT_TRUE(meter.reads_otherwise());
  ImageMeasurement bright = as_negative(dark, meter);
  EXPECT_EQ(bright.polarity, RidgePolarity::kBright);
  for (std::size_t i = 0; i < dark.vesselness.size(); ++i) {
    ASSERT_NEAR(bright.vesselness[i], dark.vesselness[i], 0.02F) << "pixel " << i;
  }
  const std::vector<float> at_once = bright.vesselness;
  bright.measured.clear();
  completing.complete(bright, whole_area());
  EXPECT_EQ(bright.vesselness, at_once) << "another meter, which was told nothing";
}

TEST_P(Meters, APolarityThatIsStatedStays) {
  settings_.polarity = PolaritySetting::kDark;
  VesselnessMeter meter(kWidth, kHeight, settings_);
  meter.read_as(RidgePolarity::kBright);
  ImageMeasurement image = image_of_wires(1, 1);
  meter.take(image, whole_area());
  EXPECT_EQ(image.polarity, RidgePolarity::kDark);
  EXPECT_FALSE(image.finds_polarity);
}

INSTANTIATE_TEST_SUITE_P(Smoothing, Meters,
                         testing::Values(FrangiSmoothing::kFloat, FrangiSmoothing::kInteger16));

TEST(VesselnessMeter, TheFirstImageIsAsTheWholeFrameFilterSeesIt) {
  FrangiSettings settings;
  VesselnessMeter of_bands(kWidth, kHeight, settings);
  settings.area = FrangiArea::kFrame;
  VesselnessMeter of_frames(kWidth, kHeight, settings);
  ImageMeasurement band = image_of_wires(1, 1);
  ImageMeasurement frame = band;
  of_bands.take(band, whole_area());
  of_frames.take(frame, left_wire());
  EXPECT_EQ(frame.measured, whole_area()) << "whatever was asked";
  EXPECT_EQ(band.structureness, frame.structureness);
  EXPECT_EQ(band.vesselness, frame.vesselness);
}

ImageArea nothing() { return {kWidth, kHeight}; }

/// The image with c as of whole frames.
ImageMeasurement as_of_whole_frames(ImageMeasurement image) {
  FrangiSettings settings;
  settings.area = FrangiArea::kFrame;
  VesselnessMeter(kWidth, kHeight, settings).take(image, whole_area());
  return image;
}

/// `image` has c of every scale of `wanted`, with an error of `part` of it at most.
void expect_structureness(const ImageMeasurement& image, const ImageMeasurement& wanted, float part) {
  for (std::size_t scale = 0; scale < FrangiSettings{}.scales_px.size(); ++scale) {
    EXPECT_NEAR(image.structureness[scale], wanted.structureness[scale], part * wanted.structureness[scale])
        << "scale " << scale;
  }
}

/// An image of the one contrast, then one of the other: c of the second is that of the whole image.
void expect_followed_at_once(double before, double after, float part) {
  VesselnessMeter meter(kWidth, kHeight, FrangiSettings{});
  ImageMeasurement first = image_of_wires(before, 1);
  ImageMeasurement second = image_of_wires(after, 1);
  meter.take(first, nothing());
  meter.take(second, nothing());
  expect_structureness(second, as_of_whole_frames(second), part);
}

// What was greatest is measured again until the greatest is of this image: nothing of the old is left.
TEST(VesselnessMeter, StructurenessFollowsALowerContrastAtOnce) { expect_followed_at_once(1, 0.5, 0.02F); }

TEST(VesselnessMeter, StructurenessFollowsAHigherContrastAtOnce) { expect_followed_at_once(0.5, 1, 0.05F); }

TEST(VesselnessMeter, StructurenessIsThatOfTheWholeImageWhileTheWiresMove) {
  VesselnessMeter meter(kWidth, kHeight, FrangiSettings{});
  for (unsigned number = 0; number < 24; ++number) {
    ImageMeasurement image = image_of_wires(1, number, 6.0 * number);
    meter.take(image, nothing());
    expect_structureness(image, as_of_whole_frames(image), 0.08F);
  }
}

TEST(VesselnessMeter, SomethingNewFarFromWhatWasGreatestCountsWithinSixteenImages) {
  VesselnessMeter meter(kWidth, kHeight, FrangiSettings{});
  ImageMeasurement faint = image_of_wires(0.3, 1, 90);
  meter.take(faint, nothing());
  ImageMeasurement strong = image_of_wires(1, 2, -20);
  const ImageMeasurement wanted = as_of_whole_frames(strong);
  for (int image = 0; image < FrangiFilter::kSlices; ++image) {
    meter.take(strong, nothing());
  }
  expect_structureness(strong, wanted, 1e-6F);
}

TEST(VesselnessMeter, StructurenessDoesNotDependOnWhatIsMeasured) {
  VesselnessMeter of_nothing(kWidth, kHeight, FrangiSettings{});
  VesselnessMeter of_whole(kWidth, kHeight, FrangiSettings{});
  for (unsigned number = 0; number < 20; ++number) {
    ImageMeasurement image = image_of_wires(1, number, 3.0 * number);
    ImageMeasurement same = image;
    of_nothing.take(image, nothing());
    of_whole.take(same, number % 3 == 0 ? whole_area() : left_wire());
    ASSERT_EQ(image.structureness, same.structureness) << "image " << number;
  }
}

TEST(ImageOnDemand, MeasuresWhatIsMissingAndRemembersWhatWasAsked) {
  const FrangiSettings settings;
  VesselnessMeter meter(kWidth, kHeight, settings);
  ImageOnDemand on_demand(kWidth, kHeight, settings);
  ImageMeasurement image = image_of_wires(1, 1);
  meter.take(image, left_wire());
  on_demand.begin();
  EXPECT_TRUE(on_demand.asked().empty());

  ImageArea inside(kWidth, kHeight);
  inside.add_box({60, 0}, {62, 2});
  on_demand.filter_missing(image, inside);
  EXPECT_EQ(on_demand.completed_images(), 0U) << "all there";

  ImageArea outside(kWidth, kHeight);
  outside.add_box({150, 100}, {190, 150});
  on_demand.filter_missing(image, outside);
  on_demand.filter_missing(image, outside);
  EXPECT_EQ(on_demand.completed_images(), 1U);
  EXPECT_TRUE(image.measured.covers(outside));
  EXPECT_TRUE(on_demand.asked().covers(inside));
  EXPECT_TRUE(on_demand.asked().covers(outside));
  EXPECT_FALSE(on_demand.asked().covers(left_wire()));
}

TEST(ImageOnDemand, AnImageWithoutPixelsIsLeftAlone) {
  ImageOnDemand on_demand(kWidth, kHeight, FrangiSettings{});
  ImageMeasurement image = image_of_wires(1, 1);
  image.measured.clear();
  image.state = ImageState::kOff;
  on_demand.begin();
  on_demand.filter_missing(image, left_wire());
  EXPECT_TRUE(image.measured.empty());
  EXPECT_EQ(on_demand.completed_images(), 0U);
}

}  // namespace
}  // namespace tubed
