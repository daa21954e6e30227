#include "drivers/laboratory/tracker/generator_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace tubed {
namespace {

TEST(GeneratorMotion, OneThatRestsIsWhereItWasToTheLastBit) {
  EXPECT_EQ(GeneratorMotion{}.T_rest_em(100).matrix(), Eigen::Matrix4d::Identity());
}

TEST(GeneratorMotion, APushGoesAsFarAsItSaysAndStays) {
  const GeneratorMotion motion{.shift_mm = 20, .turn_rad = 0.1, .at_s = 5, .push_s = 0.4};
  EXPECT_TRUE(motion.T_rest_em(5).matrix().isIdentity());
  EXPECT_NEAR(motion.T_rest_em(5.2).translation().norm(), 10, 1e-9);
  for (const double t_s : {5.4, 60.0}) {
    const RigidTransform T = motion.T_rest_em(t_s);
    EXPECT_NEAR(T.translation().norm(), 20, 1e-9);
    EXPECT_NEAR(Eigen::AngleAxisd(T.linear()).angle(), 0.1, 1e-9);
  }
}

TEST(GeneratorMotion, ADriftGoesOn) {
  const GeneratorMotion motion{.drift_mm_s = 0.5};
  EXPECT_NEAR(motion.T_rest_em(10).translation().norm(), 5, 1e-9);
  EXPECT_NEAR(motion.T_rest_em(20).translation().norm(), 10, 1e-9);
}

}  // namespace
}  // namespace tubed
