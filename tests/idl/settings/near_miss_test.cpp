#include "idl/settings/near_miss.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

TEST(EditDistance, CountsEachKindOfSlipOnce) {
  EXPECT_EQ(edit_distance("width", "width"), 0);
  EXPECT_EQ(edit_distance("width", "widht"), 1) << "a swap of neighbours";
  EXPECT_EQ(edit_distance("width", "wdth"), 1) << "a character left out";
  EXPECT_EQ(edit_distance("width", "widtth"), 1) << "a character too many";
  EXPECT_EQ(edit_distance("width", "wodth"), 1) << "a wrong character";
  EXPECT_EQ(edit_distance("", "width"), 5);
  EXPECT_EQ(edit_distance("width", ""), 5);
}

TEST(EditDistance, TouchesEachCharacterOfASwapOnce) {
  // The textbook pair: 3 when swapped characters may not be edited again, 2 when they may.
  EXPECT_EQ(edit_distance("ca", "abc"), 3);
}

TEST(NearMiss, FindsTheNearestNotTheFirst) {
  EXPECT_EQ(near_miss("widht", {"wide", "width"}), "width");
  EXPECT_EQ(near_miss("widht", {"width", "wide"}), "width");
}

TEST(NearMiss, ForgivesAMissingUnitAndTheWrongCase) {
  EXPECT_EQ(near_miss("offset_from_tip", {"sensor", "offset_from_tip_mm"}), "offset_from_tip_mm");
  EXPECT_EQ(near_miss("JOINT", {"em", "joint"}), "joint");
}

TEST(NearMiss, SuggestsNothingForAWordThatIsNotNear) {
  EXPECT_EQ(near_miss("aurora", {"replay", "simulation"}), std::nullopt);
  EXPECT_EQ(near_miss("", {"em"}), std::nullopt);
  EXPECT_EQ(near_miss("qx", {"em"}), std::nullopt) << "two edits in two characters are another word";
}

TEST(NearMiss, DoesNotLabourOverAVeryLongWord) {
  EXPECT_EQ(near_miss(std::string(100000, 'a'), {std::string(64, 'a')}), std::nullopt);
}

}  // namespace
}  // namespace tubed
