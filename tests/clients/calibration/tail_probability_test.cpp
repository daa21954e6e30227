#include "clients/calibration/tail_probability.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tubed {
namespace {

// Closed forms: chi-square of 2 is exp(-x / 2); F of 2 and n is (1 + 2 x / n)^(-n / 2).
TEST(TailProbability, AgreesWithClosedForms) {
  EXPECT_NEAR(chi_square_tail(3, 2), std::exp(-1.5), 1e-12);
  EXPECT_NEAR(f_tail(3, 2, 10), std::pow(1 + 0.6, -5), 1e-12);
  EXPECT_NEAR(chi_square_quantile(0.95, 2), -2 * std::log(0.05), 1e-9);
}

TEST(TailProbability, NothingIsBelowZero) {
  EXPECT_EQ(chi_square_tail(-1, 3), 1);
  EXPECT_EQ(f_tail(0, 3, 3), 1);
}

}  // namespace
}  // namespace tubed
