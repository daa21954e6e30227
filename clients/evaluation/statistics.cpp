#include "clients/evaluation/statistics.hpp"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <stdexcept>

namespace tubed {

namespace {

void require_finite(const std::vector<double>& values) {
  if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); })) {
    throw std::invalid_argument("statistics of a value that is not finite");
  }
}

double sorted_quantile(const std::vector<double>& sorted, double q) {
  const double position = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(position);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], position - static_cast<double>(below));
}

double normal_quantile(double probability) {
  return -std::numbers::sqrt2 * boost::math::erfc_inv(2 * probability);
}

double normal_upper_tail(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

/// c[0] + c[1] x + c[2] x^2 + ...
double polynomial(std::span<const double> c, double x) {
  double value = 0;
  for (std::size_t i = c.size(); i-- > 0;) value = value * x + c[i];
  return value;
}

/// Twice the mid-rank (1-based) of each of the ascending sizes: whole numbers even under ties.
std::vector<std::size_t> doubled_mid_ranks(const std::vector<double>& sorted_sizes) {
  std::vector<std::size_t> doubled(sorted_sizes.size());
  for (std::size_t first = 0; first < sorted_sizes.size();) {
    std::size_t end = first + 1;
    while (end < sorted_sizes.size() && sorted_sizes[end] == sorted_sizes[first]) ++end;
    // Ranks first + 1 .. end share the mean of the two ends.
    std::fill(doubled.begin() + static_cast<std::ptrdiff_t>(first),
              doubled.begin() + static_cast<std::ptrdiff_t>(end), first + 1 + end);
    first = end;
  }
  return doubled;
}

/// P(rank sum <= smaller) * 2 over all sign assignments, by counting the subsets of the doubled ranks that
/// have each sum. Each step halves the weights, so that the entries are probabilities from the start.
double exact_two_sided_p(const std::vector<std::size_t>& doubled_ranks, std::size_t doubled_smaller_sum) {
  const std::size_t total = std::accumulate(doubled_ranks.begin(), doubled_ranks.end(), std::size_t{0});
  std::vector<double> probability(total + 1, 0.0);
  probability[0] = 1;
  for (const std::size_t rank : doubled_ranks) {
    for (std::size_t sum = total + 1; sum-- > 0;) {
      probability[sum] = 0.5 * (probability[sum] + (sum >= rank ? probability[sum - rank] : 0.0));
    }
  }
  const auto end = probability.begin() + static_cast<std::ptrdiff_t>(doubled_smaller_sum) + 1;
  return std::min(1.0, 2 * std::accumulate(probability.begin(), end, 0.0));
}

/// Sum of t^3 - t over groups of t equal sizes.
double tie_term(const std::vector<double>& sorted_sizes) {
  double term = 0;
  for (auto first = sorted_sizes.begin(); first != sorted_sizes.end();) {
    const auto end = std::upper_bound(first, sorted_sizes.end(), *first);
    const auto t = static_cast<double>(end - first);
    term += t * t * t - t;
    first = end;
  }
  return term;
}

double approximate_two_sided_p(const std::vector<double>& sorted_sizes, double smaller_sum) {
  const auto n = static_cast<double>(sorted_sizes.size());
  const double mean = n * (n + 1) / 4;
  const double variance = n * (n + 1) * (2 * n + 1) / 24 - tie_term(sorted_sizes) / 48;
  return 2 * normal_upper_tail(std::abs(smaller_sum - mean) / std::sqrt(variance));
}

/// AS R94's weights of the ordered sample: antisymmetric, sum of squares 1; the upper half, greatest first.
std::vector<double> shapiro_wilk_weights(std::size_t n) {
  static constexpr double kMax[] = {0, 0.221157, -0.147981, -2.07119, 4.434685, -2.706056};
  static constexpr double kSecond[] = {0, 0.042981, -0.293762, -1.752461, 5.682633, -3.582633};
  if (n == 3) return {std::numbers::sqrt2 / 2};
  std::vector<double> m(n / 2);  // Blom's approximation of the expected order statistics
  double m_squares = 0;
  for (std::size_t i = 0; i < m.size(); ++i) {
    m[i] = -normal_quantile((static_cast<double>(i) + 0.625) / (static_cast<double>(n) + 0.25));
    m_squares += 2 * m[i] * m[i];
  }
  const double u = 1 / std::sqrt(static_cast<double>(n));
  std::vector<double> a(m.size());
  a[0] = polynomial(kMax, u) + m[0] / std::sqrt(m_squares);
  double rest_of_m = m_squares - 2 * m[0] * m[0];
  double rest_of_a = 1 - 2 * a[0] * a[0];
  std::size_t done = 1;
  if (n > 5) {
    a[1] = polynomial(kSecond, u) + m[1] / std::sqrt(m_squares);
    rest_of_m -= 2 * m[1] * m[1];
    rest_of_a -= 2 * a[1] * a[1];
    done = 2;
  }
  for (std::size_t i = done; i < m.size(); ++i) a[i] = m[i] * std::sqrt(rest_of_a / rest_of_m);
  return a;
}

/// p-value of 1 - W: a transformation of it is normal with mean and deviation fitted over n.
double shapiro_wilk_p(double one_minus_w, std::size_t sample_size) {
  static constexpr double kGamma[] = {-2.273, 0.459};
  static constexpr double kSmallMean[] = {0.544, -0.39978, 0.025054, -6.714e-4};
  static constexpr double kSmallLogDeviation[] = {1.3822, -0.77857, 0.062767, -0.0020322};
  static constexpr double kMean[] = {-1.5861, -0.31082, -0.083751, 0.0038915};
  static constexpr double kLogDeviation[] = {-0.4803, -0.082676, 0.0030302};
  const auto n = static_cast<double>(sample_size);
  if (sample_size == 3) {  // known in closed form
    const double least = std::asin(std::sqrt(0.75));
    return std::max(0.0, 6 / std::numbers::pi * (std::asin(std::sqrt(1 - one_minus_w)) - least));
  }
  const double y = std::log(one_minus_w);
  if (sample_size <= 11) {
    const double gamma = polynomial(kGamma, n);
    if (y >= gamma) return 0;
    return normal_upper_tail((-std::log(gamma - y) - polynomial(kSmallMean, n)) /
                             std::exp(polynomial(kSmallLogDeviation, n)));
  }
  const double log_n = std::log(n);
  return normal_upper_tail((y - polynomial(kMean, log_n)) / std::exp(polynomial(kLogDeviation, log_n)));
}

}  // namespace

double quantile(std::vector<double> values, double q) {
  if (values.empty()) throw std::invalid_argument("quantile of no value");
  if (!(q >= 0 && q <= 1)) throw std::invalid_argument("quantile outside 0 .. 1");
  require_finite(values);
  std::sort(values.begin(), values.end());
  return sorted_quantile(values, q);
}

MedianAndIqr median_and_iqr(const std::vector<double>& values) {
  return {quantile(values, 0.5), quantile(values, 0.75) - quantile(values, 0.25)};
}

std::string_view name_of(WilcoxonMethod method) {
  return method == WilcoxonMethod::kExact ? "exact" : "normal approximation";
}

double WilcoxonResult::rank_biserial() const {
  const double all = rank_sum_positive + rank_sum_negative;
  return all > 0 ? (rank_sum_positive - rank_sum_negative) / all : 0.0;
}

WilcoxonResult wilcoxon_signed_rank(const std::vector<double>& differences) {
  require_finite(differences);
  std::vector<double> used;
  std::copy_if(differences.begin(), differences.end(), std::back_inserter(used),
               [](double d) { return d != 0; });
  std::sort(used.begin(), used.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  std::vector<double> sizes(used.size());
  std::transform(used.begin(), used.end(), sizes.begin(), [](double d) { return std::abs(d); });
  const std::vector<std::size_t> doubled_ranks = doubled_mid_ranks(sizes);

  std::size_t doubled_positive = 0;
  std::size_t doubled_negative = 0;
  for (std::size_t i = 0; i < used.size(); ++i)
    (used[i] > 0 ? doubled_positive : doubled_negative) += doubled_ranks[i];

  WilcoxonResult result;
  result.used_count = used.size();
  result.zero_count = differences.size() - used.size();
  result.has_ties = std::adjacent_find(sizes.begin(), sizes.end()) != sizes.end();
  result.rank_sum_positive = static_cast<double>(doubled_positive) / 2;
  result.rank_sum_negative = static_cast<double>(doubled_negative) / 2;
  const std::size_t doubled_smaller = std::min(doubled_positive, doubled_negative);
  if (used.size() <= kWilcoxonExactLimit) {
    result.method = WilcoxonMethod::kExact;
    result.p_two_sided = exact_two_sided_p(doubled_ranks, doubled_smaller);
  } else {
    result.method = WilcoxonMethod::kNormalApproximation;
    result.p_two_sided = approximate_two_sided_p(sizes, static_cast<double>(doubled_smaller) / 2);
  }
  return result;
}

double bonferroni(double p, std::size_t comparison_count) {
  return std::min(1.0, p * static_cast<double>(comparison_count));
}

std::optional<ShapiroWilkResult> shapiro_wilk(std::vector<double> values) {
  require_finite(values);
  const std::size_t n = values.size();
  if (n < 3 || n > 5000) return std::nullopt;
  std::sort(values.begin(), values.end());
  if (values.front() == values.back()) return std::nullopt;
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(n);
  const std::vector<double> weights = shapiro_wilk_weights(n);
  double weighted = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) weighted += weights[i] * (values[n - 1 - i] - values[i]);
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  // (S - A)(S + A) / S^2 rather than 1 - A^2 / S^2: W is so near 1 that the difference of the squares loses
  // digits. No smaller than the rounding of a double, whose logarithm is taken.
  const double spread = std::sqrt(squares);
  const double one_minus_w = std::max(1e-16, (spread - weighted) * (spread + weighted) / squares);
  return ShapiroWilkResult{1 - one_minus_w, shapiro_wilk_p(one_minus_w, n)};
}

}  // namespace tubed
