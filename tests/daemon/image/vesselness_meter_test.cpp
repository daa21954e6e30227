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

/// Two dark wires on noise, as whole grey values; `contrast` 1 is 60 grey levels.
ImageMeasurement image_of_wires(double contrast, unsigned seed) {
  ImageMeasurement image;
  image.reserve(kWidth, kHeight);
  image.state = ImageState::kMeasured;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double first = (x - 60 - 0.3 * y) / 1.6;
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
    of_band.take(band, left_wire(), left_wire());
    of_whole.take(whole, whole_area(), left_wire());
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
    of_band.take(band, left_wire(), left_wire());
    of_whole.take(whole, whole_area(), left_wire());
    completing.complete(band, whole_area());
    EXPECT_EQ(band.measured, whole_area());
    EXPECT_EQ(band.vesselness, whole.vesselness) << "image " << seed;
  }
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
  of_bands.take(band, whole_area(), left_wire());
  of_frames.take(frame, left_wire(), left_wire());
  EXPECT_EQ(frame.measured, whole_area()) << "whatever was asked";
  EXPECT_EQ(band.structureness, frame.structureness);
  EXPECT_EQ(band.vesselness, frame.vesselness);
}

ImageArea nothing() { return {kWidth, kHeight}; }

// Half the contrast halves every Hessian norm. The wires cross all slices: after sixteen images none of what
// was measured at the old contrast is left.
TEST(VesselnessMeter, StructurenessFollowsTheContrastWithinSixteenImages) {
  VesselnessMeter meter(kWidth, kHeight, FrangiSettings{});
  ImageMeasurement strong = image_of_wires(1, 1);
  meter.take(strong, nothing(), nothing());
  ImageMeasurement faint = image_of_wires(0.5, 1);
  for (int image = 0; image < FrangiFilter::kSlices - 1; ++image) {
    meter.take(faint, nothing(), nothing());
  }
  EXPECT_GT(faint.structureness[2], 0.6F * strong.structureness[2]) << "one slice is still of the old";
  meter.take(faint, nothing(), nothing());
  EXPECT_NEAR(faint.structureness[2], 0.5F * strong.structureness[2], 0.05F * strong.structureness[2]);
}

TEST(VesselnessMeter, StructurenessOfWhatIsReadFollowsAtOnce) {
  VesselnessMeter meter(kWidth, kHeight, FrangiSettings{});
  ImageMeasurement strong = image_of_wires(1, 1);
  meter.take(strong, whole_area(), whole_area());
  ImageMeasurement faint = image_of_wires(0.5, 1);
  meter.take(faint, whole_area(), whole_area());
  EXPECT_NEAR(faint.structureness[2], 0.5F * strong.structureness[2], 0.05F * strong.structureness[2]);
}

TEST(ImageOnDemand, MeasuresWhatIsMissingAndRemembersWhatWasAsked) {
  const FrangiSettings settings;
  VesselnessMeter meter(kWidth, kHeight, settings);
  ImageOnDemand on_demand(kWidth, kHeight, settings);
  ImageMeasurement image = image_of_wires(1, 1);
  meter.take(image, left_wire(), left_wire());
  on_demand.take(image);
  EXPECT_TRUE(on_demand.asked().empty());

  ImageArea inside(kWidth, kHeight);
  inside.add_box({60, 0}, {62, 2});
  on_demand.require(inside);
  EXPECT_EQ(on_demand.completed_images(), 0U) << "all there";

  ImageArea outside(kWidth, kHeight);
  outside.add_box({150, 100}, {190, 150});
  on_demand.require(outside);
  on_demand.require(outside);
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
  on_demand.take(image);
  on_demand.require(left_wire());
  EXPECT_TRUE(image.measured.empty());
  EXPECT_EQ(on_demand.completed_images(), 0U);
}

}  // namespace
}  // namespace tubed
