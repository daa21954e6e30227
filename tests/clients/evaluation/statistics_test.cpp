#include "clients/evaluation/statistics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace tubed {
namespace {

// Heights of paired plants, cross- minus self-fertilised: Darwin 1876, the worked example of
// scipy.stats.wilcoxon.
const std::vector<double> kDarwin{6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75};

TEST(Quantile, LiesOnTheLineBetweenTheTwoNeighbours) {
  // Position 0.25 * 3 = 0.75 between the first and the second of four values.
  EXPECT_DOUBLE_EQ(quantile({40, 10, 20, 30}, 0.25), 17.5);
  EXPECT_DOUBLE_EQ(quantile({40, 10, 20, 30}, 0), 10);
  EXPECT_DOUBLE_EQ(quantile({40, 10, 20, 30}, 1), 40);
}

TEST(Quantile, OfNothingOrOfWhatIsNoNumberIsRefused) {
  EXPECT_THROW(quantile({}, 0.5), std::invalid_argument);
  EXPECT_THROW(quantile({1, 2}, 1.5), std::invalid_argument);
  EXPECT_THROW(quantile({1, std::numeric_limits<double>::quiet_NaN()}, 0.5), std::invalid_argument);
}

TEST(MedianAndIqr, OfOneToNineAreFiveAndFour) {
  const MedianAndIqr spread = median_and_iqr({9, 1, 8, 2, 7, 3, 6, 4, 5});

  EXPECT_DOUBLE_EQ(spread.median, 5);
  EXPECT_DOUBLE_EQ(spread.iqr, 4);
}

TEST(Wilcoxon, GivesThePublishedValueForDarwinsPlants) {
  const WilcoxonResult result = wilcoxon_signed_rank(kDarwin);

  EXPECT_EQ(result.method, WilcoxonMethod::kExact);
  EXPECT_DOUBLE_EQ(result.rank_sum_negative, 24);  // scipy's documentation: statistic 24, p 0.041259765625
  EXPECT_DOUBLE_EQ(result.rank_sum_positive, 96);
  EXPECT_DOUBLE_EQ(result.p_two_sided, 0.041259765625);
  EXPECT_DOUBLE_EQ(result.rank_biserial(), 0.6);  // (96 - 24) / 120
}

TEST(Wilcoxon, FiveImprovementsOutOfFiveHaveThePValueOneSixteenth) {
  // 2 of 2^5 sign assignments: with five positions of the catheter no difference can be significant.
  const WilcoxonResult result = wilcoxon_signed_rank({0.1, 0.5, 0.2, 0.9, 0.4});

  EXPECT_DOUBLE_EQ(result.p_two_sided, 0.0625);
  EXPECT_DOUBLE_EQ(result.rank_biserial(), 1);
}

TEST(Wilcoxon, OfFivePairsHasThePValuesOfTheExactTable) {
  // Subsets of the ranks 1 .. 5 with a sum of at most w, of 32; twice that.
  constexpr std::array<double, 8> kTwoSided{2, 4, 6, 10, 14, 20, 26, 32};
  for (int signs = 0; signs < 32; ++signs) {
    std::vector<double> differences;
    int positive = 0;
    for (int rank = 1; rank <= 5; ++rank) {
      const bool is_positive = ((signs >> (rank - 1)) & 1) == 1;
      differences.push_back(is_positive ? rank : -rank);
      positive += is_positive ? rank : 0;
    }
    const auto smaller = static_cast<std::size_t>(std::min(positive, 15 - positive));
    EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(differences).p_two_sided, kTwoSided[smaller] / 32) << signs;
  }
}

TEST(Wilcoxon, CountsTiesExactlyByTheirMidRanks) {
  // Ranks 1.5, 1.5, 3 and the smaller sum 1.5: subsets with a sum <= 1.5 are {}, {1.5}, {1.5'}: p = 2 * 3
  // / 8.
  const WilcoxonResult result = wilcoxon_signed_rank({1, -1, 2});

  EXPECT_TRUE(result.has_ties);
  EXPECT_DOUBLE_EQ(result.rank_sum_negative, 1.5);
  EXPECT_DOUBLE_EQ(result.p_two_sided, 0.75);
}

TEST(Wilcoxon, DropsZerosAndSaysHowMany) {
  const WilcoxonResult result = wilcoxon_signed_rank({0, 0.1, 0.5, 0, 0.2, 0.9, 0.4});

  EXPECT_EQ(result.zero_count, 2U);
  EXPECT_EQ(result.used_count, 5U);
  EXPECT_DOUBLE_EQ(result.p_two_sided, 0.0625);
}

TEST(Wilcoxon, OfTwoEqualMethodsShowsNoEffect) {
  const WilcoxonResult result = wilcoxon_signed_rank({0, 0, 0});

  EXPECT_DOUBLE_EQ(result.p_two_sided, 1);
  EXPECT_DOUBLE_EQ(result.rank_biserial(), 0);
}

TEST(Wilcoxon, TurnsToTheNormalApproximationAboveFiftyPairs) {
  std::vector<double> differences(50);
  for (std::size_t i = 0; i < differences.size(); ++i) differences[i] = static_cast<double>(i + 1);

  EXPECT_EQ(wilcoxon_signed_rank(differences).method, WilcoxonMethod::kExact);
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(differences).p_two_sided, std::ldexp(1.0, -49));  // 2 of 2^50
  differences.push_back(51);
  const WilcoxonResult result = wilcoxon_signed_rank(differences);

  EXPECT_EQ(result.method, WilcoxonMethod::kNormalApproximation);
  // z = (n(n+1)/4) / sqrt(n(n+1)(2n+1)/24) for n = 51.
  EXPECT_DOUBLE_EQ(result.p_two_sided, std::erfc(663 / std::sqrt(11381.5) / std::sqrt(2.0)));
}

TEST(Wilcoxon, TiesMakeTheVarianceOfTheApproximationSmaller) {
  // 52 times the same size, 20 of them negative: mid-rank 26.5, W- = 530, mean 689, variance 52 * 26.5^2 / 4.
  std::vector<double> differences(52, 1.0);
  std::fill(differences.begin(), differences.begin() + 20, -1.0);

  const double z = (689 - 530) / std::sqrt(52 * 26.5 * 26.5 / 4);
  EXPECT_NEAR(wilcoxon_signed_rank(differences).p_two_sided, std::erfc(z / std::sqrt(2.0)), 1e-15);
}

TEST(Wilcoxon, ExchangingTheMethodsTurnsTheEffectRound) {
  std::vector<double> exchanged = kDarwin;
  for (double& difference : exchanged) difference = -difference;

  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(exchanged).rank_biserial(), -0.6);
  EXPECT_DOUBLE_EQ(wilcoxon_signed_rank(exchanged).p_two_sided, 0.041259765625);
}

TEST(Bonferroni, MultipliesAndStopsAtOne) {
  EXPECT_DOUBLE_EQ(bonferroni(0.01, 5), 0.05);
  EXPECT_DOUBLE_EQ(bonferroni(0.4, 5), 1);
}

TEST(ShapiroWilk, GivesThePublishedValueForElevenWeights) {
  // Shapiro and Wilk, Biometrika 52 (1965), example 1: W = 0.79; R's shapiro.test gives 0.78881 and p
  // 0.006704.
  const auto result = shapiro_wilk({148, 154, 158, 160, 161, 162, 166, 170, 182, 195, 236});

  ASSERT_TRUE(result.has_value());
  EXPECT_NEAR(result->w, 0.78881, 5e-6);
  EXPECT_NEAR(result->p, 0.006704, 5e-7);
}

TEST(ShapiroWilk, OfThreeEquallySpacedValuesIsOne) {
  const auto result = shapiro_wilk({1, 2, 3});  // n = 3 has a closed form: W = 1, p = 1

  ASSERT_TRUE(result.has_value());
  EXPECT_NEAR(result->w, 1, 1e-12);
  EXPECT_NEAR(result->p, 1, 1e-6);
}

TEST(ShapiroWilk, HasNoAnswerForTwoValuesOrEqualOnes) {
  EXPECT_FALSE(shapiro_wilk({1, 2}).has_value());
  EXPECT_FALSE(shapiro_wilk({3, 3, 3, 3}).has_value());
}

}  // namespace
}  // namespace tubed
