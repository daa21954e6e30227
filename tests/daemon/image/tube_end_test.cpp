#include "daemon/image/tube_end.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "daemon/image/frangi.hpp"

namespace tubed {
namespace {

constexpr int kWidth = 120;
constexpr int kHeight = 80;
constexpr double kRow = 40;

/// Vesselness of a dark bar of 3.8 px along kRow from x = 0 to `end_x`, `darker_tip` times as dark over its
/// last 6 px; the radiograph's point spread is in the coverage of 1 px either side.
ImageMeasurement bar_ending_at(double end_x, double darker_tip = 1) {
  ImageMeasurement image;
  image.reserve(kWidth, kHeight);
  image.state = ImageState::kMeasured;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double across = std::max(0.0, 1 - std::pow((y - kRow) / 1.9, 2));
      const double covered = std::clamp(end_x - x + 0.5, 0.0, 1.0);
      const double depth = x > end_x - 6 ? 16 * darker_tip : 16;
      image.grey[static_cast<std::size_t>(y * kWidth + x)] =
          static_cast<float>(128 - depth * covered * std::sqrt(across));
    }
  }
  FrangiFilter filter(kWidth, kHeight, FrangiSettings{});
  filter.filter(image.grey, image.vesselness);
  return image;
}

std::vector<Eigen::Vector2d> path_from(double outside_x, double inside_x) {
  std::vector<Eigen::Vector2d> path;
  for (double x = outside_x; x >= inside_x; x -= 1) {
    path.emplace_back(x, kRow);
  }
  return path;
}

float height_of(const ImageMeasurement& image) {
  return image.vesselness[static_cast<std::size_t>(kRow) * kWidth + 30];
}

TEST(TubeEnd, OfABarIsFoundWithinOnePixel) {
  for (const double end_x : {60.0, 60.3, 60.5, 60.8}) {
    const ImageMeasurement image = bar_ending_at(end_x);
    const auto end = find_tube_end(image, path_from(80, 40), height_of(image));
    ASSERT_TRUE(end) << end_x;
    EXPECT_NEAR(80 - end->place, end_x, 1.2) << end_x;
    EXPECT_LT(end->variance, 9) << end_x;
  }
}

TEST(TubeEnd, OfABarWithADarkTipIsFoundAsWell) {
  const ImageMeasurement image = bar_ending_at(60, 3);
  const auto end = find_tube_end(image, path_from(80, 40), height_of(image));
  ASSERT_TRUE(end);
  EXPECT_NEAR(80 - end->place, 60, 1.5);
}

TEST(TubeEnd, IsUnknownWhereTheRidgeGoesOn) {
  const ImageMeasurement image = bar_ending_at(110);
  EXPECT_FALSE(find_tube_end(image, path_from(80, 40), height_of(image)));
}

TEST(TubeEnd, IsUnknownWhereNobodyHasMeasured) {
  ImageMeasurement image = bar_ending_at(60);
  image.measured.clear();
  image.measured.add_box({40, 30}, {70, 50});  // cells up to column 79; the path begins between 80 and 81
  EXPECT_FALSE(find_tube_end(image, path_from(80, 40), height_of(image)));
  EXPECT_TRUE(find_tube_end(image, path_from(78, 40), height_of(image)));
}

TEST(TubeEnd, IsUnknownWhereNoRidgeBegins) {
  const ImageMeasurement image = bar_ending_at(20);
  EXPECT_FALSE(find_tube_end(image, path_from(80, 40), 0.9F));
}

TEST(TubeEnd, IsUnknownOutsideTheImageAndForAnImageWithoutRidges) {
  const ImageMeasurement image = bar_ending_at(60);
  EXPECT_FALSE(find_tube_end(image, path_from(-100, -140), height_of(image)));
  EXPECT_FALSE(find_tube_end(image, path_from(80, 40), 0));
  EXPECT_FALSE(find_tube_end(image, {}, height_of(image)));
}

}  // namespace
}  // namespace tubed
