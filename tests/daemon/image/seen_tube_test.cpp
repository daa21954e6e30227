#include "daemon/image/seen_tube.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tubed {
namespace {

constexpr double kSpacing_mm = 2;

/// Ten lines that are all in view and agree, but for those named.
SeenTube seen_without(const std::vector<std::size_t>& disagreeing) {
  std::vector<CorrespondenceLine> lines(10);
  for (CorrespondenceLine& line : lines) line.in_view = line.agrees = true;
  for (const std::size_t i : disagreeing) lines[i].agrees = false;
  SeenTube seen;
  seen.record(lines, kSpacing_mm);
  return seen;
}

TEST(SeenTube, MostOfFiveLinesDecide) {
  EXPECT_TRUE(seen_without({4, 5}).at(10)) << "two of the lines 3 to 7 disagree";
  EXPECT_FALSE(seen_without({4, 5, 6}).at(10)) << "three of them";
  EXPECT_TRUE(seen_without({0, 1, 2, 8, 9}).at(10)) << "others do not count";
}

TEST(SeenTube, AtTheEndsThereAreThreeAndBeyondThemItIsThatEnd) {
  EXPECT_TRUE(seen_without({0}).at(0));
  EXPECT_FALSE(seen_without({0, 1}).at(0));
  EXPECT_FALSE(seen_without({0, 1}).at(-50));
  EXPECT_FALSE(seen_without({8, 9}).at(18));
  EXPECT_FALSE(seen_without({8, 9}).at(500));
  EXPECT_TRUE(seen_without({0, 1}).at(500));
}

TEST(SeenTube, APlaceBetweenTwoLinesIsThatOfTheNearer) {
  const SeenTube seen = seen_without({5, 6, 7});
  EXPECT_TRUE(seen.at(6.9)) << "line 3, of 1 to 5";
  EXPECT_TRUE(seen.at(8.9)) << "line 4, of 2 to 6";
  EXPECT_FALSE(seen.at(9.1)) << "line 5, of 3 to 7";
}

TEST(SeenTube, ALineOutOfViewSaysNothing) {
  std::vector<CorrespondenceLine> lines(10);
  for (CorrespondenceLine& line : lines) line.agrees = true;  // of an image before
  SeenTube seen;
  seen.record(lines, kSpacing_mm);
  EXPECT_FALSE(seen.at(10));
}

TEST(SeenTube, BeforeAnImageNothingIsSeen) {
  EXPECT_FALSE(SeenTube{}.at(0));
  EXPECT_FALSE(SeenTube{}.at(100));
}

}  // namespace
}  // namespace tubed
