#include "daemon/image/box_blur.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace tubed {
namespace {

PixelGrid noise(Eigen::Index rows, Eigen::Index columns) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> grey(0, 255);
  PixelGrid values(rows, columns);
  for (Eigen::Index i = 0; i < values.size(); ++i) values.data()[i] = grey(random);
  return values;
}

/// The mean over a window of 2 r + 1 pixels along and across, three times; outside is 0.
PixelGrid blurred_by_definition(PixelGrid values, Eigen::Index radius) {
  const auto side = static_cast<float>(2 * radius + 1);
  for (int pass = 0; pass < 3; ++pass) {
    const PixelGrid before = values;
    for (Eigen::Index row = 0; row < values.rows(); ++row) {
      for (Eigen::Index column = 0; column < values.cols(); ++column) {
        const Eigen::Index top = std::max<Eigen::Index>(0, row - radius);
        const Eigen::Index left = std::max<Eigen::Index>(0, column - radius);
        values(row, column) = before
                                  .block(top, left, std::min(row + radius, values.rows() - 1) - top + 1,
                                         std::min(column + radius, values.cols() - 1) - left + 1)
                                  .sum() /
                              (side * side);
      }
    }
  }
  return values;
}

TEST(BoxBlur, KeepsTheSumAndHasTheVarianceOfItsWindows) {
  PixelGrid impulse = PixelGrid::Zero(101, 101);
  impulse(50, 50) = 1;
  BoxBlur(101, 101, 6).apply(impulse);
  double variance = 0;
  for (Eigen::Index row = 0; row < 101; ++row) {
    const auto off = static_cast<double>(row - 50);
    variance += off * off * static_cast<double>(impulse.row(row).sum());
  }
  EXPECT_NEAR(impulse.sum(), 1, 1e-4);
  EXPECT_NEAR(variance, 3 * (13 * 13 - 1) / 12.0, 1e-3);  // three windows of 13 px: 6.5 px for 6 asked for
}

// Sizes that are multiples of nothing: strips and tiles end somewhere.
TEST(BoxBlur, IsThreeWindowsWhateverTheSize) {
  for (const auto& [rows, columns] : {std::pair{64, 64}, {67, 83}, {90, 65}, {5, 70}}) {
    PixelGrid values = noise(rows, columns);
    const PixelGrid expected = blurred_by_definition(values, 6);
    BoxBlur(rows, columns, 6).apply(values);
    EXPECT_LT((values - expected).abs().maxCoeff(), 0.02F) << rows << " x " << columns;
  }
}

TEST(BoxBlur, KeepsNothingOfTheGridBefore) {
  BoxBlur blur(70, 90, 12);
  PixelGrid first = noise(70, 90);
  PixelGrid again = first;
  blur.apply(first);
  blur.apply(again);
  EXPECT_TRUE((first == again).all());
}

}  // namespace
}  // namespace tubed
