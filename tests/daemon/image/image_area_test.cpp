#include "daemon/image/image_area.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace tubed {
namespace {

using Eigen::Vector2d;

// 7 x 4 cells; the last column is 4 px wide, the last row 10 px high.
constexpr int kWidth = 100;
constexpr int kHeight = 58;

std::vector<PixelRectangle> rectangles_of(const ImageArea& area) {
  std::vector<PixelRectangle> rectangles;
  area.to_rectangles(rectangles);
  return rectangles;
}

TEST(ImageArea, ABoxTakesTheCellsItTouches) {
  ImageArea area(kWidth, kHeight);
  area.add_box({15.9, 0}, {16.0, 3});
  EXPECT_EQ(rectangles_of(area), (std::vector<PixelRectangle>{{0, 0, 32, 16}}));
  EXPECT_TRUE(area.covers_box({0, 0}, {31.9, 15.9}));
  EXPECT_FALSE(area.covers_box({0, 0}, {32, 15}));
}

TEST(ImageArea, ABoxBeyondTheBorderIsCutAndOneOutsideIsNothing) {
  ImageArea area(kWidth, kHeight);
  area.add_box({-200, -50}, {-1, 70});
  area.add_box({101 + 16, 0}, {1e300, 5});
  EXPECT_TRUE(area.empty());
  area.add_box({98, 57}, {1e300, 1e300});
  EXPECT_EQ(rectangles_of(area), (std::vector<PixelRectangle>{{96, 48, 100, 58}}));
}

TEST(ImageArea, AnInfiniteOrMissingPlaceIsNothing) {
  ImageArea area(kWidth, kHeight);
  area.add_box({std::nan(""), 0}, {5, 5});
  area.add_box({0, 0}, {5, std::numeric_limits<double>::infinity()});
  EXPECT_TRUE(area.empty());
}

TEST(ImageArea, TheWholeIsOneRectangle) {
  ImageArea area(kWidth, kHeight);
  area.add_whole();
  EXPECT_EQ(rectangles_of(area), (std::vector<PixelRectangle>{{0, 0, kWidth, kHeight}}));
  EXPECT_EQ(area.share(), 1);
}

TEST(ImageArea, RectanglesHoldEveryPixelOfTheAreaOnceAndNoOther) {
  std::mt19937 random(5);
  for (int round = 0; round < 50; ++round) {
    ImageArea area(kWidth, kHeight);
    for (int box = 0; box < 6; ++box) {
      const Vector2d low(random() % kWidth, random() % kHeight);
      area.add_box(low, low + Vector2d(random() % 40, random() % 20));
    }
    std::vector<int> times(static_cast<std::size_t>(kWidth * kHeight), 0);
    for (const PixelRectangle& rectangle : rectangles_of(area)) {
      for (int y = rectangle.top; y < rectangle.bottom; ++y) {
        for (int x = rectangle.left; x < rectangle.right; ++x)
          ++times[static_cast<std::size_t>(y * kWidth + x)];
      }
    }
    for (std::size_t i = 0; i < times.size(); ++i) {
      ASSERT_EQ(times[i], area.holds_pixel(i) ? 1 : 0) << "pixel " << i;
    }
  }
}

TEST(ImageArea, WithoutWhatIsThereAlreadyTheRestIsLeft) {
  ImageArea asked(kWidth, kHeight);
  ImageArea there(kWidth, kHeight);
  asked.add_box({0, 0}, {40, 10});
  there.add_box({16, 0}, {20, 10});
  EXPECT_FALSE(there.covers(asked));
  ImageArea missing = asked;
  missing.remove(there);
  EXPECT_EQ(rectangles_of(missing), (std::vector<PixelRectangle>{{0, 0, 16, 16}, {32, 0, 48, 16}}));
  there.add(missing);
  EXPECT_TRUE(there.covers(asked));
}

TEST(ImageArea, ANeighbourhoodEndsAtTheBorder) {
  ImageArea area(kWidth, kHeight);
  area.add_neighbourhood(area.index_of_pixel(0, 0));
  EXPECT_EQ(rectangles_of(area), (std::vector<PixelRectangle>{{0, 0, 32, 32}}));
  EXPECT_TRUE(area.holds_cell(area.index_of_pixel(20, 20)));
  EXPECT_FALSE(area.holds_cell(area.index_of_pixel(32, 0)));
  area.clear();
  area.add_neighbourhood(area.index_of_pixel(kWidth - 1, kHeight - 1));
  const int left = (kWidth - 1) / 16 * 16 - 16;
  const int top = (kHeight - 1) / 16 * 16 - 16;
  EXPECT_EQ(rectangles_of(area), (std::vector<PixelRectangle>{{left, top, kWidth, kHeight}}));
}

}  // namespace
}  // namespace tubed
