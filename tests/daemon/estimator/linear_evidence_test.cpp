#include "daemon/estimator/algebra/linear_evidence.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <random>
#include <vector>

namespace tubed {
namespace {

constexpr Eigen::Index kUnknowns = 9;
constexpr Eigen::Index kResiduals = 14;

/// Residuals of random rows.
struct Residuals {
  Residuals() {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    A = A.unaryExpr([&](double) { return normal(random); });
    r = r.unaryExpr([&](double) { return normal(random); });
    v = v.unaryExpr([&](double) { return 0.5 + std::abs(normal(random)); });
  }
  [[nodiscard]] LinearEvidence taken() const {
    LinearEvidence evidence(kUnknowns);
    for (Eigen::Index k = 0; k < kResiduals; ++k) {
      evidence.add(A.row(k).transpose(), r[k], v[k]);
    }
    evidence.freeze();
    return evidence;
  }
  /// log N(r; 0, A D^2 A^T + diag(v)), from the definition.
  [[nodiscard]] double log_likelihood(const Eigen::VectorXd& D) const {
    const Eigen::MatrixXd S =
        A * D.array().square().matrix().asDiagonal() * A.transpose() + Eigen::MatrixXd(v.asDiagonal());
    return -0.5 * std::log(S.determinant()) - 0.5 * r.dot(S.llt().solve(r));
  }
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(kResiduals, kUnknowns);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(kResiduals);
  Eigen::VectorXd v = Eigen::VectorXd::Zero(kResiduals);
};

Eigen::VectorXd wide_first() {
  Eigen::VectorXd D = Eigen::VectorXd::LinSpaced(kUnknowns, 0.2, 1.5);
  D[0] = 7;
  return D;
}

TEST(LinearEvidence, ComparesPriorsAsTheLikelihoodOfTheResidualsDoes) {
  const Residuals residuals;
  LinearEvidence evidence = residuals.taken();
  const Eigen::VectorXd narrow = Eigen::VectorXd::Constant(kUnknowns, 0.3);
  const double difference = evidence.explain(wide_first()) - evidence.explain(narrow);
  EXPECT_NEAR(difference, residuals.log_likelihood(wide_first()) - residuals.log_likelihood(narrow), 1e-9);
}

TEST(LinearEvidence, HasTheMeanAndTheCovarianceOfTheNormalEquations) {
  const Residuals residuals;
  LinearEvidence evidence = residuals.taken();
  const Eigen::VectorXd D = wide_first();
  evidence.explain(D);
  const Eigen::MatrixXd W = residuals.v.cwiseInverse().asDiagonal();
  Eigen::MatrixXd N = residuals.A.transpose() * W * residuals.A;
  N.diagonal() += D.array().square().inverse().matrix();
  EXPECT_LT((evidence.mean() - N.llt().solve(residuals.A.transpose() * W * residuals.r)).norm(), 1e-9);
  ASSERT_TRUE(evidence.take_as_base());
  evidence.widened({});
  EXPECT_LT((evidence.covariance_of_first() - N.inverse().topLeftCorner<6, 6>()).norm(), 1e-9);
  EXPECT_NEAR(evidence.variance_of(kUnknowns - 1), N.inverse()(kUnknowns - 1, kUnknowns - 1), 1e-9);
}

/// What of the base is allowed more.
struct WidenedCase {
  const char* name;
  std::vector<LinearEvidence::Widened> unknowns;
  friend void PrintTo(const WidenedCase& widened, std::ostream* out) { *out << widened.name; }
};

class LinearEvidenceWidened : public testing::TestWithParam<WidenedCase> {
 protected:
  static Eigen::VectorXd base() { return Eigen::VectorXd::LinSpaced(kUnknowns, 0.2, 1.5); }
  [[nodiscard]] static Eigen::VectorXd all_of(const WidenedCase& widened) {
    Eigen::VectorXd D = base();
    for (const auto& [unknown, sigma] : widened.unknowns) D[unknown] = std::max(sigma, D[unknown]);
    return D;
  }
};

TEST_P(LinearEvidenceWidened, IsTheExplanationThatAllowsThoseUnknownsMore) {
  LinearEvidence whole = Residuals().taken();
  const double expected = whole.explain(all_of(GetParam()));
  LinearEvidence evidence = Residuals().taken();
  evidence.explain(base());
  ASSERT_TRUE(evidence.take_as_base());
  EXPECT_NEAR(evidence.widened(GetParam().unknowns), expected, 1e-9);
  EXPECT_LT((evidence.mean() - whole.mean()).norm(), 1e-9);
  ASSERT_TRUE(whole.take_as_base());
  whole.widened({});
  EXPECT_LT((evidence.covariance_of_first() - whole.covariance_of_first()).norm(), 1e-8);
  for (Eigen::Index unknown = 0; unknown < kUnknowns; ++unknown) {
    EXPECT_NEAR(evidence.variance_of(unknown), whole.variance_of(unknown), 1e-8) << unknown;
  }
}

TEST_P(LinearEvidenceWidened, LeavesTheBaseAsItIs) {
  LinearEvidence evidence = Residuals().taken();
  const double expected = evidence.explain(base());
  const Eigen::VectorXd mean = evidence.mean();
  ASSERT_TRUE(evidence.take_as_base());
  evidence.widened(GetParam().unknowns);
  EXPECT_EQ(evidence.widened({}), expected);
  EXPECT_EQ((evidence.mean() - mean).norm(), 0);
}

INSTANTIATE_TEST_SUITE_P(
    All, LinearEvidenceWidened,
    testing::Values(WidenedCase{"one", {{0, 7}}}, WidenedCase{"muchMore", {{8, 1e4}}},
                    WidenedCase{"lessThanTheBase", {{4, 0.1}}}, WidenedCase{"two", {{7, 20}, {2, 3}}},
                    WidenedCase{"six", {{0, 9}, {1, 9}, {2, 9}, {3, 4}, {4, 4}, {5, 1e3}}}));

TEST(LinearEvidence, WithoutAFiniteCovarianceThereIsNoBase) {
  LinearEvidence evidence = Residuals().taken();
  evidence.add(Eigen::VectorXd::Constant(kUnknowns, std::numeric_limits<double>::infinity()), 1, 1);
  evidence.freeze();
  evidence.explain(wide_first());
  EXPECT_FALSE(evidence.take_as_base());
}

TEST(LinearEvidence, AnUnknownThatMayNotVaryIsZero) {
  LinearEvidence evidence = Residuals().taken();
  Eigen::VectorXd D = wide_first();
  D[4] = 0;
  EXPECT_TRUE(std::isfinite(evidence.explain(D)));
  EXPECT_EQ(evidence.mean()[4], 0);
  EXPECT_NE(evidence.mean()[3], 0);
}

TEST(LinearEvidence, WhatComesAfterFreezingCountsAfterTheNext) {
  LinearEvidence evidence = Residuals().taken();
  const double before = evidence.explain(wide_first());
  evidence.add(Eigen::VectorXd::Ones(kUnknowns), 100, 0.01);
  EXPECT_EQ(evidence.explain(wide_first()), before);
  evidence.freeze();
  EXPECT_NE(evidence.explain(wide_first()), before);
}

TEST(LinearEvidence, WhatIsForgottenExplainsNothing) {
  LinearEvidence evidence = Residuals().taken();
  evidence.forget(0);
  evidence.freeze();
  EXPECT_EQ(evidence.explain(wide_first()), 0);
  EXPECT_EQ(evidence.mean().norm(), 0);
}

TEST(LinearEvidence, HalfForgottenCountsAsTwiceTheVariance) {
  Residuals residuals;
  LinearEvidence evidence = residuals.taken();
  evidence.forget(0.5);
  evidence.freeze();
  residuals.v *= 2;
  LinearEvidence noisier = residuals.taken();
  EXPECT_NEAR(evidence.explain(wide_first()), noisier.explain(wide_first()), 1e-9);
}

TEST(LinearEvidence, PartsAddUpUntilTheyAreRetracted) {
  const Residuals residuals;
  LinearEvidence all = residuals.taken();
  LinearEvidence in_parts(kUnknowns, 2);
  LinearEvidence half(kUnknowns);
  for (Eigen::Index k = 0; k < kResiduals; ++k) {
    in_parts.add(residuals.A.row(k).transpose(), residuals.r[k], residuals.v[k],
                 static_cast<std::size_t>(k % 2));
    if (k % 2 == 0) half.add(residuals.A.row(k).transpose(), residuals.r[k], residuals.v[k]);
  }
  in_parts.freeze();
  EXPECT_NEAR(in_parts.explain(wide_first()), all.explain(wide_first()), 1e-9);
  in_parts.retract(1);
  in_parts.freeze();
  half.freeze();
  EXPECT_NEAR(in_parts.explain(wide_first()), half.explain(wide_first()), 1e-9);
}

TEST(LinearEvidence, WhatIsKeptIsNotRetracted) {
  const Residuals residuals;
  LinearEvidence all = residuals.taken();
  LinearEvidence kept(kUnknowns, 2);
  for (Eigen::Index k = 0; k < kResiduals; ++k) {
    kept.add(residuals.A.row(k).transpose(), residuals.r[k], residuals.v[k], 0);
  }
  kept.keep(0, 1);
  kept.retract(0);
  kept.keep(1);
  kept.retract(1);
  kept.freeze();
  EXPECT_NEAR(kept.explain(wide_first()), all.explain(wide_first()), 1e-9);
}

TEST(LinearEvidence, NumbersThatAreNoneExplainNothing) {
  LinearEvidence evidence = Residuals().taken();
  evidence.add(Eigen::VectorXd::Constant(kUnknowns, std::numeric_limits<double>::quiet_NaN()), 1, 1);
  evidence.freeze();
  EXPECT_EQ(evidence.explain(wide_first()), -std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace tubed
