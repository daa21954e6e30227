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

/// 60 lines of which those from `first` on, before `last`, disagree; from `out_of_view` on none is in view.
SeenTube seen_without_stretch(std::size_t first, std::size_t last, std::size_t out_of_view = 60) {
  std::vector<CorrespondenceLine> lines(60);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    lines[i].in_view = i < out_of_view;
    lines[i].agrees = i < first || i >= last;
  }
  SeenTube seen;
  seen.record(lines, kSpacing_mm);
  return seen;
}

TEST(SeenTube, ItIsFollowedToTheLastLineBeforeAGap) {
  using Toward = SeenTube::Toward;
  EXPECT_EQ(seen_without_stretch(60, 60).followed(20, Toward::kTail).to_mm, 118) << "to the end";
  EXPECT_EQ(seen_without_stretch(60, 60).followed(20, Toward::kTip).to_mm, 0) << "to the tip";
  EXPECT_EQ(seen_without_stretch(30, 33).followed(20, Toward::kTail).to_mm, 118) << "three are no gap";
  EXPECT_EQ(seen_without_stretch(30, 34).followed(20, Toward::kTail).to_mm, 46) << "four of 24 to 33";
  EXPECT_EQ(seen_without_stretch(30, 34).followed(100, Toward::kTip).to_mm, 80) << "four of 39 to 30";
  EXPECT_EQ(seen_without_stretch(10, 20).followed(20, Toward::kTail).to_mm, 20) << "not at all";
  EXPECT_EQ(SeenTube{}.followed(20, Toward::kTail).to_mm, 20);
}

TEST(SeenTube, ItIsLostWhereMostOfWhatIsInViewBeyondTheGapDoesNotShowIt) {
  using Toward = SeenTube::Toward;
  const auto lost = [](const SeenTube& seen, double from_mm, Toward toward) {
    const SeenTube::Followed end = seen.followed(from_mm, toward);
    return end.lost_to_mm == end.to_mm ? -1 : end.lost_to_mm;
  };
  EXPECT_EQ(lost(seen_without_stretch(30, 60), 20, Toward::kTail), 118);
  EXPECT_EQ(lost(seen_without_stretch(30, 60, 50), 20, Toward::kTail), 98) << "as far as it is in view";
  EXPECT_EQ(lost(seen_without_stretch(30, 60, 36), 20, Toward::kTail), -1) << "24 mm of it are";
  EXPECT_EQ(lost(seen_without_stretch(30, 40), 20, Toward::kTail), -1) << "it is seen beyond the gap";
  EXPECT_EQ(lost(seen_without_stretch(0, 30), 80, Toward::kTip), 0);
  EXPECT_EQ(lost(SeenTube{}, 20, Toward::kTail), -1);
}

TEST(SeenTube, BeforeAnImageNothingIsSeen) {
  EXPECT_FALSE(SeenTube{}.at(0));
  EXPECT_FALSE(SeenTube{}.at(100));
}

}  // namespace
}  // namespace tubed
