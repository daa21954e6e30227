#include "daemon/estimator/learnt_bending.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <functional>
#include <memory>
#include <random>

#include "daemon/estimator/estimator.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kLength_mm = 380;
constexpr double kTip_mm = 50;
constexpr double kTipRadius_mm = 33;
constexpr double kOfTheSettings = 0.2;  // weight of the settings beside one shape
constexpr double kStraight = kOfTheSettings / (1 + kOfTheSettings);  // factor of a tube that does not bend

/// A pre-shaped tip on a straight tube, in x-y.
Eigen::Vector3d bent_tip_point(double s_mm) {
  if (s_mm >= kTip_mm) {
    return {s_mm - kTip_mm, 0, 0};
  }
  const double angle = (kTip_mm - s_mm) / kTipRadius_mm;
  return {-kTipRadius_mm * std::sin(angle), kTipRadius_mm * (1 - std::cos(angle)), 0};
}

struct LearntBendingTest : testing::Test {
  /// Linearises at a curve whose coefficients are known with `sigma_mm` an axis.
  void know(const std::function<Eigen::Vector3d(double)>& curve, double sigma_mm) {
    const UniformCubicBSpline& spline = map.spline();
    for (Eigen::Index i = 0; i < C.cols(); ++i) {
      C.col(i) = curve((static_cast<double>(i) - 1) * spline.spacing_mm());
    }
    invert(sigma_mm);
  }
  void invert(double sigma_mm) {
    const GaussianPrior prior{
        Eigen::MatrixXd(Eigen::MatrixXd::Identity(C.size(), C.size()) / (sigma_mm * sigma_mm)), C};
    ASSERT_TRUE(map.invert_at(CoilObservations{}, {}, &prior, C));
  }
  [[nodiscard]] Eigen::VectorXd learn(double interval_s, const Eigen::VectorXd& before) {
    Eigen::VectorXd factors = before;
    LearntBending(map.bending_node_count(), map.spline().spacing_mm()).learn(map, C, interval_s, factors);
    return factors;
  }
  /// Place of a node, nearly.
  [[nodiscard]] double s_mm(Eigen::Index node) const {
    return (static_cast<double>(node) + 0.5) * map.spline().spacing_mm() / 2;
  }

  EstimatorSettings settings;
  TubeMap map{settings, kLength_mm};
  Eigen::Matrix3Xd C{Eigen::Matrix3Xd::Zero(3, settings.coefficient_count)};
  Eigen::VectorXd ones{Eigen::VectorXd::Ones(map.bending_node_count())};
};

TEST_F(LearntBendingTest, APreShapedTipGetsSofterAndTheStraightRestFirmer) {
  know(bent_tip_point, 1e-4);
  const Eigen::VectorXd factors = learn(10, ones);
  const double of_tip = kStraight + map.spline().spacing_mm() / (2 * settings.bending_q_per_mm) /
                                        (kTipRadius_mm * kTipRadius_mm) / (1 + kOfTheSettings);
  for (Eigen::Index i = 0; i < factors.size(); ++i) {
    if (s_mm(i) < kTip_mm - 30) {  // less at the very end, which bends more by itself
      EXPECT_GT(factors[i], 0.6 * of_tip) << s_mm(i);
      EXPECT_LT(factors[i], of_tip) << s_mm(i);
    } else if (s_mm(i) > kTip_mm + 50) {
      EXPECT_NEAR(factors[i], kStraight, 0.01) << s_mm(i);
    }
  }
}

// Curves as the residuals of Eq. (13) expect them: N(0, A^-1) on each axis across the tube, A their matrix.
TEST_F(LearntBendingTest, TubesThatBendAsTheSettingsSayKeepTheSettings) {
  settings.bending_q_per_mm = 1e-8;  // nearly straight, so that two axes are across the tube
  map = TubeMap(settings, kLength_mm);
  const UniformCubicBSpline& spline = map.spline();
  const Eigen::Index n = spline.coefficient_count();
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index segment = 0; segment < n - 3; ++segment) {
    for (const double node : {0.5 - 0.5 / std::sqrt(3.0), 0.5 + 0.5 / std::sqrt(3.0)}) {
      const CubicBasis basis = spline.basis((static_cast<double>(segment) + node) * spline.spacing_mm());
      const Eigen::Vector4d second(basis.second_derivative.data());
      A.block<4, 4>(basis.first, basis.first) +=
          spline.spacing_mm() / 2 / settings.bending_q_per_mm * second * second.transpose();
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> modes(A);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(map.bending_node_count());
  constexpr int kDraws = 300;
  for (int draw = 0; draw < kDraws; ++draw) {
    C.setZero();
    C.row(0).setLinSpaced(-spline.spacing_mm(), kLength_mm + spline.spacing_mm());
    for (Eigen::Index mode = 2; mode < n; ++mode) {  // two are straight lines
      for (const Eigen::Index axis : {1, 2}) {
        C.row(axis) += normal(random) / std::sqrt(modes.eigenvalues()[mode]) *
                       modes.eigenvectors().col(mode).transpose();
      }
    }
    invert(1e-5);
    sum += learn(10, ones);
  }
  for (Eigen::Index i = 0; i < sum.size(); ++i) {
    EXPECT_NEAR(sum[i] / kDraws, 1, 0.2) << s_mm(i);
  }
  EXPECT_NEAR(sum.mean() / kDraws, 1, 0.03);
}

TEST_F(LearntBendingTest, WhereLittleIsKnownTheTubeMayBendMoreThanItSeems) {
  constexpr double kSigma_mm = 0.5;
  know(bent_tip_point, kSigma_mm);
  Eigen::VectorXd expected = ones;
  map.expect_bending(C, expected);
  const Eigen::LLT<Eigen::MatrixXd> root(map.coefficient_covariance());
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 4000;
  TubeMap certain(settings, kLength_mm);
  const GaussianPrior prior{Eigen::MatrixXd::Identity(C.size(), C.size()) * 1e10, C};
  ASSERT_TRUE(certain.invert_at(CoilObservations{}, {}, &prior, C));  // adds nothing to the draws' own bends
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(ones.size());
  Eigen::VectorXd of_draw = ones;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd error =
        root.matrixL() * Eigen::VectorXd::NullaryExpr(C.size(), [&] { return normal(random); });
    certain.expect_bending(C + Eigen::Map<const Eigen::Matrix3Xd>(error.data(), 3, C.cols()), of_draw);
    sum += of_draw;
  }
  for (Eigen::Index i = 0; i < ones.size(); ++i) {
    EXPECT_NEAR(sum[i] / kDraws, expected[i], 0.1 * expected[i]) << s_mm(i);
  }
}

// It would be made softer and softer, or firmer and firmer, by what was made of it before.
TEST_F(LearntBendingTest, WhereNothingIsMeasuredTheSettingsAreWhatIsLeft) {
  for (const double before : {0.1, 1.0, 10.0}) {
    Eigen::VectorXd factors = before * ones;
    for (int shape = 0; shape < 600; ++shape) {  // a minute
      map.set_bending(factors);
      know([](double s_mm) { return Eigen::Vector3d(s_mm, 0, 0); }, 1e3);
      factors = learn(0.1, factors);
    }
    for (Eigen::Index i = 0; i < factors.size(); ++i) {
      EXPECT_NEAR(factors[i], 1, 0.3) << "from " << before << " at " << s_mm(i);
    }
  }
}

TEST_F(LearntBendingTest, OneShapeSaysLittleAndHalfASecondAll) {
  know(bent_tip_point, 1e-4);
  const Eigen::VectorXd all = learn(0.5, ones);
  EXPECT_LT((all - learn(10, ones)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(learn(0, ones), ones);
  const Eigen::VectorXd tenth = learn(0.05, ones);
  EXPECT_LT((tenth - (ones + 0.1 * (all - ones))).cwiseAbs().maxCoeff(), 1e-12);
}

/// Second difference of a tube's first 24 mm: 0 for a straight one.
double bend_of_tip_mm(const std::array<Eigen::Vector3d, 3>& points) {
  return (points[0] - 2 * points[1] + points[2]).norm();
}

/// Of a still tube's shape in the mean over 3 s, after one to settle; coils alone, 40 measurements a second.
double seen_bend_of_tip_mm(EstimatorMode mode) {
  const RoomDescription room = one_view_room();
  EstimatorSettings settings;
  settings.mode = mode;
  const auto estimator = make_estimator(settings, room.instruments.front(), room);
  const auto history = std::make_unique<EmHistory>();
  const auto estimate = std::make_unique<TubeEstimate>();
  std::array<Eigen::Vector3d, 3> sum{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                     Eigen::Vector3d::Zero()};
  constexpr unsigned kSettled = 40;
  constexpr unsigned kMeasurements = 160;
  for (unsigned k = 1; k <= kMeasurements; ++k) {
    const MonotonicTime now = from_ns(10'000'000'000 + k * 25'000'000LL);
    EmFrame frame = measure_coils(room, now, 4, k);
    for (int i = 0; i < frame.coil_count; ++i) {
      const double s_mm = room.instruments.front().coils[static_cast<std::size_t>(i)].offset_from_tip_mm;
      CoilSample& sample = frame.coils[static_cast<std::size_t>(i)];
      sample.p_em_mm += bent_tip_point(s_mm) - arc_point(s_mm);
      sample.tangent_em = (bent_tip_point(s_mm - 1e-4) - bent_tip_point(s_mm + 1e-4)).normalized();
    }
    history->add(frame);
    Observation observation;
    observation.instant = observation.now = now;
    observation.em = history.get();
    estimator->estimate(observation, *estimate);
    if (estimate->point_count < 2) {
      ADD_FAILURE() << "no shape";
      return 0;
    }
    for (std::size_t i = 0; k > kSettled && i < sum.size(); ++i) {
      const double point = 12.0 * static_cast<double>(i * (estimate->point_count - 1)) /
                           static_cast<double>(estimate->length_mm);
      sum[i] += Eigen::Map<const Eigen::Vector3d>(
                    estimate->points[static_cast<std::size_t>(std::lround(point))].p_world_mm.data()) /
                (kMeasurements - kSettled);
    }
  }
  return bend_of_tip_mm(sum);
}

// A single instant cannot learn it, and flattens the bend by 1.7 mm; the filter by 0.7 of that without
// learning it.
TEST(RecursiveEstimator, LearnsThatTheTipIsPreShaped) {
  const double true_mm = bend_of_tip_mm({bent_tip_point(0), bent_tip_point(12), bent_tip_point(24)});
  const double alone_mm = seen_bend_of_tip_mm(EstimatorMode::kEm);
  const double learnt_mm = seen_bend_of_tip_mm(EstimatorMode::kFilter);
  EXPECT_NEAR(learnt_mm, true_mm, 0.62 * std::abs(alone_mm - true_mm)) << alone_mm;
}

}  // namespace
}  // namespace tubed
