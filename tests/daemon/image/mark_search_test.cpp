#include "daemon/image/mark_search.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tubed {
namespace {

constexpr double kLength_mm = 1.3;
const std::vector<double> kMarks_mm{6.5, 10.5, 14.5};

/// A tube that begins at 0 with darkness 10, and bands of 8 more, blurred by 0.4 mm.
struct Tube {
  std::vector<double> marks_mm = kMarks_mm;
  double shift_mm = 0;
  double noise = 0;
  double band = 8;
  unsigned seed = 1;

  [[nodiscard]] std::vector<float> darkness(const MarkSearch& search) const {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
    const auto covered = [](double s_mm, double from_mm, double until_mm) {
      constexpr double kBlur_mm = 0.4 * 1.4142135623730951;
      return 0.5 * (std::erf((s_mm - from_mm) / kBlur_mm) - std::erf((s_mm - until_mm) / kBlur_mm));
    };
    std::vector<float> profile;
    for (std::size_t k = 0; k < search.samples(); ++k) {
      const double s_mm = search.from_mm() + MarkSearch::kStep_mm * static_cast<double>(k);
      double dark = 10 * covered(s_mm, shift_mm, 1e3);
      for (const double mark_mm : marks_mm) {
        const double middle_mm = mark_mm + shift_mm;
        dark += band * covered(s_mm, middle_mm - kLength_mm / 2, middle_mm + kLength_mm / 2);
      }
      profile.push_back(static_cast<float>(dark + (noise > 0 ? normal(random) : 0)));
    }
    return profile;
  }
};

TEST(MarkSearch, ThePatternIsFoundWhereItIs) {
  MarkSearch search(kMarks_mm, kLength_mm);
  for (const double shift_mm : {-3.1, -1.0, 0.0, 0.37, 2.6, 5.2}) {
    const auto found = search.find(Tube{.shift_mm = shift_mm}.darkness(search));
    ASSERT_TRUE(found) << shift_mm;
    EXPECT_NEAR(found->shift_mm, shift_mm, 0.12);
    EXPECT_EQ(found->seen, 3);
    EXPECT_LT(found->sigma_mm, 0.3);
  }
}

TEST(MarkSearch, ItsSigmaHoldsUnderNoise) {
  MarkSearch search(kMarks_mm, kLength_mm);
  int found_count = 0;
  int within = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const double shift_mm = 0.02 * seed - 2;
    const auto found = search.find(Tube{.shift_mm = shift_mm, .noise = 1.2, .seed = seed}.darkness(search));
    if (found) {
      ++found_count;
      within += std::abs(found->shift_mm - shift_mm) < 3 * found->sigma_mm ? 1 : 0;
    }
  }
  EXPECT_GT(found_count, 120);
  EXPECT_GE(within, found_count * 99 / 100);
}

TEST(MarkSearch, WithoutBandsNothingIsFound) {
  MarkSearch search(kMarks_mm, kLength_mm);
  int found = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    found += search.find(Tube{.noise = 1.2, .band = 0, .seed = seed}.darkness(search)) ? 1 : 0;
  }
  EXPECT_LE(found, 2);
  EXPECT_FALSE(search.find(std::vector<float>(search.samples(), 5)));
}

// Each response is about twice its noise: one that is believed is seldom, and none is wrong.
TEST(MarkSearch, BandsHardlyOutOfTheNoiseAreSeldomBelieved) {
  MarkSearch search(kMarks_mm, kLength_mm);
  int count = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto found = search.find(Tube{.noise = 1.2, .band = 2, .seed = seed}.darkness(search));
    count += found ? 1 : 0;
    EXPECT_LT(found ? std::abs(found->shift_mm) : 0, 1);
  }
  EXPECT_LE(count, 20);
}

// Equal distances: shifted by one of them two of three are seen where three were looked for.
TEST(MarkSearch, OneOfEquallySpacedMarksThatIsNotSeenLeavesItOpenWhichTheyAre) {
  MarkSearch search(kMarks_mm, kLength_mm);
  const auto found = search.find(Tube{.marks_mm = {6.5, 10.5}, .shift_mm = 2, .noise = 0.5}.darkness(search));
  EXPECT_FALSE(found) << "two bands are two of three, 2 mm further or 2 mm nearer";
  MarkSearch uneven({2.0, 7.0, 9.0}, kLength_mm);
  const auto of_uneven =
      uneven.find(Tube{.marks_mm = {2.0, 7.0, 9.0}, .shift_mm = 1.4, .noise = 0.5}.darkness(uneven));
  ASSERT_TRUE(of_uneven);
  EXPECT_NEAR(of_uneven->shift_mm, 1.4, 0.2);
}

TEST(MarkSearch, OneBandOfTwoIsNoPattern) {
  MarkSearch search({2.0, 9.0}, kLength_mm);
  EXPECT_FALSE(search.find(Tube{.marks_mm = {9.0}, .noise = 0.3}.darkness(search)));
  EXPECT_TRUE(search.find(Tube{.marks_mm = {2.0, 9.0}, .noise = 0.3}.darkness(search)));
}

TEST(MarkSearch, OneMarkOrAProfileOfAnotherLengthFindsNothing) {
  MarkSearch one({6.5}, kLength_mm);
  EXPECT_FALSE(one.can_find());
  EXPECT_FALSE(one.find({}));
  MarkSearch search(kMarks_mm, kLength_mm);
  EXPECT_FALSE(search.find(std::vector<float>(10, 1)));
}

}  // namespace
}  // namespace tubed
