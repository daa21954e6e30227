#include "daemon/estimator/coils/common_jump.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <random>

namespace tubed {
namespace {

using std::chrono::seconds;

constexpr double kHalf = std::numbers::sqrt2 / 2;  // of the jump: the root of half of its square
constexpr double kAlong = 1.03 * kHalf;            // with what is to all sides: sqrt(1 + 0.25^2)
constexpr double kCoilNoise_mm = 0.4;
constexpr double kBetween_s = 0.025;

/// Five coils on a quarter of a circle in the x-y plane, which lie `moved_mm` off it, and noise.
CoilObservations coils_of_arc(const Eigen::Vector3d& moved_mm, unsigned seed,
                              double noise_mm = kCoilNoise_mm) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, noise_mm);
  CoilObservations coils;
  coils.count = 5;
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    const double angle = i * std::numbers::pi / 8;
    coil.state = CoilState::kUsed;
    coil.s_mm = 10 + 90 * i;
    const Eigen::Vector3d on_arc_mm(230 * std::cos(angle), 230 * std::sin(angle), 0);
    coil.p_world_mm = on_arc_mm + moved_mm + Eigen::Vector3d(normal(random), normal(random), normal(random));
    coil.tangent_world = {std::sin(angle), -std::cos(angle), 0};
  }
  return coils;
}

CoilObservations straight(CoilObservations coils) {
  for (int i = 0; i < coils.count; ++i) {
    CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    coil.p_world_mm += Eigen::Vector3d(-coil.s_mm, 0, 0);
    coil.tangent_world = Eigen::Vector3d::UnitX();
  }
  return coils;
}

TEST(CommonJumpOfCoils, IsWhatAllOfThemMovedToTheSide) {
  for (const Eigen::Vector3d& way_mm : {Eigen::Vector3d(0, 0, 8), Eigen::Vector3d(4, -3, 2)}) {
    const auto jump_mm = common_jump_mm(coils_of_arc({0, 0, 0}, 1), coils_of_arc(way_mm, 2), kCoilNoise_mm);
    ASSERT_TRUE(jump_mm) << way_mm.transpose();
    EXPECT_LT((*jump_mm - way_mm).norm(), 4 * kCoilNoise_mm) << way_mm.transpose();
  }
}

TEST(CommonJumpOfCoils, IsNoneOfNoise) {
  for (unsigned seed = 1; seed < 500; ++seed) {
    const double noise_mm = seed % 2 == 0 ? kCoilNoise_mm : 2.5;
    ASSERT_FALSE(common_jump_mm(coils_of_arc({0, 0, 0}, seed, noise_mm),
                                coils_of_arc({0, 0, 0}, 1000 + seed, noise_mm), noise_mm));
  }
}

// 8 mm along itself: it is pushed.
TEST(CommonJumpOfCoils, IsNoneWhereATubeIsPushed) {
  const CoilObservations before = coils_of_arc({0, 0, 0}, 1);
  CoilObservations pushed = coils_of_arc({0, 0, 0}, 2);
  for (int i = 0; i < pushed.count; ++i) {
    CoilObservation& coil = pushed.coils[static_cast<std::size_t>(i)];
    coil.p_world_mm += 8 * coil.tangent_world;
  }
  EXPECT_FALSE(common_jump_mm(before, pushed, kCoilNoise_mm));
  EXPECT_FALSE(common_jump_mm(straight(before), straight(coils_of_arc({8, 0, 0}, 2)), kCoilNoise_mm));
  EXPECT_TRUE(common_jump_mm(straight(before), straight(coils_of_arc({0, 8, 0}, 2)), kCoilNoise_mm));
}

TEST(CommonJumpOfCoils, IsNoneWhereOnlySomeOfThemMove) {
  for (const int moved : {1, 2, 3, 4}) {
    CoilObservations whipped = coils_of_arc({0, 0, 0}, 2);
    for (int i = 0; i < moved; ++i) whipped.coils[static_cast<std::size_t>(i)].p_world_mm.z() += 12;
    EXPECT_FALSE(common_jump_mm(coils_of_arc({0, 0, 0}, 1), whipped, kCoilNoise_mm)) << moved;
  }
}

// The shaft is straight, and along it none of its coils sees anything: only the tip's coil, which is wrong.
TEST(CommonJumpOfCoils, IsNoneWhereOneCoilIsWrongInTheDirectionThatTheOthersDoNotSee) {
  CoilObservations before = straight(coils_of_arc({0, 0, 0}, 1));
  CoilObservations wrong = straight(coils_of_arc({0, 0, 0}, 2));
  before.coils[0].tangent_world = wrong.coils[0].tangent_world = Eigen::Vector3d::UnitY();
  wrong.coils[0].p_world_mm += Eigen::Vector3d(30, 0, 0);
  EXPECT_FALSE(common_jump_mm(before, wrong, kCoilNoise_mm));
}

TEST(CommonJumpOfCoils, IsSaidByThreeCoilsAtLeast) {
  const CoilObservations before = coils_of_arc({0, 0, 0}, 1);
  CoilObservations now = coils_of_arc({0, 0, 8}, 2);
  now.coils[0].state = CoilState::kStuck;
  now.coils[3].state = CoilState::kMissing;
  EXPECT_TRUE(common_jump_mm(before, now, kCoilNoise_mm));
  now.coils[4].state = CoilState::kMissing;
  EXPECT_FALSE(common_jump_mm(before, now, kCoilNoise_mm));
  EXPECT_FALSE(common_jump_mm(now, before, kCoilNoise_mm));
}

class CommonJumpTest : public ::testing::Test {
 protected:
  bool jump(const Eigen::Vector3d& way_mm, double interval_s = kBetween_s) {
    return common.observe(coils_of_arc({0, 0, 0}, 1, 0), coils_of_arc(way_mm, 2, 0), interval_s,
                          kCoilNoise_mm, now);
  }
  [[nodiscard]] Eigen::Vector3d sigma_mm() const { return common.square_mm2(now).diagonal().cwiseSqrt(); }

  CommonJump common;
  MonotonicTime now = from_ns(1'000'000'000);
};

TEST_F(CommonJumpTest, HalfOfItIsOpen) {
  EXPECT_TRUE(sigma_mm().isZero());
  EXPECT_TRUE(jump({0, 6, -8}));
  const double aside_mm = kHalf * 10 / 4;
  EXPECT_NEAR(sigma_mm().z(), std::hypot(kHalf * 8, aside_mm), 0.3);
  EXPECT_NEAR(sigma_mm().y(), std::hypot(kHalf * 6, aside_mm), 0.3);
  EXPECT_NEAR(sigma_mm().x(), aside_mm, 0.3);
}

TEST_F(CommonJumpTest, OneBackTakesItAway) {
  jump({0, 0, 8});
  EXPECT_TRUE(jump({0, 0, -9}));
  EXPECT_TRUE(sigma_mm().isZero());
}

TEST_F(CommonJumpTest, TwoAddUp) {
  jump({0, 0, 8});
  jump({0, 0, 8});
  EXPECT_NEAR(sigma_mm().z(), kAlong * 16, 0.3);
}

TEST_F(CommonJumpTest, IsForgottenWithinMinutes) {
  jump({0, 0, 8});
  now += seconds(60);
  EXPECT_NEAR(sigma_mm().z(), kAlong * 8 / std::numbers::e, 0.1);
  EXPECT_NEAR(common.left_mm(now), 8 / std::numbers::e, 0.1);
  now += seconds(240);
  EXPECT_LT(sigma_mm().z(), 0.1);
}

TEST_F(CommonJumpTest, NothingIsSaidAfterAPauseInWhichATubeGoesAnywhere) {
  EXPECT_FALSE(jump({0, 0, 8}, 0.5));
  EXPECT_TRUE(sigma_mm().isZero());
}

}  // namespace
}  // namespace tubed
