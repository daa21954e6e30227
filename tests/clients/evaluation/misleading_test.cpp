#include "clients/evaluation/misleading.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/evaluation_report.hpp"

namespace tubed {
namespace {

/// Along x at a depth of 500 mm, a point each mm from the tip to `length_mm`.
SampledCentreline line(double length_mm, const Eigen::Vector3d& off_mm = {0, 0, 0}) {
  SampledCentreline line;
  const auto count = static_cast<Eigen::Index>(length_mm) + 1;
  line.p_world_mm.resize(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    line.s_mm.push_back(static_cast<double>(i));
    line.p_world_mm.col(i) = Eigen::Vector3d(static_cast<double>(i), 0, 500) + off_mm;
  }
  return line;
}

/// An estimate that is `off_mm` off that line, all of its points with one covariance.
EstimatedShape estimate_with(const Eigen::Vector3d& off_mm, const Eigen::Matrix3d& covariance_mm2) {
  EstimatedShape shape;
  shape.centreline = line(100, off_mm);
  const Eigen::Matrix3d& c = covariance_mm2;
  Eigen::Matrix<double, 6, 1> six;
  six << c(0, 0), c(0, 1), c(0, 2), c(1, 1), c(1, 2), c(2, 2);
  shape.covariance_world_mm2 = six.replicate(1, shape.centreline.p_world_mm.cols());
  shape.sigma_world_mm = c.diagonal().cwiseSqrt().replicate(1, shape.centreline.p_world_mm.cols());
  shape.validity = Validity::kValid;
  return shape;
}

EstimatedShape estimate(const Eigen::Vector3d& off_mm, const Eigen::Vector3d& sigma_mm) {
  return estimate_with(off_mm, Eigen::Matrix3d(sigma_mm.cwiseAbs2().asDiagonal()));
}

/// Sees x from -50 to 50 mm at that depth.
Camera camera() {
  return Camera(
      CameraCalibration{.name = "A", .width = 101, .height = 101, .fx = 500, .fy = 500, .cx = 50, .cy = 50});
}

std::size_t misleading(const EstimatedShape& shape, PointMatch match = PointMatch::kNearest,
                       JudgedPart part = JudgedPart::kAll, double s_max_mm = 90) {
  return misleading_points(shape, line(100), camera(), {s_max_mm, match, part}).value().misleading;
}

TEST(Misleading, IsWhatIsOffByMoreThanThreeMillimetresAndMoreThanThreeSigmas) {
  EXPECT_EQ(misleading(estimate({0, 4, 0}, {9, 1.34, 9})), 0U);    // 2.985 sigma
  EXPECT_EQ(misleading(estimate({0, 4, 0}, {9, 1.33, 9})), 182U);  // 3.008: 91 true and 91 estimated points
  EXPECT_EQ(misleading(estimate({0, 2.99, 0}, {9, 0, 9})), 0U);
  EXPECT_EQ(misleading(estimate({0, 3.01, 0}, {9, 0, 9})), 182U);
}

TEST(Misleading, TheSigmaIsThatOfTheErrorsDirection) {
  // Sure along (0, 1, 1), to 1 mm, and not across, to 10 mm. On each axis alone sigma is 7.1 mm.
  const Eigen::Vector3d sure = Eigen::Vector3d(0, 1, 1).normalized();
  const Eigen::Vector3d unsure = Eigen::Vector3d(0, 1, -1).normalized();
  const Eigen::Matrix3d covariance_mm2 =
      Eigen::Vector3d(100, 0, 0).asDiagonal() * Eigen::Matrix3d::Identity() + sure * sure.transpose() +
      100 * unsure * unsure.transpose();
  EXPECT_EQ(misleading(estimate_with(3.1 * sure, covariance_mm2)), 182U);
  EXPECT_EQ(misleading(estimate_with(29 * unsure, covariance_mm2)), 0U);
  EXPECT_EQ(misleading(estimate_with(31 * unsure, covariance_mm2)), 182U);
}

TEST(Misleading, SlidingAlongTheCatheterCountsWhereTheTipIsTooLongOrTooShort) {
  // 5 mm too long: estimated points 0 and 1 are 5 and 4 mm before the true tip, point 2 is 3.
  EXPECT_EQ(misleading(estimate({-5, 0, 0}, {1, 1, 1})), 2U);
  EXPECT_EQ(misleading(estimate({-5, 0, 0}, {1.5, 1, 1})), 1U) << "4.5 mm: beyond is the first alone";
  EXPECT_EQ(misleading(estimate({5, 0, 0}, {1, 1, 1})), 2U) << "true points 0 and 1";
  EXPECT_EQ(misleading(estimate({5, 0, 0}, {1, 1, 1}), PointMatch::kArcLength), 91U);
  EXPECT_EQ(misleading(estimate({5, 0, 0}, {2, 1, 1}), PointMatch::kArcLength), 0U);
}

TEST(Misleading, OnlyPointsInViewAreJudgedWhereThatIsAsked) {
  EstimatedShape shape = estimate({0, 4, 0}, {1, 1, 1});
  // Of either curve the points at x = 0 .. 50.
  EXPECT_EQ(misleading(shape, PointMatch::kNearest, JudgedPart::kInView), 102U);
  shape.covariance_world_mm2.leftCols(51).setConstant(1e4);
  EXPECT_EQ(misleading(shape, PointMatch::kNearest, JudgedPart::kInView), 0U);
  EXPECT_EQ(misleading(shape, PointMatch::kNearest, JudgedPart::kAll), 80U);
  EXPECT_EQ(misleading(shape, PointMatch::kNearest, JudgedPart::kAll, 60), 20U) << "s_max";
}

TEST(Misleading, IsNotKnownWithoutCovariancesOrPoints) {
  EstimatedShape shape = estimate({0, 4, 0}, {1, 1, 1});
  EXPECT_EQ(misleading_points(shape, line(100), camera(), {})->max_mm, 4);
  EXPECT_FALSE(misleading_points(shape, line(0), camera(), {}));
  shape.covariance_world_mm2.resize(6, 0);
  EXPECT_FALSE(misleading_points(shape, line(100), camera(), {}));
  shape = estimate({0, 100, 0}, {1, 1, 1});
  EXPECT_TRUE(misleading_points(shape, line(100), camera(), {90, PointMatch::kNearest, JudgedPart::kInView}))
      << "the true points are in view";
}

TEST(Misleading, InstantsAreCountedByValidity) {
  EstimatedShape questionable = estimate({0, 4, 0}, {1, 1, 1});
  questionable.validity = Validity::kQuestionable;
  const TrueRun run{{camera()},
                    {{7, line(100), 0}, {8, line(100), 0}, {9, line(100), 0}, {10, line(100), 0}}};
  const Estimates estimates{{7, estimate({0, 4, 0}, {1, 1, 1})},
                            {8, estimate({0, 1, 0}, {0, 0, 0})},
                            {9, questionable},
                            {10, EstimatedShape{}}};
  const MethodEvaluation evaluation = evaluate_method(run, estimates, {});
  EXPECT_EQ(evaluation.misleading.at(Validity::kValid).instants, 2U);
  EXPECT_EQ(evaluation.misleading.at(Validity::kValid).misleading, 1U);
  EXPECT_EQ(total_of(evaluation.misleading).instants, 3U);
  EXPECT_EQ(total_of(evaluation.misleading).misleading, 2U);
  EvaluationReport report;
  report.fused = evaluation;
  std::ostringstream words;
  print_report(report, words);
  EXPECT_NE(words.str().find("1 of 2 VALID instants (50.0 %), 2 of all 3 (66.7 %)"), std::string::npos)
      << words.str();
}

TEST(Misleading, AShapeOfThePublishedSampleHasItsCovariancesBetweenItsPoints) {
  TubeEstimate sample;
  sample.validity = Validity::kQuestionable;
  sample.point_count = 2;
  sample.coefficient_count = 4;
  sample.length_mm = 2;
  sample.points[0].covariance_mm2 = {4, 1, 2, 9, 3, 16};
  sample.points[1].covariance_mm2 = {6, 3, 4, 11, 5, 18};
  const EstimatedShape shape = shape_of(sample);
  ASSERT_EQ(shape.centreline.s_mm, (std::vector<double>{0, 1, 2}));
  Eigen::Matrix<double, 6, 1> middle;
  middle << 5, 2, 3, 10, 4, 17;
  EXPECT_EQ(shape.covariance_world_mm2.col(1), middle);
  EXPECT_DOUBLE_EQ(shape.sigma_world_mm(2, 1), std::sqrt(17));
  EXPECT_EQ(shape.validity, Validity::kQuestionable);
}

TEST(Misleading, CovariancesGoThroughTheFileOfEstimatesAndMayBeMissingThere) {
  TubeEstimate sample;
  sample.validity = Validity::kValid;
  sample.point_count = 2;
  sample.coefficient_count = 4;
  sample.length_mm = 2;
  sample.points[0].covariance_mm2 = sample.points[1].covariance_mm2 = {4, 0.123456F, -2, 9, 3, 16};
  sample.points[1].held_by = kHeldByImage;
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "covariances.csv";
  std::ofstream out(file);
  write_estimate_header(out);
  write_estimate_rows(out, 7, sample);
  write_estimate_rows(out, 8, TubeEstimate{});
  out.close();
  const Estimates estimates = read_estimates(file);
  EXPECT_TRUE(estimates.at(7).covariance_world_mm2.isApprox(shape_of(sample).covariance_world_mm2, 1e-6));
  EXPECT_EQ(estimates.at(7).held_by, (std::vector<std::uint32_t>{0, kHeldByImage, kHeldByImage}));
  EXPECT_TRUE(estimates.at(8).centreline.s_mm.empty());
  std::ofstream(file)
      << "frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity,cov_xx\n7,0,1,2,3,1,1,1,VALID,1\n";
  EXPECT_EQ(read_estimates(file).at(7).covariance_world_mm2.cols(), 0);
  EXPECT_TRUE(read_estimates(file).at(7).held_by.empty());
}

// As mode "paper" has it: the shape is judged, and nothing is said of a sigma that is none.
TEST(Misleading, AnUnknownSigmaGoesThroughTheFileAndCoversNothing) {
  TubeEstimate sample;
  sample.validity = Validity::kValid;
  sample.point_count = 2;
  sample.coefficient_count = 4;
  sample.length_mm = 2;
  for (int i = 0; i < 2; ++i) {
    sample.points[static_cast<std::size_t>(i)].covariance_mm2.fill(std::numeric_limits<float>::infinity());
  }
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "unknown.csv";
  std::ofstream out(file);
  write_estimate_header(out);
  write_estimate_rows(out, 7, sample);
  out.close();

  const EstimatedShape shape = read_estimates(file).at(7);
  EXPECT_EQ(shape.sigma_world_mm, Eigen::Matrix3Xd::Constant(3, 3, std::numeric_limits<double>::infinity()));

  SampledCentreline truth = shape.centreline;
  truth.p_world_mm.row(1).array() += 50;
  const TrueRun run{{Camera(CameraCalibration{})}, {{7, truth, 0}}};
  const MethodEvaluation evaluation = evaluate_method(run, {{7, shape}}, {});
  EXPECT_EQ(evaluation.coverage.coordinate_count, 0U);
  EXPECT_FALSE(evaluation.tip_sigmas.front());
  EXPECT_TRUE(evaluation.misleading.empty());
}

}  // namespace
}  // namespace tubed
