#include "clients/cpp/centreline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

namespace tubed {
namespace {

constexpr double kSpacing_mm = 5;
constexpr int kCount = 13;  // 10 segments: s from 0 to 50 mm

/// Coefficient i sits at s = (i - 1) h; coefficients on a straight line or on a parabola give closed forms.
template <typename Curve>
std::unique_ptr<tubed_TubeEstimate> tube_with_coefficients(const Curve& curve) {
  auto tube = std::make_unique<tubed_TubeEstimate>();
  tube->length_mm = 50;
  tube->coefficient_count = kCount;
  tube->coefficient_spacing_mm = kSpacing_mm;
  for (int i = 0; i < kCount; ++i) {
    const Vector3 coefficient = curve((i - 1) * kSpacing_mm);
    std::copy(coefficient.begin(), coefficient.end(), tube->coefficients_mm[i]);
  }
  tube->point_count = 11;  // every 5 mm; variance grows from 1 to 11 mm^2
  for (int i = 0; i < 11; ++i) {
    for (const int diagonal : {0, 3, 5}) {
      tube->points[i].covariance_mm2[diagonal] = static_cast<float>(i + 1);
    }
  }
  return tube;
}

Vector3 line(double s) { return {1 + 0.6 * s, 2, 3 - 0.8 * s}; }

TEST(Centreline, CoefficientsOnALineGiveTheLine) {
  const auto tube = tube_with_coefficients(line);

  for (const double s : {0.0, 0.1, 4.9, 5.0, 17.3, 49.99, 50.0}) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(point_at(*tube, s)[k], line(s)[k], 1e-12) << s;
  }
}

TEST(Centreline, CoefficientsOnAParabolaGiveTheParabolaPlusAThirdOfHSquared) {
  // sum (i h)^2 B_i(s) = s^2 + h^2 / 3 for the uniform cubic B-spline.
  const auto tube = tube_with_coefficients([](double s) { return Vector3{s, s * s, 0}; });

  EXPECT_NEAR(point_at(*tube, 17)[1], 17 * 17 + kSpacing_mm * kSpacing_mm / 3, 1e-10);
  EXPECT_NEAR(point_at(*tube, 50)[1], 50 * 50 + kSpacing_mm * kSpacing_mm / 3, 1e-10);
}

TEST(Centreline, WhatHoldsAPlaceIsWhatHoldsTheNearestPoint) {
  const auto tube = tube_with_coefficients(line);  // points every 5 mm
  tube->points[3].held_by = tubed_HELD_BY_IMAGE;
  tube->points[4].held_by = tubed_HELD_BY_COIL | tubed_HELD_BY_IMAGE;

  EXPECT_EQ(held_by_at(*tube, 15), tubed_HELD_BY_IMAGE);
  EXPECT_EQ(held_by_at(*tube, 17.4), tubed_HELD_BY_IMAGE);
  EXPECT_EQ(held_by_at(*tube, 17.6), tubed_HELD_BY_COIL | tubed_HELD_BY_IMAGE);
  EXPECT_EQ(held_by_at(*tube, -3), 0U);
  EXPECT_EQ(held_by_at(*tube, 900), 0U);
  EXPECT_DOUBLE_EQ(unheld_ratio(*tube), 9.0 / 11);
}

TEST(Centreline, NothingHoldsWhatIsNoShape) {
  const tubed_TubeEstimate none{};
  EXPECT_EQ(held_by_at(none, 10), 0U);
  EXPECT_EQ(unheld_ratio(none), 1);
}

TEST(Centreline, TheTangentPointsTowardTheTip) {
  const auto tube = tube_with_coefficients(line);

  const Vector3 tangent = tangent_at(*tube, 17.3);

  EXPECT_NEAR(tangent[0], -0.6, 1e-12);
  EXPECT_NEAR(tangent[1], 0, 1e-12);
  EXPECT_NEAR(tangent[2], 0.8, 1e-12);
}

TEST(Centreline, BeyondTheEndsTheEndIsMeant) {
  const auto tube = tube_with_coefficients(line);

  EXPECT_EQ(point_at(*tube, -3), point_at(*tube, 0));
  EXPECT_EQ(point_at(*tube, 99), point_at(*tube, 50));
}

TEST(Centreline, SigmaIsInterpolatedInTheVariance) {
  const auto tube = tube_with_coefficients(line);

  EXPECT_NEAR(sigma_mm_at(*tube, 0), 1, 1e-12);
  EXPECT_NEAR(sigma_mm_at(*tube, 15), 2, 1e-12);                 // point 3: 4 mm^2
  EXPECT_NEAR(sigma_mm_at(*tube, 17.5), std::sqrt(4.5), 1e-12);  // half-way to 5 mm^2
  EXPECT_NEAR(sigma_mm_at(*tube, 50), std::sqrt(11), 1e-12);
}

TEST(Centreline, ASampleWithoutAShapeGivesNaNAndNeverTheOrigin) {
  const auto empty = std::make_unique<tubed_TubeEstimate>();
  const auto overflowing = tube_with_coefficients(line);
  overflowing->coefficient_count = 65;

  for (const auto* tube : {empty.get(), overflowing.get()}) {
    EXPECT_FALSE(has_shape(*tube));
    EXPECT_TRUE(std::isnan(point_at(*tube, 0)[0]));
    EXPECT_TRUE(std::isnan(tangent_at(*tube, 0)[0]));
    EXPECT_TRUE(std::isnan(sigma_mm_at(*tube, 0)));
  }
}

TEST(Centreline, AnInfiniteLengthOrSpacingIsNoShape) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto long_one = tube_with_coefficients(line);
  const auto wide_one = tube_with_coefficients(line);
  long_one->length_mm = kInfinity;
  wide_one->length_mm = wide_one->coefficient_spacing_mm = kInfinity;

  for (const auto* tube : {long_one.get(), wide_one.get()}) {
    EXPECT_FALSE(has_shape(*tube));
    EXPECT_TRUE(std::isnan(point_at(*tube, tube->length_mm)[0]));
    EXPECT_TRUE(std::isnan(tangent_at(*tube, tube->length_mm)[0]));
    EXPECT_TRUE(std::isnan(sigma_mm_at(*tube, tube->length_mm)));
  }
}

}  // namespace
}  // namespace tubed
