// How likely a test statistic is to be as large by chance.
#pragma once

namespace tubed {

/// P(chi-square with that many degrees of freedom > x). 1 for x <= 0.
double chi_square_tail(double x, double degrees_of_freedom);

/// x with P(chi-square <= x) = p, 0 < p < 1.
double chi_square_quantile(double p, double degrees_of_freedom);

/// P(F > x) for a ratio of mean squares with those degrees of freedom above and below. 1 for x <= 0.
double f_tail(double x, double degrees_above, double degrees_below);

}  // namespace tubed
