// Which coils are right, against sums written out and closed forms.
#include "daemon/estimator/coils/coil_faults.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace tubed {
namespace {

constexpr double kDistance2_mm2 = 900;  // of the model's 30 mm

CoilInnovations independent(int count, double variance_mm2) {
  CoilInnovations all(count);
  all.count = count;
  for (int k = 0; k < count; ++k) all.coil[static_cast<std::size_t>(k)] = k;
  all.covariance_mm2.diagonal().setConstant(variance_mm2);
  return all;
}

void correlate(CoilInnovations& all, double variance_mm2) {
  for (int a = 0; a < all.count; ++a) {
    for (int b = 0; b < all.count; ++b) {
      all.covariance_mm2.block<3, 3>(3 * a, 3 * b).diagonal().array() += variance_mm2;
    }
  }
}

double log_density(const Eigen::VectorXd& x, const Eigen::MatrixXd& S) {
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(S);
  return -0.5 * x.dot(lu.solve(x)) - 0.5 * std::log(lu.determinant());
}

/// Of each coil, by the sum over all subsets with the whole covariance of each.
std::vector<double> beliefs_by_enumeration(const CoilInnovations& all, const CoilBeliefs& before) {
  const int n = all.count;
  std::vector<double> right(static_cast<std::size_t>(n));
  double sum = 0;
  for (unsigned wrong = 0; wrong < 1U << n; ++wrong) {
    Eigen::MatrixXd S = all.covariance_mm2.topLeftCorner(3 * n, 3 * n);
    double prior = 1;
    for (int k = 0; k < n; ++k) {
      const double belief = before[static_cast<std::size_t>(all.coil[static_cast<std::size_t>(k)])];
      const bool is_wrong = (wrong >> k & 1U) != 0;
      prior *= is_wrong ? 1 - belief : belief;
      if (is_wrong) S.diagonal().segment<3>(3 * k).array() += kDistance2_mm2;
    }
    const double weight = prior * std::exp(log_density(all.innovation_mm.head(3 * n), S));
    sum += weight;
    for (int k = 0; k < n; ++k) right[static_cast<std::size_t>(k)] += (wrong >> k & 1U) != 0 ? 0 : weight;
  }
  for (double& each : right) each /= sum;
  return right;
}

TEST(CoilFaults, BeliefsAreTheSumOverAllSubsets) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    const int n = 2 + trial % 4;
    CoilInnovations all = independent(n, 3);
    Eigen::MatrixXd root(3 * n, 3 * n);
    for (double& each : root.reshaped()) each = 2 * normal(random);
    all.covariance_mm2 += root * root.transpose();
    for (double& each : all.innovation_mm) each = 6 * normal(random);
    std::reverse(all.coil.begin(), all.coil.begin() + n);  // the third coil need not be the third index
    CoilFaults faults({}, n);
    CoilBeliefs beliefs = beliefs_at_first({});
    for (std::size_t k = 0; k < 4; ++k) beliefs[k] = 0.2 + 0.2 * static_cast<double>(k);
    const std::vector<double> expected = beliefs_by_enumeration(all, beliefs);
    faults.weigh(all, beliefs);
    for (int k = 0; k < n; ++k) {
      EXPECT_NEAR(beliefs[static_cast<std::size_t>(n - 1 - k)], expected[static_cast<std::size_t>(k)], 2e-6)
          << n << " coils, the one at place " << k;
    }
  }
}

// Odds times N(0, s^2) over N(0, s^2 + 30^2).
TEST(CoilFaults, OneCoilIsBayesRule) {
  for (const double off_mm : {0.0, 4.0, 8.0, 12.0}) {
    CoilInnovations one = independent(1, 4);
    one.innovation_mm << off_mm, 0, 0;
    CoilFaults faults({}, 1);
    CoilBeliefs beliefs = beliefs_at_first({});
    faults.weigh(one, beliefs);
    const double wider = 4 + kDistance2_mm2;
    const double log_odds =
        std::log(0.999 / 0.001) - 0.5 * off_mm * off_mm * (1 / 4.0 - 1 / wider) + 1.5 * std::log(wider / 4);
    EXPECT_NEAR(beliefs[0], 1 / (1 + std::exp(-log_odds)), 2e-6) << off_mm;
  }
}

TEST(CoilFaults, WhatAllCoilsShareIsAMotionAndNoFault) {
  for (const bool may_move : {true, false}) {
    CoilInnovations all = independent(5, 1);
    correlate(all, may_move ? 49 : 0);
    all.innovation_mm.setConstant(7);
    CoilFaults faults({}, 5);
    CoilBeliefs beliefs = beliefs_at_first({});
    faults.weigh(all, beliefs);
    for (std::size_t k = 0; k < 5; ++k) EXPECT_EQ(beliefs[k] > 0.99, may_move) << k;
  }
}

// Within what is not known of the motion, but not where the others are.
TEST(CoilFaults, ACoilThatTheOthersContradictIsWrongThoughEachAloneIsExpected) {
  CoilInnovations all = independent(5, 1);
  correlate(all, 400);
  all.innovation_mm.segment<3>(6).setConstant(9);
  CoilFaults faults({}, 5);
  CoilBeliefs beliefs = beliefs_at_first({});
  faults.weigh(all, beliefs);
  for (const std::size_t coil : {0U, 1U, 3U, 4U}) EXPECT_GT(beliefs[coil], 0.99) << coil;
  EXPECT_LT(beliefs[2], 0.01);
}

TEST(CoilFaults, OfManyCoilsThreeOrAllAreFoundWhereverTheyAre) {
  constexpr int kCount = kMaxCoils;
  for (const std::vector<int>& wrong :
       {std::vector<int>{}, {0}, {kCount - 1}, {0, 1, 2}, {0, 7, 15}, {13, 14, 15}}) {
    CoilInnovations all = independent(kCount, 4);
    for (const int k : wrong) all.innovation_mm.segment<3>(3 * k) << 25, -25, 25;
    CoilFaults faults({}, kCount);
    CoilBeliefs beliefs = beliefs_at_first({});
    faults.weigh(all, beliefs);
    for (int k = 0; k < kCount; ++k) {
      const bool is_wrong = std::find(wrong.begin(), wrong.end(), k) != wrong.end();
      EXPECT_EQ(beliefs[static_cast<std::size_t>(k)] < 0.5, is_wrong) << wrong.size() << " wrong, coil " << k;
    }
  }
  CoilInnovations all = independent(kCount, 4);
  all.innovation_mm.setConstant(25);
  CoilFaults faults({}, kCount);
  CoilBeliefs beliefs = beliefs_at_first({});
  faults.weigh(all, beliefs);
  for (const double belief : beliefs) EXPECT_LT(belief, 0.5);
}

// One after the other there may be more of them.
TEST(CoilFaults, OfManyCoilsFiveMayBeWrongThatDidNotGoWrongAtOnce) {
  constexpr int kCount = 12;
  CoilInnovations all = independent(kCount, 4);
  CoilFaults faults({}, kCount);
  CoilBeliefs beliefs = beliefs_at_first({});
  for (int k = 0; k < 5; ++k) {
    all.innovation_mm.segment<3>(6 * k) << 25, -25, 25;
    faults.weigh(all, beliefs);
  }
  for (int k = 0; k < kCount; ++k) {
    EXPECT_EQ(beliefs[static_cast<std::size_t>(k)] < 0.5, k < 10 && k % 2 == 0) << k;
  }
}

TEST(CoilFaults, OfACoilThatSaysNothingNothingChanges) {
  CoilInnovations all = independent(2, 1);
  all.coil = {0, 2};
  all.innovation_mm.setConstant(20);
  CoilFaults faults({}, 3);
  CoilBeliefs beliefs = beliefs_at_first({});
  beliefs[1] = 0.3;
  faults.weigh(all, beliefs);
  EXPECT_LT(beliefs[0], 0.01);
  EXPECT_EQ(beliefs[1], 0.3);
  EXPECT_LT(beliefs[2], 0.01);
}

TEST(CoilFaults, BeliefReturnsInTheMeanTime) {
  const CoilFaultModel model{.probability = 0, .lasting_s = 0.5, .distance_mm = 30};
  double belief = 0;
  for (int i = 0; i < 20; ++i) belief = aged_belief(model, belief, 0.025);
  EXPECT_NEAR(belief, 1 - std::exp(-1.0), 1e-4);
  EXPECT_NEAR(aged_belief({}, 1, 0.025), 0.999, 1e-9);
}

TEST(CoilFaults, WhatIsNoCovarianceOrNoNumberChangesNothing) {
  for (const double broken : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    CoilInnovations all = independent(3, broken);
    CoilFaults faults({}, 3);
    CoilBeliefs beliefs = beliefs_at_first({});
    faults.weigh(all, beliefs);
    EXPECT_EQ(beliefs, beliefs_at_first({}));
    all = independent(3, 1);
    all.innovation_mm[4] = std::numeric_limits<double>::quiet_NaN();
    faults.weigh(all, beliefs);
    EXPECT_EQ(beliefs, beliefs_at_first({}));
  }
}

TEST(CoilFaults, LeavingACoilOutHasToSaveWhatItWasBelieved) {
  EXPECT_NEAR(gain_to_leave_out({}, 0.999, 2.31), 29.2, 0.1);
  EXPECT_NEAR(gain_to_leave_out({}, 0.1, 2.31), 11.0, 0.1);
  EXPECT_NEAR(gain_to_leave_out({}, 0.5, 30), 3 * std::log(2), 1e-9);
}

}  // namespace
}  // namespace tubed
