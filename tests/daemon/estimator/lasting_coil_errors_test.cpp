// How what is known of coils' errors ages, against closed forms.
#include "daemon/estimator/coils/lasting_coil_errors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cstdlib>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr int kCoils = 5;
constexpr Eigen::Index kSize = 3 * kCoils;

/// Errors of five coils on the arc, of which something is known, and which then age while the tube is still.
struct AgingErrors {
  AgingErrors() {
    const UniformCubicBSpline& spline = map.spline();
    for (int i = 0; i < spline.coefficient_count(); ++i)
      tube.C.col(i) = arc_point((i - 1) * spline.spacing_mm());
    errors.begin();
    errors.place(instrument, spline, tube.C);
    tube.P.setZero();
  }
  void age(double dt_s) { errors.age(dt_s, instrument, map, tube, scratch); }

  [[nodiscard]] Eigen::Index first() const { return 3 * Eigen::Index{map.columns().position_error(0)}; }
  auto covariance() { return tube.P.block(first(), first(), kSize, kSize); }
  Eigen::Map<Eigen::VectorXd> mean() { return {tube.m.data() + first(), kSize}; }
  [[nodiscard]] double prior_variance() const { return errors.position_mm() * errors.position_mm(); }

  InstrumentDescription instrument = one_view_room().instruments.front();
  EstimatorSettings settings;
  TubeMap map{settings, 380, kCoils, 1};
  TubeGaussian tube{map.columns().count()};
  LastingCoilErrors errors{settings};
  Eigen::MatrixXd scratch = tube.P;
};

/// One millimetre to one side of all coils, or of the first against the third of five.
Eigen::VectorXd shift() {
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(kSize);
  for (Eigen::Index i = 2; i < kSize; i += 3) errors[i] = 1;
  return errors;
}
Eigen::VectorXd bend() {  // of three neighbours: no shift, and along the depth hardly a turn
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(kSize);
  errors[2] = errors[8] = 1;
  errors[5] = -2;
  return errors;
}

TEST(LastingCoilErrors, OfWhichNothingIsKnownStayUnknown) {
  AgingErrors aging;
  aging.covariance().diagonal().setConstant(aging.prior_variance());
  aging.age(7);
  EXPECT_LT((aging.covariance() - aging.prior_variance() * Eigen::MatrixXd::Identity(kSize, kSize))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
}

TEST(LastingCoilErrors, AllSharedIsKnownForMinutesAndACoilsOwnFades) {
  AgingErrors aging;
  aging.mean() = shift();
  aging.age(60);
  const double kept_shift = aging.mean().dot(shift()) / shift().squaredNorm();
  EXPECT_GT(kept_shift, 0.85);
  EXPECT_LT((aging.mean() - kept_shift * shift()).norm(), 1e-9);
  aging.mean() = bend();
  aging.age(60);
  EXPECT_LT(aging.mean().dot(bend()) / bend().squaredNorm(), 0.3);
}

// Of x' = k x + noise with the stationary variance s^2: (1 - k^2) s^2.
TEST(LastingCoilErrors, AreDoubtedAsMuchAsTheyFade) {
  AgingErrors aging;
  aging.mean() = shift();
  aging.age(60);
  const double kept = aging.mean().dot(shift()) / shift().squaredNorm();
  const Eigen::VectorXd unit = shift().normalized();
  EXPECT_NEAR(unit.dot(aging.covariance() * unit), (1 - kept * kept) * aging.prior_variance(), 1e-12);
}

TEST(LastingCoilErrors, StayPartOfOneCovariance) {
  AgingErrors aging;
  std::srand(7);
  const Eigen::Index size = aging.tube.P.cols();
  const Eigen::MatrixXd root = 0.1 * Eigen::MatrixXd::Random(size, size);
  aging.tube.P = root * root.transpose();
  const Eigen::MatrixXd before = aging.tube.P;
  aging.age(5);
  EXPECT_LT((aging.tube.P - aging.tube.P.transpose()).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(aging.tube.P).eigenvalues().minCoeff(), -1e-12);
  // The same matrix that ages the mean ages what errors have to do with the shape.
  aging.mean() = before.block(aging.first(), 4, kSize, 1);
  AgingErrors same;
  same.mean() = aging.mean();
  same.age(5);
  EXPECT_LT((aging.tube.P.block(aging.first(), 4, kSize, 1) - same.mean()).norm(), 1e-12);
  EXPECT_EQ(aging.tube.P.topLeftCorner(aging.first(), aging.first()),
            before.topLeftCorner(aging.first(), aging.first()));
}

}  // namespace
}  // namespace tubed
