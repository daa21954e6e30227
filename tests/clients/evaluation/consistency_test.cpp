#include "clients/evaluation/consistency.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

constexpr std::size_t kAcross = 0;
constexpr std::size_t kAlong = 1;
constexpr std::size_t kDepth = 2;

/// Along x at a depth of 500 mm, a point each mm from the tip to 150 mm, in the middle of the camera's view.
SampledCentreline line(const Eigen::Vector3d& off_mm = {0, 0, 0}) {
  SampledCentreline line;
  line.p_world_mm.resize(3, 151);
  for (Eigen::Index i = 0; i < line.p_world_mm.cols(); ++i) {
    line.s_mm.push_back(static_cast<double>(i));
    line.p_world_mm.col(i) = Eigen::Vector3d(static_cast<double>(i), 0, 500) + off_mm;
  }
  return line;
}

EstimatedShape estimate(const Eigen::Vector3d& off_mm, const Eigen::Vector3d& sigma_mm) {
  EstimatedShape shape;
  shape.centreline = line(off_mm);
  Eigen::Matrix<double, 6, 1> six;
  six << sigma_mm.x() * sigma_mm.x(), 0, 0, sigma_mm.y() * sigma_mm.y(), 0, sigma_mm.z() * sigma_mm.z();
  shape.covariance_world_mm2 = six.replicate(1, shape.centreline.p_world_mm.cols());
  return shape;
}

/// So far away that all rays are parallel to z.
Camera camera() {
  CameraCalibration calibration{
      .name = "A", .width = 100, .height = 100, .fx = 500, .fy = 500, .cx = 50, .cy = 50};
  calibration.T_camera_world.translation() = Eigen::Vector3d(0, 0, 1e7);
  return Camera(calibration);
}

Consistency of(const EstimatedShape& shape, double s_max_mm = 149) {
  Consistency consistency;
  consistency.add(shape, line(), camera(), s_max_mm);
  return consistency;
}

TEST(Consistency, IsTheSquaredErrorOverTheVarianceInEachDirection) {
  const Consistency consistency = of(estimate({3, 1, 0.5}, {1, 2, 5}));
  EXPECT_NEAR(consistency.of(kAlong).mean_of_squares(), 9, 1e-3);
  EXPECT_NEAR(consistency.of(kAcross).mean_of_squares(), 0.25, 1e-3);
  EXPECT_NEAR(consistency.of(kDepth).mean_of_squares(), 0.01, 1e-4);
}

TEST(Consistency, CountsWhatIsBeyondThreeSigma) {
  EXPECT_EQ(of(estimate({0, 2.9, 0}, {1, 1, 1})).of(kAcross).beyond_3_sigma, 0U);
  EXPECT_DOUBLE_EQ(of(estimate({0, 3.1, 0}, {1, 1, 1})).of(kAcross).share_beyond_3_sigma(), 1);
  EXPECT_EQ(of(estimate({0, 3.1, 0}, {1, 1, 1})).of(kDepth).beyond_3_sigma, 0U);
}

TEST(Consistency, IsCountedByStretch) {
  EstimatedShape shape = estimate({0, 0, 0}, {1, 1, 1});
  shape.centreline.p_world_mm.block(1, 0, 1, 30).setConstant(2);  // the tip's 30 mm
  const Consistency consistency = of(shape);
  EXPECT_EQ(consistency.of(0, kAcross).count, 30U);
  EXPECT_EQ(consistency.of(1, kAcross).count, 70U);
  EXPECT_EQ(consistency.of(2, kAcross).count, 50U);
  EXPECT_EQ(consistency.of(3, kAcross).count, 0U);
  EXPECT_GT(consistency.of(0, kAcross).mean_of_squares(), 3);
  EXPECT_NEAR(consistency.of(2, kAcross).mean_of_squares(), 0, 1e-9);
}

TEST(Consistency, EndsWhereTheJudgedPartDoes) {
  EXPECT_EQ(of(estimate({0, 1, 0}, {1, 1, 1}), 49).of(kDepth).count, 50U);
}

TEST(Consistency, SaysNothingOfShapesWithoutCovariances) {
  EstimatedShape shape = estimate({0, 1, 0}, {1, 1, 1});
  shape.covariance_world_mm2.resize(6, 0);
  EXPECT_EQ(of(shape).of(kDepth).count, 0U);
}

// Its image has no side there.
TEST(Consistency, SaysNothingOfATubeThatRunsAlongTheRay) {
  EstimatedShape shape = estimate({0, 1, 0}, {1, 1, 1});
  for (Eigen::Index i = 0; i < shape.centreline.p_world_mm.cols(); ++i) {
    shape.centreline.p_world_mm.col(i) = Eigen::Vector3d(0, 0, static_cast<double>(i));
  }
  EXPECT_EQ(of(shape).of(kDepth).count, 0U);
}

}  // namespace
}  // namespace tubed
