#include "clients/calibration/marker_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/calibration/registration_findings.hpp"
#include "clients/calibration/tail_probability.hpp"
#include "tests/clients/calibration/simulated_markers.hpp"

namespace tubed {
namespace {

constexpr double kSigma_mm = 0.4;
const double kFle_mm = kSigma_mm * std::sqrt(3.0);
constexpr int kDraws = 1000;
constexpr double kSigmas = 4;  // a sound test fails once in 15000 seeds

/// 4 to 13 markers, each count as often.
int count_of(int draw) { return 4 + draw % 10; }

TEST(MarkerRegistration, ExactMarkersGiveTheTransformBack) {
  std::mt19937 random(1);
  const SimulatedMarkers truth(random, 6, 0);

  const MarkerRegistration registration = register_markers(truth.pairs);

  EXPECT_TRUE(registration.T_world_em.isApprox(truth.T_world_em, 1e-9));
  EXPECT_LT(registration.fre_mm, 1e-9);
}

TEST(MarkerRegistration, FitzpatrickAndWestsErrorIsTheTraceOfTheCovariance) {
  std::mt19937 random(2);
  const SimulatedMarkers truth(random, 7, kSigma_mm);
  const MarkerRegistration registration = register_markers(truth.pairs, kFle_mm);

  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d p_world_mm = uniform_vector(random, 300);
    EXPECT_NEAR(expected_tre_mm(registration, p_world_mm), registration.quality.expected_error_mm(p_world_mm),
                1e-9);
  }
}

TEST(MarkerRegistration, ResidualsAreAsLargeAsTheErrorOfATouchAllows) {
  std::mt19937 random(3);
  double squared = 0;
  double degrees = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const SimulatedMarkers truth(random, count_of(draw), kSigma_mm);
    const MarkerRegistration registration = register_markers(truth.pairs);
    squared += registration.residual_world_mm.squaredNorm() / (kSigma_mm * kSigma_mm);
    degrees += registration.degrees_of_freedom;
  }

  // chi-square with all degrees of freedom together: variance 2 of each
  EXPECT_NEAR(squared, degrees, kSigmas * std::sqrt(2 * degrees));
}

TEST(MarkerRegistration, TheErrorAtTargetsIsAsExpected) {
  std::mt19937 random(4);
  double sum = 0;
  double variance = 0;
  double squared = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const SimulatedMarkers truth(random, count_of(draw), kSigma_mm);
    const Eigen::Vector3d p_world_mm = uniform_vector(random, 200);
    const MarkerRegistration registration = register_markers(truth.pairs, kFle_mm);
    const Eigen::Vector3d error_mm =
        registration.T_world_em * (truth.T_world_em.inverse() * p_world_mm) - p_world_mm;
    const Eigen::Matrix3d covariance_mm2 =
        registration.quality.covariance_at(p_world_mm).bottomRightCorner<3, 3>();
    const double tre_mm = expected_tre_mm(registration, p_world_mm);
    sum += error_mm.squaredNorm() / (tre_mm * tre_mm);
    // |e|^2 of a normal e has the mean tr C and the variance 2 tr C^2
    variance += 2 * (covariance_mm2 * covariance_mm2).trace() / std::pow(covariance_mm2.trace(), 2);
    squared += error_mm.dot(covariance_mm2.inverse() * error_mm);
  }

  EXPECT_NEAR(sum, kDraws, kSigmas * std::sqrt(variance));
  EXPECT_NEAR(squared, 3 * kDraws, kSigmas * std::sqrt(2 * 3 * kDraws));  // chi-square
}

/// How many of the draws lie within the ellipsoid of each level, against how many should.
void expect_coverage(const std::vector<double>& squared_distances, const std::vector<double>& expected_tails,
                     const std::vector<double>& limits) {
  for (std::size_t level = 0; level < limits.size(); ++level) {
    const auto inside = std::count_if(squared_distances.begin(), squared_distances.end(),
                                      [&](double squared) { return squared <= limits[level]; });
    const double expected = 1 - expected_tails[level];
    EXPECT_NEAR(static_cast<double>(inside), kDraws * expected,
                kSigmas * std::sqrt(kDraws * expected * (1 - expected)))
        << "within " << limits[level];
  }
}

const std::vector<double> kLevels{0.683, 0.954, 0.997};

TEST(MarkerRegistration, TheCovarianceCoversTheTruthWhereTheErrorOfATouchIsKnown) {
  std::mt19937 random(5);
  std::vector<double> squared;
  for (int draw = 0; draw < kDraws; ++draw) {
    const SimulatedMarkers truth(random, count_of(draw), kSigma_mm);
    const MarkerRegistration registration = register_markers(truth.pairs, kFle_mm);
    const auto error = truth.error_of(registration.T_world_em, registration.quality.centre_world_mm);
    squared.push_back(error.dot(registration.quality.covariance.inverse() * error));
  }

  std::vector<double> tails;
  std::vector<double> limits;
  for (const double level : kLevels) {
    tails.push_back(1 - level);
    limits.push_back(chi_square_quantile(level, 6));
  }
  expect_coverage(squared, tails, limits);
}

/// The error's distance in the covariance is 6 F(6, nu) (nu - 2) / nu when sigma^2 comes from nu residuals:
/// no count of markers may cover less than that says, and many markers cover as chi-square does.
TEST(MarkerRegistration, TheCovarianceCoversTheTruthWhereResidualsSayTheErrorOfATouch) {
  std::mt19937 random(6);
  for (const int count : {4, 6, 13}) {
    const double nu = 3 * count - 6;
    std::vector<double> squared;
    for (int draw = 0; draw < kDraws; ++draw) {
      const SimulatedMarkers truth(random, count, kSigma_mm);
      const MarkerRegistration registration = register_markers(truth.pairs);
      const auto error = truth.error_of(registration.T_world_em, registration.quality.centre_world_mm);
      squared.push_back(error.dot(registration.quality.covariance.inverse() * error));
    }
    std::vector<double> tails;
    std::vector<double> limits;
    for (const double level : kLevels) {
      limits.push_back(chi_square_quantile(level, 6));
      tails.push_back(f_tail(limits.back() * nu / (nu - 2) / 6, 6, nu));
    }
    expect_coverage(squared, tails, limits);
  }
}

TEST(MarkerRegistration, ASoundMarkerIsCalledUnlikelyAsOftenAsTheLevelSays) {
  std::mt19937 random(7);
  for (const auto& fle_mm : {std::optional<double>(), std::optional<double>(kFle_mm)}) {
    int unlikely = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const SimulatedMarkers truth(random, count_of(draw), kSigma_mm);
      unlikely += leave_one_out(truth.pairs, fle_mm).front().p_value < 0.05 ? 1 : 0;
    }
    EXPECT_NEAR(unlikely, 0.05 * kDraws, kSigmas * std::sqrt(0.05 * 0.95 * kDraws));
  }
}

TEST(MarkerRegistration, TheErrorOfAMarkerLeftOutIsThatOfTheOthers) {
  std::mt19937 random(8);
  SimulatedMarkers truth(random, 6, 0);
  truth.pairs.p_em_mm.col(2) += Eigen::Vector3d(0, 3, 4);

  const auto left_out = leave_one_out(truth.pairs);

  EXPECT_NEAR(left_out[2].error_mm, 5, 1e-9);
  EXPECT_LT(left_out[2].p_value, 1e-6);
}

// However far off it is: the set does not lie on a line because one marker makes every turn look unknown.
TEST(MarkerRegistration, AMarkerFarOffIsNamedAsAnOutlier) {
  for (const double off_mm : {10.0, 25.0, 60.0}) {
    std::mt19937 random(21);
    SimulatedMarkers simulated(random, 7, 0.5);
    simulated.pairs.p_em_mm.col(3) += off_mm * Eigen::Vector3d(0.6, -0.64, 0.48);
    const JudgedRegistration judged = judge_registration(simulated.pairs, std::nullopt);
    EXPECT_EQ(judged.outliers, std::vector<std::size_t>{3}) << off_mm;
    ASSERT_EQ(worst(judged.findings), ReportVerdict::kBad) << off_mm;
    EXPECT_EQ(judged.findings.back().evidence.rfind("M4 lies", 0), 0U) << judged.findings.back().evidence;
  }
}

TEST(MarkerRegistration, MarkersNearlyOnOneLineAreRefused) {
  std::mt19937 random(22);
  SimulatedMarkers simulated(random, 6, 0.5);
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector3d p_world_mm(40.0 * i, 0.3 * (i % 2), 0.2 * (i % 3));
    simulated.pairs.p_world_mm.col(i) = p_world_mm;
    simulated.pairs.p_em_mm.col(i) = simulated.T_world_em.inverse() * p_world_mm + normal_vector(random, 0.5);
  }
  EXPECT_THROW((void)judge_registration(simulated.pairs, std::nullopt), MarkerFileError);
}

TEST(MarkerRegistration, ThreeMarkersAreEnoughAndTwoAreNot) {
  std::mt19937 random(9);
  const SimulatedMarkers truth(random, 3, 0);

  EXPECT_TRUE(register_markers(truth.pairs).T_world_em.isApprox(truth.T_world_em, 1e-9));
  EXPECT_THROW(register_markers(truth.pairs.without(0)), MarkerFileError);
}

}  // namespace
}  // namespace tubed
