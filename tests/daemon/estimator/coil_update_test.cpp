#include "daemon/estimator/coils/coil_update.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "daemon/estimator/algebra/dense_cholesky.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

/// A state near the arc with correlated uncertainty, and coils measured on it.
struct UpdateBench {
  UpdateBench() : map(EstimatorSettings{}, 380, 5, 1) {
    const Eigen::Index n = map.spline().coefficient_count();
    C = Eigen::Matrix3Xd::Zero(3, map.columns().count());
    for (Eigen::Index i = 0; i < n; ++i) {
      C.col(i) =
          arc_point(static_cast<double>(i - 1) * map.spline().spacing_mm()) + Eigen::Vector3d(1, -2, 3);
    }
    std::srand(7);
    const Eigen::MatrixXd A = Eigen::MatrixXd::Random(C.size(), C.size());
    P = 0.02 * (A * A.transpose() + Eigen::MatrixXd::Identity(C.size(), C.size()));
    m = C + 0.3 * Eigen::Matrix3Xd::Random(3, C.cols());
    const auto history = std::make_unique<EmHistory>();
    const EmFrame frame = measure_coils(room, from_ns(1), 2, 3);
    coils = observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
  }
  RoomDescription room = one_view_room();
  TubeMap map;
  Eigen::Matrix3Xd C;
  Eigen::Matrix3Xd m;
  Eigen::MatrixXd P;
  CoilObservations coils;
};

// Two ways to the same posterior: Kalman's, and normal equations with the prior's information.
TEST(CoilUpdate, IsTheOneOfTheNormalEquations) {
  UpdateBench bench;
  GaussianPrior prior{bench.P, bench.m};
  DenseCholesky cholesky(bench.P.rows());
  cholesky.matrix() = bench.P;
  ASSERT_TRUE(cholesky.factorise() && cholesky.invert(prior.information));
  bench.map.set_coil_noise(1.5, 0.02);
  Eigen::Matrix3Xd mean = bench.m;
  ASSERT_TRUE(bench.map.condense(bench.coils, {}, prior, bench.C, mean));
  const Eigen::MatrixXd covariance = bench.map.coefficient_covariance();

  CoilUpdate update(5, bench.map.columns().count());
  Eigen::Matrix3Xd C = bench.C;
  ASSERT_TRUE(update.apply(bench.coils, bench.map, 1.5, 0.02, C, bench.m, bench.P));

  EXPECT_LT((bench.m - mean).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((bench.P - covariance).cwiseAbs().maxCoeff(), 1e-6);
}

double strain_at(const UpdateBench& bench, const Eigen::Matrix3Xd& C, double s_mm) {
  const CubicBasis basis = bench.map.spline().basis(s_mm);
  return combine(C, basis.first, basis.first_derivative).norm() - 1;
}

// Nothing but the coil's strain is known better than a coefficient's place: a squeezed end opens again.
TEST(CoilUpdate, AMeanThatIsSqueezedAtACoilIsOpened) {
  UpdateBench bench;
  const double s_mm = bench.coils.coils[4].s_mm;
  const CubicBasis basis = bench.map.spline().basis(s_mm);
  const Eigen::Vector3d middle = combine(bench.C, basis.first, basis.value);
  for (int k = 0; k < 4; ++k) {
    auto column = bench.C.col(basis.first + k);
    column = middle + 0.2 * (column - middle);
  }
  ASSERT_LT(strain_at(bench, bench.C, s_mm), -0.6);
  bench.m = bench.C;
  bench.P.setIdentity();
  bench.P *= 25;
  CoilUpdate update(5, bench.map.columns().count());
  for (int measurement = 0; measurement < 5; ++measurement) {
    ASSERT_TRUE(update.apply(bench.coils, bench.map, 1.5, 0.02, bench.C, bench.m, bench.P));
  }
  EXPECT_NEAR(strain_at(bench, bench.C, s_mm), 0, 0.2);
}

/// Variance of zeta' to a side, at s.
double variance_of_derivative(const UpdateBench& bench, double s_mm, const Eigen::Vector3d& side) {
  const CubicBasis basis = bench.map.spline().basis(s_mm);
  double sum = 0;
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      sum += basis.first_derivative[static_cast<std::size_t>(a)] *
             basis.first_derivative[static_cast<std::size_t>(b)] *
             side.dot(bench.P.block<3, 3>(3 * (basis.first + a), 3 * (basis.first + b)) * side);
    }
  }
  return sum;
}

// Where |zeta'| is next to nothing a direction tells next to nothing of the coefficients, though they turn it
// at a touch: linearised there, it would seem to tell all.
TEST(CoilUpdate, ADirectionThatIsAsGoodAsUndefinedLeavesTheShapeOpen) {
  UpdateBench bench;
  const double s_mm = bench.coils.coils[4].s_mm;
  const CubicBasis basis = bench.map.spline().basis(s_mm);
  const Eigen::Vector3d middle = combine(bench.C, basis.first, basis.value);
  const Eigen::Vector3d side = combine(bench.C, basis.first, basis.first_derivative).unitOrthogonal();
  for (int k = 0; k < 4; ++k) {
    auto column = bench.C.col(basis.first + k);
    column = middle + 0.01 * (column - middle);
  }
  bench.m = bench.C;
  bench.P.setIdentity();
  bench.P *= 100;
  CoilUpdate update(5, bench.map.columns().count());
  ASSERT_TRUE(update.apply(bench.coils, bench.map, 1.5, 0.02, bench.C, bench.m, bench.P));
  EXPECT_GT(variance_of_derivative(bench, s_mm, side), 0.05);
}

TEST(CoilUpdate, WithoutACoilChangesNothing) {
  UpdateBench bench;
  for (CoilObservation& coil : bench.coils.coils) {
    coil.state = CoilState::kMissing;
  }
  const Eigen::MatrixXd before = bench.P;
  CoilUpdate update(5, bench.map.columns().count());
  ASSERT_TRUE(update.apply(bench.coils, bench.map, 1.5, 0.02, bench.C, bench.m, bench.P));
  EXPECT_EQ((bench.P - before).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(update.pull().expected, 0);
}

TEST(CoilUpdate, ACovarianceThatIsNoneIsRefused) {
  UpdateBench bench;
  bench.P.diagonal().setConstant(-1e6);
  CoilUpdate update(5, bench.map.columns().count());
  EXPECT_FALSE(update.apply(bench.coils, bench.map, 1.5, 0.02, bench.C, bench.m, bench.P));
}

}  // namespace
}  // namespace tubed
