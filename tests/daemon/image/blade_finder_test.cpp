#include "daemon/image/blade_finder.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tubed {
namespace {

constexpr Eigen::Index kRows = 90;
constexpr Eigen::Index kColumns = 120;

/// A picture that is flat nowhere.
class BladeFinderTest : public ::testing::Test {
 protected:
  BladeFinderTest() : grey_(kRows, kColumns), open_(OpenGrid::Zero(kRows, kColumns)) {
    std::mt19937 random(3);
    std::normal_distribution<float> noise(120, 1);
    for (Eigen::Index row = 0; row < kRows; ++row) {
      for (Eigen::Index column = 0; column < kColumns; ++column) {
        grey_(row, column) = noise(random) + static_cast<float>(10 * ((row + column) % 2));
      }
    }
  }
  /// Share that is shut.
  float shut() {
    finder_.find(grey_, open_);
    return 1 - open_.cast<float>().mean();
  }

  PixelGrid grey_;
  OpenGrid open_;
  BladeFinder finder_{kRows, kColumns};
};

TEST_F(BladeFinderTest, APictureWithoutBladesIsOpen) { EXPECT_EQ(shut(), 0); }

// What is flat ends a pixel before the blade's edge, for its neighbours count; the margin is two pixels.
TEST_F(BladeFinderTest, ABladeAtAnySideIsShutWithAPixelBesideItAndNoMore) {
  const PixelGrid without = grey_;
  grey_.topRows(20) = 3;
  EXPECT_NEAR(shut(), 21.0F / kRows, 1e-5);
  grey_ = without;
  grey_.bottomRows(20) = 3;
  EXPECT_NEAR(shut(), 21.0F / kRows, 1e-5);
  grey_ = without;
  grey_.leftCols(20) = 3;
  EXPECT_NEAR(shut(), 21.0F / kColumns, 1e-5);
  grey_ = without;
  grey_.rightCols(20) = 3;
  EXPECT_NEAR(shut(), 21.0F / kColumns, 1e-5);
}

TEST_F(BladeFinderTest, SaturatedBoneInsideIsNoBlade) {
  grey_.block(30, 40, 30, 30) = 0;
  EXPECT_EQ(shut(), 0);
}

TEST_F(BladeFinderTest, AnOpeningBehindTheBladesIsFoundWhereItIs) {
  const PixelGrid without = grey_;
  grey_ = 3;
  grey_.block(30, 40, 20, 50) = without.block(30, 40, 20, 50);
  shut();
  EXPECT_EQ(open_.cast<int>().sum(), 18 * 48);
  EXPECT_EQ(open_.block(31, 41, 18, 48).cast<int>().sum(), 18 * 48);
}

}  // namespace
}  // namespace tubed
