// Is what the filter says of its own errors true? Tubes are drawn from its own model of motion and measured
// with the noise that it is told of; then the squared errors of the shape (NEES) and of what measurements
// bring (NIS) have to be as large as their covariances say: chi-square distributed, in the mean one a degree
// of freedom.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "daemon/estimator/coils/coil_update.hpp"
#include "daemon/estimator/images/coefficient_update.hpp"
#include "daemon/estimator/tube_motion.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kLength_mm = 380;
constexpr double kBetween_s = 0.033;
constexpr double kSigma_mm = 0.8;
constexpr double kSigmaTangent = 0.01;
constexpr double kSigmaLine_px = 0.7;
constexpr int kRuns = 60;
constexpr int kSteps = 12;

/// Mean of chi-square values over their degrees of freedom.
class Consistency {
 public:
  void add(double chi_squared, double degrees_of_freedom) {
    sum_ += chi_squared;
    degrees_of_freedom_ += degrees_of_freedom;
  }
  [[nodiscard]] double ratio() const { return sum_ / degrees_of_freedom_; }
  /// Of the ratio, where values are independent.
  [[nodiscard]] double sigma() const { return std::sqrt(2 / degrees_of_freedom_); }

 private:
  double sum_ = 0;
  double degrees_of_freedom_ = 0;
};

/// A filter, and a tube that was drawn from what the filter knows.
class DrawnTube {
 public:
  /// `noise_factor`: on what the filter is told of the coils' noise.
  explicit DrawnTube(unsigned seed, double noise_factor = 1)
      : map_(EstimatorSettings{}, kLength_mm, 5, TubeMotion::column_count_of_motion(kLength_mm)),
        motion_(map_.spline(), map_.columns().count()),
        tube_(map_.columns().count()),
        coil_update_(5, map_.columns().count()),
        image_update_(EstimatorSettings{}, room_.instruments.front(), map_.columns().count()),
        random_(seed),
        noise_factor_(noise_factor) {
    const Eigen::Index n = map_.spline().coefficient_count();
    tube_.C.setZero();
    for (Eigen::Index i = 0; i < n; ++i) {
      tube_.C.col(i) = arc_point(static_cast<double>(i - 1) * map_.spline().spacing_mm());
    }
    tube_.P.setZero();
    motion_.begin(tube_.C, tube_.P);
    tube_.m = tube_.C;
    for (int coil = 0; coil < 5; ++coil) {
      tube_.P.diagonal().segment<3>(3 * Eigen::Index{map_.columns().position_error(coil)}).setConstant(0.25);
    }
    motion_.predict(0.3, {}, tube_.C, tube_.m, tube_.P);
    truth_ = tube_.m + drawn(tube_.P);
  }

  void move() {
    Eigen::Matrix3Xd same = truth_;
    Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(truth_.size(), truth_.size());
    motion_.predict(kBetween_s, {}, same, truth_, noise);
    truth_ += drawn(noise);
    motion_.predict(kBetween_s, {}, tube_.C, tube_.m, tube_.P);
  }

  void measure_coils(Consistency& nis) {
    CoilObservations coils;
    for (const CoilPlacement& placement : room_.instruments.front().coils) {
      CoilObservation& coil = coils.coils[static_cast<std::size_t>(coils.count)];
      coil.state = CoilState::kUsed;
      coil.s_mm = placement.offset_from_tip_mm;
      const CubicBasis basis = map_.spline().basis(coil.s_mm);
      coil.p_world_mm = point(truth_, coil.s_mm) + truth_.col(map_.columns().position_error(coils.count)) +
                        noise_factor_ * kSigma_mm * normal3();
      coil.tangent_world = (-combine(truth_, basis.first, basis.first_derivative).normalized() +
                            noise_factor_ * kSigmaTangent * normal3())
                               .normalized();
      ++coils.count;
    }
    ASSERT_TRUE(coil_update_.apply(coils, map_, kSigma_mm, kSigmaTangent, tube_.C, tube_.m, tube_.P));
    nis.add(coil_update_.pull().chi_squared, coil_update_.pull().expected);
  }

  void see(Consistency& nis) {
    lines_.clear();
    const Eigen::VectorXd bending = Eigen::VectorXd::Ones(image_update_.map().bending_node_count());
    for (double s_mm = 2; s_mm < 370; s_mm += 4) {
      const auto predicted = camera_.project(point(tube_.C, s_mm));
      const auto true_place = camera_.project(point(truth_, s_mm));
      const CubicBasis basis = map_.spline().basis(s_mm);
      const Eigen::Vector2d along =
          predicted->J_image_world * combine(tube_.C, basis.first, basis.first_derivative);
      LineConstraint line{
          s_mm, {}, Eigen::Vector2d(-along.y(), along.x()).normalized(), kSigmaLine_px * kSigmaLine_px};
      line.target_px = true_place->p_image_px + kSigmaLine_px * normal_(random_) * line.normal;
      lines_.push_back(line);
    }
    const ViewConstraints view{&camera_, lines_.data(), static_cast<int>(lines_.size())};
    ASSERT_TRUE(image_update_.begin(tube_, bending, tube_.C));
    image_update_.refine({&view, 1});
    ASSERT_TRUE(image_update_.take({&view, 1}, tube_));
    tube_.C = tube_.m;
    nis.add(image_update_.pull(tube_.m), image_update_.expected_pull(tube_));
  }

  void add_errors(Consistency& nees) const {
    for (const double s_mm : {10, 60, 120, 190, 260, 330}) {
      const ColumnSum place(map_.spline().basis(s_mm));
      const Eigen::Vector3d error_mm = point(truth_, s_mm) - point(tube_.m, s_mm);
      nees.add(error_mm.dot(tube_.covariance_of(place, place).inverse() * error_mm), 3);
    }
  }

 private:
  [[nodiscard]] Eigen::Vector3d point(const Eigen::Matrix3Xd& C, double s_mm) const {
    const CubicBasis basis = map_.spline().basis(s_mm);
    return combine(C, basis.first, basis.value);
  }
  Eigen::Vector3d normal3() { return {normal_(random_), normal_(random_), normal_(random_)}; }
  Eigen::Matrix3Xd drawn(const Eigen::MatrixXd& covariance) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> parts(covariance);
    Eigen::VectorXd z(covariance.rows());
    for (Eigen::Index i = 0; i < z.size(); ++i) z[i] = normal_(random_);
    z.array() *= parts.eigenvalues().cwiseMax(0).cwiseSqrt().array();
    const Eigen::VectorXd x = parts.eigenvectors() * z;
    return Eigen::Map<const Eigen::Matrix3Xd>(x.data(), 3, x.size() / 3);
  }

  RoomDescription room_ = one_view_room();
  TubeMap map_;
  TubeMotion motion_;
  TubeGaussian tube_;
  CoilUpdate coil_update_;
  CoefficientUpdate image_update_;
  Camera camera_{room_.cameras.front()};
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  double noise_factor_;
  Eigen::Matrix3Xd truth_;
  std::vector<LineConstraint> lines_;
};

/// What drawn tubes say of their filters, all of them followed alike.
struct Followed {
  Consistency coils;   ///< NIS of EM measurements after the first, 5 degrees of freedom a coil
  Consistency images;  ///< how far images pull, over how far they should
  Consistency errors;  ///< NEES of six points at the end
};

/// `images`: one in so many EM measurements comes with an image; 0: none does.
Followed follow(std::size_t images) {
  Followed followed;
  for (unsigned run = 1; run <= kRuns; ++run) {
    DrawnTube tube(run);
    Consistency first;  // its directions turn too far for a linear filter
    for (std::size_t step = 0; step < kSteps; ++step) {
      tube.move();
      tube.measure_coils(step == 0 ? first : followed.coils);
      if (images > 0 && step % images == 0) tube.see(followed.images);
    }
    tube.add_errors(followed.errors);
  }
  return followed;
}

/// Within four standard deviations of one, and what linearising costs.
void expect_consistent(const Consistency& consistency, const char* what) {
  constexpr double kOfLinearising = 0.03;
  EXPECT_NEAR(consistency.ratio(), 1, 4 * consistency.sigma() + kOfLinearising) << what;
}

TEST(FilterConsistency, OfCoilsAlone) {
  const Followed followed = follow(0);
  expect_consistent(followed.coils, "NIS of the coils");
  expect_consistent(followed.errors, "NEES");
}

TEST(FilterConsistency, OfCoilsAndAnImageWithEach) {
  const Followed followed = follow(1);
  expect_consistent(followed.coils, "NIS of the coils");
  expect_consistent(followed.images, "pull of the images");
  expect_consistent(followed.errors, "NEES");
}

TEST(FilterConsistency, OfCoilsAndFewerImages) {
  const Followed followed = follow(4);
  expect_consistent(followed.coils, "NIS of the coils");
  expect_consistent(followed.images, "pull of the images");
  expect_consistent(followed.errors, "NEES");
}

// The test can fail: a filter that believes its coils to be half as noisy as they are is found out.
TEST(FilterConsistency, ASigmaThatIsTooSmallShows) {
  Consistency told;
  for (unsigned run = 1; run <= 5; ++run) {
    DrawnTube tube(run, 2);
    Consistency first;
    for (std::size_t step = 0; step < kSteps; ++step) {
      tube.move();
      tube.measure_coils(step == 0 ? first : told);
    }
  }
  EXPECT_GT(told.ratio(), 1.5);
}

}  // namespace
}  // namespace tubed
