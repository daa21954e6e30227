#include "daemon/estimator/agreement/coil_image_model.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <optional>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

/// A straight tube along y, its tip at y = 0, that images show one after another.
class ShownTube {
 public:
  /// Its whole is moved to `at_mm`; `speed_mm_s` along itself is what an estimator would say.
  void show(double later_s, const Eigen::Vector3d& at_mm, std::optional<double> speed_mm_s = std::nullopt) {
    now_ += std::chrono::nanoseconds(static_cast<std::int64_t>(later_s * 1e9));
    Eigen::Matrix3Xd C(3, spline_.coefficient_count());
    for (Eigen::Index i = 0; i < C.cols(); ++i) {
      C.col(i) = at_mm + Eigen::Vector3d(0, static_cast<double>(i - 1) * spline_.spacing_mm(), 0);
    }
    model_.follow({now_, spline_, C, {}, speed_mm_s});
  }

  /// What a late clock does to the first coil, mm a second.
  [[nodiscard]] Eigen::Vector3d velocity_mm_s() const {
    Eigen::Vector3d velocity;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::VectorXd row = Eigen::VectorXd::Zero(model_.unknowns());
      model_.add_shared_errors(0, Eigen::Vector3d::Unit(axis), 1, row);
      velocity[axis] = row[CoilImageModel::kClock];
    }
    return velocity;
  }

 private:
  UniformCubicBSpline spline_{26, 380};
  CoilImageModel model_{one_view_room().instruments.front(), 1};
  MonotonicTime now_ = from_ns(1'000'000'000);
};

void expect_near(const Eigen::Vector3d& velocity_mm_s, const Eigen::Vector3d& expected_mm_s) {
  EXPECT_LT((velocity_mm_s - expected_mm_s).norm(), 1e-6) << velocity_mm_s.transpose();
}

/// At so many images a second, a tube that goes to the side: 20 mm/s, but in the last 0.2 s 10 mm/s back.
ShownTube one_that_turned_back(double rate_per_s) {
  ShownTube tube;
  const double last_s = 2;
  const int images = static_cast<int>(last_s * rate_per_s) + 1;
  for (int i = 0; i < images; ++i) {
    const double to_go_s = static_cast<double>(images - 1 - i) / rate_per_s;
    const double way_mm = to_go_s > 0.2 ? -20 * (to_go_s - 0.2) : -10 * (0.2 - to_go_s);
    tube.show(1 / rate_per_s, {way_mm, 0, 0});
  }
  return tube;
}

TEST(CoilImageModel, VelocityIsThatOfTheShortestTimeInWhichTheTubeHasMoved) {
  for (const double rate_per_s : {10.0, 20.0, 30.0}) {
    expect_near(one_that_turned_back(rate_per_s).velocity_mm_s(), {-10, 0, 0});
  }
}

TEST(CoilImageModel, OfASlowTubeItIsThatOfALongerTime) {
  ShownTube tube;
  for (int i = 0; i < 6; ++i) tube.show(0.2, {0.8 * i, 0, 0});
  expect_near(tube.velocity_mm_s(), {4, 0, 0});
}

TEST(CoilImageModel, AStillTubeHasNone) {
  ShownTube tube;
  for (int i = 0; i < 6; ++i) tube.show(0.1, {0.2 * i, 0, 0});  // 0.8 mm within five images
  expect_near(tube.velocity_mm_s(), {0, 0, 0});
}

TEST(CoilImageModel, ImagesThatAreFarApartSayNothingOfIt) {
  ShownTube tube;
  for (int i = 0; i < 6; ++i) tube.show(1.1, {10.0 * i, 0, 0});
  expect_near(tube.velocity_mm_s(), {0, 0, 0});
}

TEST(CoilImageModel, FourImagesASecondAreEnough) {
  ShownTube tube;
  for (int i = 0; i < 3; ++i) tube.show(0.25, {5.0 * i, 0, 0});
  expect_near(tube.velocity_mm_s(), {20, 0, 0});
}

// Its tip points to -y.
TEST(CoilImageModel, AlongItselfTheTubeGoesWithTheSpeedThatIsEstimated) {
  ShownTube tube;
  for (int i = 0; i < 6; ++i) tube.show(0.1, {1.0 * i, -0.5 * i, 0}, 30);
  expect_near(tube.velocity_mm_s(), {10, -30, 0});
}

}  // namespace
}  // namespace tubed
