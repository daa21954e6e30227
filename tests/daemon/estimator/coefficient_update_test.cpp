// Images' update of a Gaussian with columns that images do not see, against the same with all matrices whole.
#include "daemon/estimator/images/coefficient_update.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cstdlib>
#include <span>
#include <vector>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr int kFurther = 4;

/// A tube near the arc of which the coefficients and what stands behind them are correlated.
struct CoefficientBench {
  CoefficientBench()
      : tube(EstimatorSettings{}.coefficient_count + kFurther),
        update(EstimatorSettings{}, one_view_room().instruments.front(),
               EstimatorSettings{}.coefficient_count + kFurther),
        bending(Eigen::VectorXd::Ones(update.map().bending_node_count())) {
    std::srand(5);
    const Eigen::Index n = EstimatorSettings{}.coefficient_count;
    for (Eigen::Index i = 0; i < n; ++i) {
      tube.C.col(i) = arc_point(static_cast<double>(i - 1) * update.map().spline().spacing_mm());
    }
    const Eigen::MatrixXd A = Eigen::MatrixXd::Random(tube.P.rows(), tube.P.rows());
    tube.P = 0.02 * (A * A.transpose() + Eigen::MatrixXd::Identity(tube.P.rows(), tube.P.rows()));
    tube.m = tube.C + 0.3 * Eigen::Matrix3Xd::Random(3, tube.C.cols());
  }

  /// A line every 20 mm that wants the tube 1 px to the side of the arc.
  std::span<const ViewConstraints> lines() {
    const UniformCubicBSpline& spline = update.map().spline();
    for (double s_mm = 20; s_mm < 200; s_mm += 20) {
      LineConstraint line;
      line.s_mm = s_mm;
      line.normal = Eigen::Vector2d::UnitX();
      const CubicBasis basis = spline.basis(s_mm);
      line.target_px =
          camera.project(combine(tube.C, basis.first, basis.value))->p_image_px + Eigen::Vector2d(1, 0);
      line.variance_px2 = 0.25;
      constraints.push_back(line);
    }
    view = ViewConstraints{&camera, constraints.data(), static_cast<int>(constraints.size())};
    return {&view, 1};
  }

  TubeGaussian tube;
  CoefficientUpdate update;
  Eigen::VectorXd bending;
  Camera camera{one_view_room().cameras.front()};
  std::vector<LineConstraint> constraints;
  ViewConstraints view;
};

// With G = P_ec P_cc^-1: e+ = e + G (c+ - c), P_ec+ = G P_cc+, P_ee+ = P_ee - G (P_cc - P_cc+) G^T.
TEST(CoefficientUpdate, FurtherColumnsFollowAsTheirCovarianceSays) {
  CoefficientBench bench;
  const TubeGaussian before = bench.tube;
  const Eigen::Index n = 3 * EstimatorSettings{}.coefficient_count;
  const Eigen::MatrixXd P_cc = before.P.topLeftCorner(n, n);
  const Eigen::MatrixXd G = P_cc.llt().solve(before.P.topRightCorner(n, 3 * kFurther)).transpose();
  ASSERT_TRUE(bench.update.begin(bench.tube, bench.bending, bench.tube.C));
  const auto lines = bench.lines();
  bench.update.refine(lines);

  ASSERT_TRUE(bench.update.take(lines, bench.tube));

  const Eigen::MatrixXd P_cc_new = bench.tube.P.topLeftCorner(n, n);
  EXPECT_LT(P_cc_new.trace(), 0.99 * P_cc.trace());  // it did something
  const Eigen::VectorXd way = (bench.tube.m - before.m).reshaped();
  EXPECT_LT((way.tail(3 * kFurther) - G * way.head(n)).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((bench.tube.P.bottomLeftCorner(3 * kFurther, n) - G * P_cc_new).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LT((bench.tube.P.bottomRightCorner(3 * kFurther, 3 * kFurther) -
             (before.P.bottomRightCorner(3 * kFurther, 3 * kFurther) - G * (P_cc - P_cc_new) * G.transpose()))
                .cwiseAbs()
                .maxCoeff(),
            1e-8);
  EXPECT_LT((bench.tube.P - bench.tube.P.transpose()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(CoefficientUpdate, PullIsTheWayFromTheMeanInStandardDeviations) {
  CoefficientBench bench;
  const Eigen::Index n = 3 * EstimatorSettings{}.coefficient_count;
  ASSERT_TRUE(bench.update.begin(bench.tube, bench.bending, bench.tube.C));
  const Eigen::MatrixXd P_cc = bench.tube.P.topLeftCorner(n, n);
  const Eigen::VectorXd way = (bench.tube.C - bench.tube.m).leftCols(n / 3).reshaped();
  const double expected = way.dot(P_cc.llt().solve(way));
  EXPECT_NEAR(bench.update.pull(bench.tube.C), expected, 1e-6 * expected);
  EXPECT_NEAR(bench.update.expected_pull(bench.tube), 0, 1e-6);  // nothing was taken in
}

TEST(CoefficientUpdate, ACovarianceThatIsNoneIsRefused) {
  CoefficientBench bench;
  bench.tube.P(0, 0) = -1;
  EXPECT_FALSE(bench.update.begin(bench.tube, bench.bending, bench.tube.C));
}

}  // namespace
}  // namespace tubed
