#include "drivers/interface/bounded_text.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

TEST(BoundedText, IsCutBetweenTwoCharacters) {
  EXPECT_EQ(BoundedText<3>("aböc").text(), "ab");
  EXPECT_EQ(BoundedText<4>("aböc").text(), "abö");
}

TEST(BoundedText, NothingFollowsWhatWasLeftOff) {
  BoundedText<3> text("abö");
  text << "c";
  EXPECT_EQ(text.text(), "ab");
  text.clear();
  EXPECT_EQ((text << "c").text(), "c");
}

TEST(BoundedText, TextOfADeviceHasNoLineBreaksEscapesOrBrokenCharacters) {
  BoundedText<40> text;
  text.printable("610016\n\x1b[2J\xF6");
  EXPECT_EQ(text.text(), "610016\uFFFD\uFFFD[2J\uFFFD");
}

}  // namespace
}  // namespace tubed
