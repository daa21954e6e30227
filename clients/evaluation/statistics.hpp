// The statistics of the paper's Table 1: medians, paired comparison of two methods, effect size, normality.
// Pure functions of values; all of them refuse non-finite input with std::invalid_argument.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

namespace tubed {

/// Quantile `q` in [0, 1] of at least one value, interpolated linearly between order statistics: definition 7
/// of Hyndman and Fan, "Sample Quantiles in Statistical Packages", The American Statistician 50 (1996)
/// 361-365; what numpy does by default. Throws std::invalid_argument for no value or a `q` outside.
double quantile(std::vector<double> values, double q);

/// Middle and spread of a sample, in its unit.
struct MedianAndIqr {
  double median;
  double iqr;  ///< interquartile range: quantile 0.75 - quantile 0.25
};

/// Both at once, by `quantile`. Throws std::invalid_argument for no value.
MedianAndIqr median_and_iqr(const std::vector<double>& values);

/// Where the p-value of a Wilcoxon test comes from.
enum class WilcoxonMethod {
  kExact,                ///< all sign assignments counted
  kNormalApproximation,  ///< normal, variance corrected for ties, no continuity correction
};
std::string_view name_of(WilcoxonMethod method);

/// Paired test of "the differences are symmetric about zero", and its effect size.
struct WilcoxonResult {
  std::size_t used_count = 0;  ///< differences that are not zero
  std::size_t zero_count = 0;  ///< dropped
  bool has_ties = false;       ///< some used differences have equal size; they share their mean rank
  double rank_sum_positive = 0;
  double rank_sum_negative = 0;
  double p_two_sided = 1;  ///< 1 when no difference is left
  WilcoxonMethod method = WilcoxonMethod::kExact;

  /// Matched-pairs rank-biserial correlation, -1 .. 1: (positive - negative) / all rank sums; 0 when no
  /// difference is left. With differences EM - fused it is positive when fusing makes the error smaller.
  /// Kerby, "The simple difference formula", Comprehensive Psychology 3 (2014) 11.IT.3.1.
  [[nodiscard]] double rank_biserial() const;
};

/// Up to this many used differences are counted exactly.
inline constexpr std::size_t kWilcoxonExactLimit = 50;

/// Two-sided signed-rank test. Zeros are dropped and ties mid-ranked: Wilcoxon, "Individual comparisons by
/// ranking methods", Biometrics Bulletin 1 (1945) 80-83; variance under ties as in Hollander, Wolfe and
/// Chicken, "Nonparametric Statistical Methods" (3rd ed.), Sec. 3.1. Up to kWilcoxonExactLimit used
/// differences the distribution given the observed mid-ranks is counted exactly, with ties too; beyond, the
/// normal approximation.
WilcoxonResult wilcoxon_signed_rank(const std::vector<double>& differences);

/// A p-value corrected for `comparison_count` tests made at once: min(1, p * count).
double bonferroni(double p, std::size_t comparison_count);

/// Shapiro-Wilk statistic and the p-value of "the sample is normal".
struct ShapiroWilkResult {
  double w;
  double p;
};

/// Royston's algorithm AS R94, "Remark AS R94: A remark on algorithm AS 181: the W-test for normality",
/// Applied Statistics 44 (1995) 547-551, for 3 to 5000 values. Nothing for another count or when all values
/// are equal.
std::optional<ShapiroWilkResult> shapiro_wilk(std::vector<double> values);

}  // namespace tubed
