#include "daemon/estimator/coils/end_jumps.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

namespace tubed {
namespace {

using std::chrono::seconds;

constexpr double kHalf = std::numbers::sqrt2 / 2;  // of the jump: the root of half of its square

/// Five coils, the first at 10 mm, then every 90 mm.
CoilObservations five_coils() {
  CoilObservations coils;
  coils.count = 5;
  for (int i = 0; i < 5; ++i) coils.coils[static_cast<std::size_t>(i)].s_mm = 10 + 90 * i;
  return coils;
}

class EndJumpsTest : public ::testing::Test {
 protected:
  void believe(int coil, const Eigen::Vector3d& off_mm) { jumps.believe(five_coils(), coil, off_mm, now); }
  [[nodiscard]] Eigen::Vector3d sigma_mm(double s_mm) const {
    return jumps.square_mm2(s_mm, now).diagonal().cwiseSqrt();
  }

  EndJumps jumps;
  MonotonicTime now = from_ns(1'000'000'000);
};

TEST_F(EndJumpsTest, NothingIsOpenBeforeAnyJump) { EXPECT_TRUE(sigma_mm(370).isZero()); }

TEST_F(EndJumpsTest, HalfOfAJumpIsOpenAtItsCoilAndNothingFromTheNextOneOn) {
  believe(4, {0, 12, -9});
  EXPECT_TRUE(sigma_mm(370).isApprox(kHalf * Eigen::Vector3d(0, 12, 9), 1e-9));
  EXPECT_TRUE(sigma_mm(325).isApprox(kHalf / 2 * Eigen::Vector3d(0, 12, 9), 1e-9));
  EXPECT_TRUE(sigma_mm(280).isZero());
  EXPECT_TRUE(sigma_mm(10).isZero());
  EXPECT_GT(sigma_mm(380).y(), sigma_mm(370).y()) << "the tube's end lies beyond its last coil";
}

TEST_F(EndJumpsTest, TheTipIsAnEndAsWell) {
  believe(0, {8, 0, 0});
  EXPECT_NEAR(sigma_mm(10).x(), kHalf * 8, 1e-9);
  EXPECT_NEAR(sigma_mm(0).x(), kHalf * 8 * 100 / 90, 1e-9);
  EXPECT_TRUE(sigma_mm(100).isZero());
}

TEST_F(EndJumpsTest, AJumpBackLeavesNothingOpen) {
  believe(4, {0, 12, 0});
  believe(4, {0, -13, 2});
  EXPECT_TRUE(sigma_mm(370).isZero());
}

TEST_F(EndJumpsTest, TwoJumpsAddUp) {
  believe(4, {0, 7, 0});
  believe(4, {0, 7, 0});
  EXPECT_NEAR(sigma_mm(370).y(), kHalf * 14, 1e-9);
}

TEST_F(EndJumpsTest, IsForgottenWithinMinutes) {
  believe(4, {0, 12, 0});
  now += seconds(60);
  EXPECT_NEAR(sigma_mm(370).y(), kHalf * 12 / std::numbers::e, 1e-9);
  now += seconds(240);
  EXPECT_LT(sigma_mm(370).y(), 0.1);
}

TEST_F(EndJumpsTest, ACoilBetweenOthersIsNoEnd) {
  believe(2, {0, 12, 0});
  for (const double s_mm : {0.0, 190.0, 380.0}) EXPECT_TRUE(sigma_mm(s_mm).isZero()) << s_mm;
}

TEST_F(EndJumpsTest, OneCoilAloneHasNoOther) {
  CoilObservations one = five_coils();
  one.count = 1;
  jumps.believe(one, 0, {0, 12, 0}, now);
  EXPECT_TRUE(sigma_mm(10).isZero());
}

}  // namespace
}  // namespace tubed
