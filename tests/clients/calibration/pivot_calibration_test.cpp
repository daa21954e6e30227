#include "clients/calibration/pivot_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "clients/calibration/tail_probability.hpp"
#include "tests/clients/calibration/simulated_pivot.hpp"

namespace tubed {
namespace {

std::string words_of(const JudgedPivot& judged) {
  std::string words;
  for (const CalibrationFinding& finding : judged.findings)
    words += finding.evidence + "; " + finding.advice + "\n";
  return words;
}

TEST(PivotCalibration, ExactPosesGiveTheTipBack) {
  std::mt19937 random(1);
  PivotMovement movement{.tip_offset_mm = {3, -2, 98}, .sigma_position_mm = 1e-4, .sigma_angle_deg = 1e-5};

  const JudgedPivot judged = calibrate_pivot(movement.poses(random, ProbeFreedom::kSix), ProbeFreedom::kSix);

  EXPECT_EQ(worst(judged.findings), ReportVerdict::kGood) << words_of(judged);
  EXPECT_TRUE(judged.pivot.tip_offset_mm.isApprox(movement.tip_offset_mm, 1e-5));
  EXPECT_TRUE(judged.pivot.pivot_em_mm.isApprox(kPivot_em_mm, 1e-5));
}

/// 300 calibrations: the true tip lies in the covariance's ellipsoid as often as chi-square says, within four
/// standard deviations of the binomial count.
void expect_coverage(const PivotMovement& movement, ProbeFreedom freedom, unsigned seed) {
  constexpr int kDraws = 300;
  std::mt19937 random(seed);
  const int degrees = freedom == ProbeFreedom::kFive ? 1 : 3;
  std::vector<double> squared;
  for (int draw = 0; draw < kDraws; ++draw) {
    const PivotCalibration pivot = calibrate_pivot(movement.poses(random, freedom), freedom).pivot;
    const Eigen::Vector3d error_mm = pivot.tip_offset_mm - movement.tip_offset_mm;
    squared.push_back(degrees == 1 ? error_mm.z() * error_mm.z() / pivot.covariance_mm2(2, 2)
                                   : error_mm.dot(pivot.covariance_mm2.inverse() * error_mm));
  }
  for (const double level : {0.683, 0.954, 0.997}) {
    const double limit = chi_square_quantile(level, degrees);
    const auto inside =
        std::count_if(squared.begin(), squared.end(), [&](double value) { return value <= limit; });
    EXPECT_NEAR(static_cast<double>(inside), kDraws * level, 4 * std::sqrt(kDraws * level * (1 - level)))
        << "level " << level << " seed " << seed;
  }
}

TEST(PivotCalibration, TheCovarianceCoversTheTipOfA5DofProbe) {
  expect_coverage({.count = 200}, ProbeFreedom::kFive, 2);
}

TEST(PivotCalibration, TheCovarianceCoversTheTipOfA6DofProbe) {
  expect_coverage({.tip_offset_mm = {4, -3, 98}, .count = 200}, ProbeFreedom::kSix, 3);
}

/// With directions taken as exact, 2 degrees and a lean of 25 degrees would make the tip too short by
/// |o| s_a^2 / (turn^2 / 2), some millimetres.
TEST(PivotCalibration, DirectionsThatErrDoNotShortenTheTip) {
  std::mt19937 random(4);
  const PivotMovement movement{.lean_deg = 25, .sigma_angle_deg = 2, .count = 4000};

  const PivotCalibration pivot =
      calibrate_pivot(movement.poses(random, ProbeFreedom::kFive), ProbeFreedom::kFive).pivot;

  EXPECT_NEAR(pivot.tip_offset_mm.z(), 98, 4 * pivot.sigma_tip_mm());
  EXPECT_LT(pivot.sigma_tip_mm(), 0.5);
  EXPECT_NEAR(pivot.sigma_angle_rad / kDeg, 2, 0.1);
}

TEST(PivotCalibration, ATipBesideTheAxisOfA5DofProbeShowsInTheResidual) {
  std::mt19937 random(5);
  const PivotMovement movement{
      .tip_offset_mm = {3, 0, 98}, .sigma_position_mm = 0.1, .sigma_angle_deg = 0.05};

  const JudgedPivot judged =
      calibrate_pivot(movement.poses(random, ProbeFreedom::kFive), ProbeFreedom::kFive);

  EXPECT_NEAR(judged.pivot.max_beside_axis_mm(), 3, 0.1);
  EXPECT_EQ(worst(judged.findings), ReportVerdict::kDoubtful);
  EXPECT_NE(words_of(judged).find("beside the axis"), std::string::npos);
}

TEST(PivotCalibration, AProbeThatIsNotTurnedIsRefused) {
  std::mt19937 random(6);
  for (const ProbeFreedom freedom : {ProbeFreedom::kFive, ProbeFreedom::kSix}) {
    const JudgedPivot judged = calibrate_pivot(PivotMovement{.lean_deg = 4}.poses(random, freedom), freedom);
    EXPECT_EQ(worst(judged.findings), ReportVerdict::kBad);
    EXPECT_NE(words_of(judged).find("lean the probe 30 degrees"), std::string::npos) << words_of(judged);
  }
}

TEST(PivotCalibration, A6DofProbeThatIsOnlySpunIsRefused) {
  std::mt19937 random(7);

  const JudgedPivot judged =
      calibrate_pivot(PivotMovement{.lean_deg = 0}.poses(random, ProbeFreedom::kSix), ProbeFreedom::kSix);

  EXPECT_EQ(worst(judged.findings), ReportVerdict::kBad) << words_of(judged);
}

TEST(PivotCalibration, AProbeThatWasLiftedForAWhileIsToldAndLeftOut) {
  std::mt19937 random(8);
  const PivotMovement movement;
  auto poses = movement.poses(random, ProbeFreedom::kFive);
  for (std::size_t i = 100; i < 140; ++i) poses[i].p_em_mm += Eigen::Vector3d(0, 0, 15);

  const JudgedPivot judged = calibrate_pivot(poses, ProbeFreedom::kFive);

  EXPECT_EQ(worst(judged.findings), ReportVerdict::kDoubtful) << words_of(judged);
  EXPECT_NE(words_of(judged).find("at 40 of 400 measurements it was elsewhere, measurements 101 to 140"),
            std::string::npos)
      << words_of(judged);
  EXPECT_NEAR(judged.pivot.tip_offset_mm.z(), 98, 4 * judged.pivot.sigma_tip_mm());
}

TEST(PivotCalibration, ATipThatSlidIntoAnotherHoleIsRefused) {
  std::mt19937 random(9);
  auto poses = PivotMovement{}.poses(random, ProbeFreedom::kFive);
  for (std::size_t i = 0; i < 160; ++i) poses[i].p_em_mm += Eigen::Vector3d(12, 0, 0);

  const JudgedPivot judged = calibrate_pivot(poses, ProbeFreedom::kFive);

  EXPECT_EQ(worst(judged.findings), ReportVerdict::kBad);
  EXPECT_NE(words_of(judged).find("slid or was lifted"), std::string::npos) << words_of(judged);
}

TEST(PivotCalibration, TooFewMeasurementsAreRefused) {
  std::mt19937 random(10);

  const JudgedPivot judged =
      calibrate_pivot(PivotMovement{.count = 29}.poses(random, ProbeFreedom::kFive), ProbeFreedom::kFive);

  EXPECT_EQ(worst(judged.findings), ReportVerdict::kBad);
  EXPECT_NE(words_of(judged).find("29 measurements"), std::string::npos);
}

TEST(PivotCalibration, ATipThatIsNotKnownWellEnoughIsRefused) {
  std::mt19937 random(11);
  const auto poses =
      PivotMovement{.lean_deg = 20, .sigma_position_mm = 3, .count = 60}.poses(random, ProbeFreedom::kFive);

  const JudgedPivot judged = calibrate_pivot(poses, ProbeFreedom::kFive, 0.3);

  EXPECT_EQ(worst(judged.findings), ReportVerdict::kBad);
  EXPECT_NE(words_of(judged).find("more than 0.30 mm"), std::string::npos) << words_of(judged);
}

TEST(PivotCalibration, PositionsInMetresOrInchesAreRefused) {
  for (const double mm_of_unit : {1000.0, 25.4}) {
    std::mt19937 random(12);
    auto poses = PivotMovement{}.poses(random, ProbeFreedom::kFive);
    for (ProbePose& pose : poses) pose.p_em_mm /= mm_of_unit;
    const JudgedPivot judged = calibrate_pivot(poses, ProbeFreedom::kFive, 0.5);
    EXPECT_EQ(worst(judged.findings), ReportVerdict::kBad) << mm_of_unit;
    EXPECT_NE(words_of(judged).find("write them in mm"), std::string::npos) << words_of(judged);
  }
}

TEST(PivotCalibration, ADirectionAwayFromTheTipIsTold) {
  std::mt19937 random(13);
  auto poses = PivotMovement{}.poses(random, ProbeFreedom::kFive);
  for (ProbePose& pose : poses) pose.q_em_probe = rotation_from_z_to(-pose.axis_em());
  const JudgedPivot judged = calibrate_pivot(poses, ProbeFreedom::kFive, 0.5);
  EXPECT_EQ(worst(judged.findings), ReportVerdict::kDoubtful);
  EXPECT_NE(words_of(judged).find("points away from the tip"), std::string::npos) << words_of(judged);
}

TEST(PivotCalibration, ASoundMeasurementIsHardlyEverCalledAnOutlier) {
  // one in a hundred files by Bonferroni; of directions that err beyond positions some more
  std::mt19937 random(12);
  int with_outliers = 0;
  for (int draw = 0; draw < 100; ++draw) {
    const auto poses = PivotMovement{.sigma_angle_deg = 0, .count = 200}.poses(random, ProbeFreedom::kFive);
    with_outliers += calibrate_pivot(poses, ProbeFreedom::kFive).pivot.outliers.empty() ? 0 : 1;
  }
  EXPECT_LE(with_outliers, 1 + 4 * std::sqrt(0.99));
}

}  // namespace
}  // namespace tubed
