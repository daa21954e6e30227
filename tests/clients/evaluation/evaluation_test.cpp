#include "clients/evaluation/evaluation.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace tubed {
namespace {

/// Straight to 100 mm from the tip; only where it begins it is off.
SampledCentreline line(double from_mm, const Eigen::Vector3d& off_mm) {
  SampledCentreline line{{from_mm, 100}, Eigen::Matrix3Xd(3, 2)};
  line.p_world_mm.col(0) = Eigen::Vector3d(from_mm, 0, 500) + off_mm;
  line.p_world_mm.col(1) = Eigen::Vector3d(100, 0, 500);
  return line;
}

/// Of an estimate that is so far off a straight tube and knows it to `sigma_mm` at its tip.
std::optional<double> tip_sigmas(const Eigen::Vector3d& off_mm, const Eigen::Vector3d& sigma_mm,
                                 double from_mm = 0) {
  const CameraCalibration camera{
      .name = "A", .width = 101, .height = 101, .fx = 100, .fy = 100, .cx = 50, .cy = 50};
  const TrueRun run{{Camera(camera)}, {{7, line(0, {0, 0, 0}), 0}}};
  EstimatedShape shape{line(from_mm, off_mm), Eigen::Matrix3Xd::Constant(3, 2, 1000), Validity::kValid};
  shape.sigma_world_mm.col(0) = sigma_mm;
  return evaluate_method(run, {{7, shape}}, {}).tip_sigmas.front();
}

TEST(TipSigmas, AreThoseOfTheWorstAxisAtTheTip) {
  EXPECT_NEAR(tip_sigmas({3, -4, 2}, {3, 2, 4}).value(), 2, 1e-12);
  EXPECT_NEAR(tip_sigmas({3, -4, 12}, {3, 2, 4}).value(), 3, 1e-12);
}

TEST(TipSigmas, OfAnEstimateThatBeginsLaterAreThoseOfItsFirstPoint) {
  EXPECT_NEAR(tip_sigmas({0, 6, 0}, {3, 2, 4}, 5).value(), 3, 1e-12);
}

TEST(TipSigmas, OfWhatIsRightAreNoneAndOfWhatIsSureAndWrongInfinitelyMany) {
  EXPECT_EQ(tip_sigmas({0, 0, 0}, {0, 0, 0}), 0);
  EXPECT_EQ(tip_sigmas({0, 1, 0}, {0, 0, 0}), std::numeric_limits<double>::infinity());
}

TEST(TipSigmas, AreNotThereWithoutAnEstimate) {
  const TrueRun run{{Camera(CameraCalibration{})}, {{7, line(0, {0, 0, 0}), 0}}};
  const MethodEvaluation nothing = evaluate_method(run, {}, {});
  ASSERT_EQ(nothing.tip_sigmas.size(), 1U);
  EXPECT_FALSE(nothing.tip_sigmas.front());
}

}  // namespace
}  // namespace tubed
