#include "daemon/image/predicted_lines.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "tests/daemon/image/camera_above.hpp"

namespace tubed {
namespace {

constexpr double kLength_mm = 100;
constexpr int kCoefficients = 8;

/// A slightly bent tube that runs across the view and into depth.
Eigen::Matrix3Xd bent_tube() {
  Eigen::Matrix3Xd C(3, kCoefficients);
  for (Eigen::Index i = 0; i < C.cols(); ++i) {
    const auto k = static_cast<double>(i);
    C.col(i) = Eigen::Vector3d(k * k - 20, -60 + 18 * k, 4 * k);
  }
  return C;
}

struct Bench {
  UniformCubicBSpline spline{kCoefficients, kLength_mm};
  LineLayout layout{kLength_mm};
  std::unique_ptr<CorrespondenceLines> lines = std::make_unique<CorrespondenceLines>();
  Eigen::Matrix3Xd C = bent_tube();

  Bench() { project_lines(camera_above(), spline, C, layout, 1, *lines); }
};

TEST(PredictedLines, AreExpectedWhereThePredictionCrossesThem) {
  Bench bench;
  Eigen::Matrix3Xd predicted = bench.C;
  predicted.row(0).array() += 3;  // mm
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(3 * kCoefficients, 3 * kCoefficients);
  predict_lines(camera_above(), bench.spline, {&predicted, &covariance}, bench.layout, *bench.lines);
  for (int i = 0; i < bench.layout.count; ++i) {
    const CorrespondenceLine& line = (*bench.lines)[static_cast<std::size_t>(i)];
    ASSERT_TRUE(line.in_view) << i;
    // About 2 px a mm; the tube's depth of at most 32 mm changes that by 3 %.
    EXPECT_NEAR(line.expected_px, 6 * line.normal.x(), 0.3 * std::abs(line.normal.x())) << i;
    EXPECT_GT(line.expected_variance_px2, 0) << i;
  }
}

// Against the scatter of curves drawn from the prediction.
TEST(PredictedLines, ExpectTheScatterOfThePrediction) {
  Bench bench;
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  Eigen::MatrixXd root(3 * kCoefficients, 3 * kCoefficients);
  for (double& value : root.reshaped()) value = 0.15 * normal(random);
  const Eigen::MatrixXd covariance = root * root.transpose();
  predict_lines(camera_above(), bench.spline, {&bench.C, &covariance}, bench.layout, *bench.lines);
  const auto drawn = std::make_unique<CorrespondenceLines>(*bench.lines);
  std::array<double, kMaxCorrespondenceLines> sum{};
  constexpr int kDraws = 4000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd way =
        root * Eigen::VectorXd::NullaryExpr(3 * kCoefficients, [&] { return normal(random); });
    Eigen::Matrix3Xd C = bench.C;
    C.reshaped() += way;
    predict_lines(camera_above(), bench.spline, {&C, &covariance}, bench.layout, *drawn);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += (*drawn)[i].expected_px * (*drawn)[i].expected_px;
  }
  for (int i = 0; i < bench.layout.count; i += 5) {
    const auto index = static_cast<std::size_t>(i);
    const double expected = (*bench.lines)[index].expected_variance_px2;
    EXPECT_NEAR(sum[index] / kDraws, expected, 0.1 * expected) << i;
  }
}

TEST(PredictedLines, OutOfViewNothingIsExpected) {
  Bench bench;
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(3 * kCoefficients, 3 * kCoefficients);
  (*bench.lines)[3].in_view = false;
  predict_lines(camera_above(), bench.spline, {&bench.C, &covariance}, bench.layout, *bench.lines);
  EXPECT_EQ((*bench.lines)[3].expected_variance_px2, 0);
  Eigen::Matrix3Xd behind = bench.C;
  behind.row(2).array() -= 2000;  // behind the source
  predict_lines(camera_above(), bench.spline, {&behind, &covariance}, bench.layout, *bench.lines);
  EXPECT_EQ((*bench.lines)[4].expected_variance_px2, 0);
}

TEST(PredictedLines, ANewProjectionHasNoPredictionYet) {
  Bench bench;
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(3 * kCoefficients, 3 * kCoefficients);
  predict_lines(camera_above(), bench.spline, {&bench.C, &covariance}, bench.layout, *bench.lines);
  ASSERT_GT((*bench.lines)[5].expected_variance_px2, 0);
  project_lines(camera_above(), bench.spline, bench.C, bench.layout, 1, *bench.lines);
  EXPECT_EQ((*bench.lines)[5].expected_variance_px2, 0);
}

}  // namespace
}  // namespace tubed
