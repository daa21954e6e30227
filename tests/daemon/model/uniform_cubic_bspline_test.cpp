#include "daemon/model/uniform_cubic_bspline.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

namespace tubed {
namespace {

double sum(const std::array<double, 4>& weights) {
  return std::accumulate(weights.begin(), weights.end(), 0.0);
}

/// Weight of one coefficient at s, 0 when it is not among the four.
double weight(const CubicBasis& basis, const std::array<double, 4>& weights, int coefficient) {
  const int k = coefficient - basis.first;
  return k < 0 || k > 3 ? 0 : weights[static_cast<std::size_t>(k)];
}

TEST(UniformCubicBSpline, ItsWeightsArePartsOfOneAndTheirDerivativesCancel) {
  const UniformCubicBSpline spline(12, 370);
  for (double s_mm = -20; s_mm <= 390; s_mm += 0.37) {
    const CubicBasis basis = spline.basis(s_mm);

    EXPECT_NEAR(sum(basis.value), 1, 1e-12);
    EXPECT_NEAR(sum(basis.first_derivative), 0, 1e-12);
    EXPECT_NEAR(sum(basis.second_derivative), 0, 1e-12);
  }
}

TEST(UniformCubicBSpline, AtACoefficientsPlaceItWeighsTwoThirdsAndItsNeighboursASixth) {
  const UniformCubicBSpline spline(12, 90);  // spacing 10 mm, coefficient i at (i - 1) 10 mm
  const CubicBasis basis = spline.basis(40);

  EXPECT_NEAR(weight(basis, basis.value, 4), 1.0 / 6, 1e-14);
  EXPECT_NEAR(weight(basis, basis.value, 5), 2.0 / 3, 1e-14);
  EXPECT_NEAR(weight(basis, basis.value, 6), 1.0 / 6, 1e-14);
}

TEST(UniformCubicBSpline, ItsDerivativesAreTheFiniteDifferencesOfItsValues) {
  constexpr double kStep_mm = 1e-4;
  const UniformCubicBSpline spline(9, 100);
  for (double s_mm = -5; s_mm <= 105; s_mm += 0.713) {
    const CubicBasis before = spline.basis(s_mm - kStep_mm);
    const CubicBasis basis = spline.basis(s_mm);
    const CubicBasis after = spline.basis(s_mm + kStep_mm);
    for (int i = 0; i < spline.coefficient_count(); ++i) {
      EXPECT_NEAR(weight(basis, basis.first_derivative, i),
                  (weight(after, after.value, i) - weight(before, before.value, i)) / (2 * kStep_mm), 1e-9);
      EXPECT_NEAR(weight(basis, basis.second_derivative, i),
                  (weight(after, after.first_derivative, i) - weight(before, before.first_derivative, i)) /
                      (2 * kStep_mm),
                  1e-6);
    }
  }
}

TEST(UniformCubicBSpline, CoefficientsOnALineMakeThatLineAtUnitSpeedBeyondTheEndsToo) {
  const UniformCubicBSpline spline(8, 75);
  const Eigen::Vector3d tip_mm(1, 2, 3);
  const Eigen::Vector3d direction = Eigen::Vector3d(2, -1, 2) / 3;
  Eigen::Matrix3Xd C_mm(3, 8);
  for (int i = 0; i < 8; ++i) C_mm.col(i) = tip_mm + (i - 1) * spline.spacing_mm() * direction;

  for (const double s_mm : {-10.0, 0.0, 7.0, 37.5, 75.0, 90.0}) {
    const CubicBasis basis = spline.basis(s_mm);
    EXPECT_LT((combine(C_mm, basis.first, basis.value) - (tip_mm + s_mm * direction)).norm(), 1e-12);
    EXPECT_LT((combine(C_mm, basis.first, basis.first_derivative) - direction).norm(), 1e-12);
    EXPECT_LT(combine(C_mm, basis.first, basis.second_derivative).norm(), 1e-12);
  }
}

TEST(UniformCubicBSpline, NeverPointsOutsideTheCoefficients) {
  const UniformCubicBSpline spline(10, 365.3);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double s_mm : {-infinity, -1e9, -1e-12, 0.0, 365.3, 365.3 + 1e-12, 1e9, infinity,
                            std::numeric_limits<double>::quiet_NaN()}) {
    const int first = spline.basis(s_mm).first;

    EXPECT_GE(first, 0) << s_mm;
    EXPECT_LE(first + 3, 9) << s_mm;
  }
  EXPECT_EQ(spline.basis(365.3).first, 6);
}

TEST(UniformCubicBSplineDeathTest, TooFewCoefficientsOrNoLengthIsABug) {
  EXPECT_DEATH(UniformCubicBSpline(3, 100), "at least 4 coefficients");
  EXPECT_DEATH(UniformCubicBSpline(8, 0), "positive, finite length");
}

}  // namespace
}  // namespace tubed
