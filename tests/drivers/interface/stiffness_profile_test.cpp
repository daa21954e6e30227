#include "drivers/interface/stiffness_profile.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

TEST(StiffnessProfile, WithoutPiecesACatheterIsAsStiffEverywhere) {
  EXPECT_EQ(StiffnessProfile{}.at(0), 1);
  EXPECT_EQ(StiffnessProfile{}.at(200), 1);
  EXPECT_EQ(StiffnessProfile{}.length_mm(), 0);
}

TEST(StiffnessProfile, PiecesFollowEachOtherAndTheShaftFollowsThem) {
  const StiffnessProfile profile = StiffnessProfile::from_pairs({20, 0.2, 60, 0.6});
  EXPECT_EQ(profile.length_mm(), 80);
  EXPECT_EQ(profile.at(-1), 0.2) << "beyond the tip";
  EXPECT_EQ(profile.at(19.9), 0.2);
  EXPECT_EQ(profile.at(20), 0.6);
  EXPECT_EQ(profile.at(79.9), 0.6);
  EXPECT_EQ(profile.at(80), 1);
}

TEST(StiffnessProfile, AnOddLastNumberIsLeftOut) {
  EXPECT_EQ(StiffnessProfile::from_pairs({20, 0.2, 60}), StiffnessProfile::from_pairs({20, 0.2}));
}

}  // namespace
}  // namespace tubed
