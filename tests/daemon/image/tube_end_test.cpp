#include "daemon/image/tube_end.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
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

void add_noise(double sigma, std::uint32_t seed, ImageMeasurement& image) {
  std::mt19937 random(seed);
  std::normal_distribution<float> noise(0, static_cast<float>(sigma));
  for (float& grey : image.grey) grey += noise(random);
  FrangiFilter filter(kWidth, kHeight, FrangiSettings{});
  filter.filter(image.grey, image.vesselness);
}

std::optional<TubeEnd> sharp_end(const ImageMeasurement& image) {
  const auto path = path_from(80, 40);
  const auto end = find_tube_end(image, path, height_of(image));
  return end ? sharpened(*end, image, path, 1.9) : std::nullopt;
}

TEST(SharpTubeEnd, IsWhereTheGreyIsHalfOfTheTubes) {
  for (const double darker_tip : {1.0, 3.0}) {
    for (const double end_x : {60.0, 60.3, 60.5, 60.8}) {
      const auto end = sharp_end(bar_ending_at(end_x, darker_tip));
      ASSERT_TRUE(end) << end_x;
      EXPECT_NEAR(80 - end->place, end_x, 0.2) << darker_tip;
      EXPECT_LT(end->variance, 0.25) << darker_tip;
    }
  }
}

// Where arc lengths or the registration are wrong by so much: up to the last few samples of the path.
TEST(SharpTubeEnd, FarBeyondWhereItIsExpectedIsFoundAsWell) {
  for (const double end_x : {70.0, 73.0, 76.0}) {
    const auto end = sharp_end(bar_ending_at(end_x));
    ASSERT_TRUE(end) << end_x;
    EXPECT_NEAR(80 - end->place, end_x, 0.2);
  }
}

/// Darker by `depth` from x = from_x to 74 and as far across as the bar, or from there on down to the bottom.
void add_beyond(double from_x, float depth, bool is_edge, ImageMeasurement& image) {
  for (int y = 38; y < (is_edge ? kHeight : 43); ++y) {
    for (int x = static_cast<int>(from_x); x <= 74; ++x) {
      image.grey[static_cast<std::size_t>(y * kWidth + x)] -= depth;
    }
  }
}

// Nothing of that is where the bar ends, which is at x = 60.
TEST(SharpTubeEnd, IsNotThatOfWhatLiesFartherOut) {
  const auto end_seen_with = [](double from_x, float depth, bool is_edge) {
    ImageMeasurement image = bar_ending_at(60);
    add_beyond(from_x, depth, is_edge, image);
    return sharpened({5.5, 4}, image, path_from(80, 30), 1.9);
  };
  EXPECT_FALSE(end_seen_with(61, 5, false)) << "a fainter wire goes on";
  EXPECT_FALSE(end_seen_with(68, 14, false)) << "a marker of something else";
  EXPECT_FALSE(end_seen_with(61, 24, true)) << "the edge of a bone";
  const auto end = end_seen_with(61, 14, false);
  ASSERT_TRUE(end) << "so much longer is the tube";
  EXPECT_NEAR(80 - end->place, 74.5, 0.7);
}

TEST(SharpTubeEnd, OfABrightTubeIsFoundAsWell) {
  ImageMeasurement image = bar_ending_at(60.3);
  for (float& grey : image.grey) grey = 256 - grey;
  image.polarity = RidgePolarity::kBright;
  const auto end = sharpened({21, 4}, image, path_from(80, 40), 1.9);
  ASSERT_TRUE(end);
  EXPECT_NEAR(80 - end->place, 60.3, 0.2);
}

TEST(SharpTubeEnd, IsAsFarOffAsItsVarianceSays) {
  constexpr int kDraws = 300;
  int found = 0;
  double squares = 0, off_px = 0;
  for (std::uint32_t seed = 1; seed <= kDraws; ++seed) {
    ImageMeasurement image = bar_ending_at(60.3);
    add_noise(5, seed, image);
    const auto end = sharp_end(image);
    if (!end) continue;
    ++found;
    off_px += 80 - end->place - 60.3;
    squares += std::pow(80 - end->place - 60.3, 2) / end->variance;
  }
  ASSERT_GT(found, kDraws / 2);
  EXPECT_LT(std::abs(off_px / found), 0.3);
  EXPECT_LT(squares / found, 2);
  EXPECT_GT(squares / found, 0.2);
}

TEST(SharpTubeEnd, IsUnknownInNoiseAndAtTheEndsOfThePath) {
  ImageMeasurement image = bar_ending_at(-20);
  add_noise(5, 1, image);
  EXPECT_FALSE(sharpened({20, 4}, image, path_from(80, 40), 1.9));
  const ImageMeasurement bar = bar_ending_at(60);
  for (const double place : {3.0, 38.0}) {
    EXPECT_FALSE(sharpened({place, 4}, bar, path_from(80, 40), 1.9)) << place;
  }
}

// Beyond the border there is no grey, and no step either.
TEST(SharpTubeEnd, IsUnknownAlongTheImagesBorder) {
  const ImageMeasurement image = bar_ending_at(20);
  std::vector<Eigen::Vector2d> path_px;
  for (int k = 0; k <= 40; ++k) path_px.emplace_back(80 - 0.95 * k, 0.3 * k - 1);
  EXPECT_FALSE(sharpened({20, 4}, image, path_px, 1.9));
}

TEST(EndPath, GoesOnStraightBeyondTheTipAndFollowsTheTubeBehindIt) {
  // A quarter of a circle of 20 px, 2 mm and 3 px from one point to the next.
  std::vector<Eigen::Vector2d> found_px;
  for (int i = 0; i < 12; ++i) {
    found_px.emplace_back(50 + 20 * std::cos(0.15 * i), 50 + 20 * std::sin(0.15 * i));
  }
  const auto path = EndPath::over(found_px, 2, 15);
  ASSERT_TRUE(path);
  const auto points_px = path->points_px();
  for (std::size_t k = 1; k < points_px.size(); ++k) {
    EXPECT_NEAR((points_px[k] - points_px[k - 1]).norm(), 1, 0.03) << k;
  }
  EXPECT_EQ(points_px[15], found_px[0]);
  EXPECT_NEAR((points_px[0] - found_px[0] - 15 * path->outward()).norm(), 0, 1e-9);
  EXPECT_LT(path->outward().y(), -0.9);
  EXPECT_NEAR((points_px.back() - Eigen::Vector2d(50, 50)).norm(), 20, 0.2);
  EXPECT_EQ(path->at(15), found_px[0]);
  EXPECT_EQ(path->at(20.5), (points_px[20] + points_px[21]) / 2);
}

TEST(EndPath, ThereIsNoneOfATipThatPointsAtTheSource) {
  const std::vector<Eigen::Vector2d> found_px{{50, 50}, {50.3, 50}, {50.6, 50}, {50.9, 50}};
  EXPECT_FALSE(EndPath::over(found_px, 2, 15));
  EXPECT_TRUE(EndPath::over(found_px, 1, 15));
}

}  // namespace
}  // namespace tubed
