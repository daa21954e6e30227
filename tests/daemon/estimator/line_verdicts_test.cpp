#include "daemon/estimator/images/line_verdicts.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

constexpr double kRadius_mm = 1;
constexpr double kSigma_px = 1;

/// Lines of a tube that is 4 px a mm large, each seen where it was predicted to 2 px^2, and expected to be
/// so.
struct SeenLines {
  SeenLines() {
    for (int i = 0; i < layout.count; ++i) {
      CorrespondenceLine& line = at(i);
      line.half_width_px = 4 * kRadius_mm;
      line.in_view = line.agrees = true;
      line.expected_variance_px2 = 2;
      line.variance_px2 = 1;
      line.offset_px = line.expected_px = 3;
    }
  }
  CorrespondenceLine& at(int line) { return lines[static_cast<std::size_t>(line)]; }
  void move(int first, int last, double aside_px) {
    for (int i = first; i < last; ++i) at(i).offset_px += aside_px;
  }
  [[nodiscard]] Surprise surprise() const { return surprise_of(lines, layout, kSigma_px, kRadius_mm); }
  [[nodiscard]] double beyond_mm2(int line) const {
    return surprise().beyond_mm2_at(line * layout.spacing_mm, layout);
  }

  LineLayout layout{200};
  CorrespondenceLines lines{};
};

TEST(Surprise, OfATubeThatLiesWhereItWasPredictedIsNone) {
  const SeenLines seen;
  EXPECT_EQ(seen.surprise().chi2, 0);
  for (int line = 0; line < seen.layout.count; ++line) EXPECT_EQ(seen.beyond_mm2(line), 0);
}

// 8 px aside, of which 2 + 1 + 1 px^2 were expected: 64 / 4, and (64 - 4) / 16 mm^2.
TEST(Surprise, IsTheMeanSquareBeyondWhatWasExpected) {
  SeenLines seen;
  seen.move(40, 70, 8);
  EXPECT_NEAR(seen.surprise().chi2, 16, 1e-9);
  EXPECT_NEAR(seen.beyond_mm2(55), 60.0 / 16, 1e-5);
  EXPECT_EQ(seen.beyond_mm2(30), 0);
  EXPECT_EQ(seen.beyond_mm2(80), 0);
}

TEST(Surprise, AsFarAsExpectedIsNone) {
  SeenLines seen;
  seen.move(40, 70, 2);
  EXPECT_NEAR(seen.surprise().chi2, 1, 1e-9);
  EXPECT_NEAR(seen.beyond_mm2(55), 0, 1e-6);
}

TEST(Surprise, TakesSevenLinesOfTenThatAgree) {
  SeenLines seen;
  seen.move(40, 50, 8);
  for (int i = 40; i < 44; ++i) seen.at(i).agrees = false;
  for (int i = 50; i < seen.layout.count; ++i) seen.at(i).agrees = false;
  EXPECT_LT(seen.surprise().chi2, 12) << "six lines, with one at least that is as expected";
  seen.at(43).agrees = true;
  EXPECT_NEAR(seen.surprise().chi2, 16, 1e-9);
}

// From line 40 on 8 px, from line 90 on 4 px; from 50 to 80 nothing is seen.
TEST(Surprise, BetweenTwoPlacesThatTheImageShowsItIsBetweenWhatTheySay) {
  SeenLines seen;
  seen.move(0, 50, 8);
  seen.move(80, seen.layout.count, 4);
  for (int i = 50; i < 80; ++i) seen.at(i).agrees = false;
  const double here_mm2 = 60.0 / 16;
  const double there_mm2 = 12.0 / 16;
  EXPECT_NEAR(seen.beyond_mm2(40), here_mm2, 1e-5);
  EXPECT_NEAR(seen.beyond_mm2(90), there_mm2, 1e-5);
  EXPECT_NEAR(seen.beyond_mm2(65), (here_mm2 + there_mm2) / 2, 0.1);
  EXPECT_GT(seen.beyond_mm2(58), seen.beyond_mm2(72));
}

TEST(Surprise, TheTubesEndsAreAsTheLinesNextToThem) {
  SeenLines seen;
  seen.move(0, seen.layout.count, 8);
  EXPECT_NEAR(seen.beyond_mm2(0), 60.0 / 16, 1e-5);
  EXPECT_NEAR(seen.beyond_mm2(seen.layout.count - 1), 60.0 / 16, 1e-5);
}

TEST(Surprise, OfTwoViewsTheGreaterOneCounts) {
  SeenLines one;
  one.move(20, 40, 8);
  SeenLines other;
  other.move(60, 80, 6);
  Surprise both = one.surprise();
  both.join(other.surprise());
  EXPECT_NEAR(both.chi2, 16, 1e-9);
  EXPECT_NEAR(both.beyond_mm2_at(30 * one.layout.spacing_mm, one.layout), 60.0 / 16, 1e-5);
  EXPECT_NEAR(both.beyond_mm2_at(70 * one.layout.spacing_mm, one.layout), 32.0 / 16, 1e-5);
}

}  // namespace
}  // namespace tubed
