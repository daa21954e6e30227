#include "daemon/image/frangi.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tubed {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 80;

/// Grey 200 with a dark (or bright) Gaussian ridge of standard deviation `sigma` along the direction `angle`.
std::vector<float> ridge(double sigma, double angle, double depth) {
  std::vector<float> grey(kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double distance = -std::sin(angle) * (x - kWidth / 2) + std::cos(angle) * (y - kHeight / 2);
      grey[static_cast<std::size_t>(y * kWidth + x)] =
          static_cast<float>(200 - depth * std::exp(-0.5 * distance * distance / (sigma * sigma)));
    }
  }
  return grey;
}

float centre(const std::vector<float>& picture) {
  return picture[static_cast<std::size_t>(kHeight / 2 * kWidth + kWidth / 2)];
}

std::vector<float> filtered(const std::vector<float>& grey, const FrangiSettings& settings) {
  FrangiFilter filter(kWidth, kHeight, settings);
  std::vector<float> vesselness(grey.size());
  filter.filter(grey, vesselness);
  return vesselness;
}

// For a straight Gaussian ridge of variance v and depth d, smoothed by sigma: the second derivative across at
// its centre is d sqrt(v) / (v + sigma^2)^(3/2), times sigma^2; the other eigenvalue is 0. Frangi's formula
// follows.
TEST(Frangi, CentreOfARidgeHasTheValueOfTheClosedForm) {
  for (const double sigma : {1.0, 1.5, 2.0, 3.0}) {
    const double depth = 40;
    const double width = 1.6;
    const double second = depth * width / std::pow(width * width + sigma * sigma, 1.5) * sigma * sigma;
    FrangiSettings settings;
    settings.scales_px = {sigma};
    settings.structureness = 10;
    const double expected = 1 - std::exp(-second * second / (2 * 10 * 10));
    EXPECT_NEAR(centre(filtered(ridge(width, 0, depth), settings)), expected, 0.04) << "sigma " << sigma;
  }
}

TEST(Frangi, TheDirectionOfARidgeDoesNotMatter) {
  FrangiSettings settings;
  settings.structureness = 10;
  const float horizontal = centre(filtered(ridge(1.6, 0, 40), settings));
  for (const double angle : {0.3, 0.785, 1.2, 1.5708}) {
    EXPECT_NEAR(centre(filtered(ridge(1.6, angle, 40), settings)), horizontal, 0.03) << angle;
  }
}

TEST(Frangi, BrightRidgesAreNotTubes) {
  EXPECT_EQ(centre(filtered(ridge(1.6, 0.4, -40), FrangiSettings{})), 0.0F);
}

TEST(Frangi, AnEvenImageHasNoVesselness) {
  const std::vector<float> even(kWidth * kHeight, 117.0F);
  for (const float v : filtered(even, FrangiSettings{})) {
    ASSERT_LT(v, 1e-6F);
  }
}

TEST(Frangi, ADarkBlobCountsLessThanARidge) {
  FrangiSettings settings;
  settings.structureness = 10;
  std::vector<float> blob(kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double r2 = (x - kWidth / 2) * (x - kWidth / 2) + (y - kHeight / 2) * (y - kHeight / 2);
      blob[static_cast<std::size_t>(y * kWidth + x)] =
          static_cast<float>(200 - 40 * std::exp(-0.5 * r2 / 2.56));
    }
  }
  EXPECT_LT(centre(filtered(blob, settings)), 0.3F * centre(filtered(ridge(1.6, 0, 40), settings)));
}

TEST(Frangi, StaysBetweenZeroAndOneOnNoise) {
  std::mt19937 random(7);
  std::vector<float> noise(kWidth * kHeight);
  for (float& pixel : noise) {
    pixel = static_cast<float>(random() % 65536);
  }
  for (const float v : filtered(noise, FrangiSettings{})) {
    ASSERT_GE(v, 0.0F);
    ASSERT_LE(v, 1.0F);
  }
}

}  // namespace
}  // namespace tubed
