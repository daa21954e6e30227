#include "daemon/estimator/agreement/held_across.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

/// Of the arc, 2000 px at 1200 mm: 1.67 px a mm, a line each 2 mm.
struct HeldBench {
  HeldBench() {
    for (Eigen::Index i = 0; i < C.cols(); ++i) {
      C.col(i) = arc_point(static_cast<double>(i - 1) * spline.spacing_mm());
    }
    for (double s_mm = 0; s_mm <= 380; s_mm += 2) lines.push_back({.s_mm = s_mm, .variance_px2 = 1});
  }
  HeldAcross& record() {
    const ViewConstraints view{&camera, lines.data(), static_cast<int>(lines.size())};
    held.record(view, {from_ns(1), spline, C, {&view, 1}});
    return held;
  }
  UniformCubicBSpline spline{26, 380};
  Eigen::Matrix3Xd C{3, 26};
  Camera camera{one_view_room().cameras.front()};
  std::vector<LineConstraint> lines;
  HeldAcross held{380};
};

TEST(HeldAcross, IsWhatTheLinesAroundSayTogether) {
  HeldBench bench;
  EXPECT_NEAR(bench.record().sigma_mm(200), 1 / std::sqrt(11.0) / 1.67, 0.02);
}

TEST(HeldAcross, IsNotKnownBeforeTheFirstImage) { EXPECT_TRUE(std::isinf(HeldBench().held.sigma_mm(200))); }

TEST(HeldAcross, IsNeverBetterThanAnImageIs) {
  HeldBench bench;
  for (LineConstraint& line : bench.lines) line.variance_px2 = 1e-4;
  EXPECT_NEAR(bench.record().sigma_mm(200), 0.15, 1e-9);
}

// Away from what is shown it is lost by and by, on both sides.
TEST(HeldAcross, IsLostBesideWhatIsShown) {
  HeldBench bench;
  std::erase_if(bench.lines, [](const LineConstraint& line) { return line.s_mm < 150 || line.s_mm > 250; });
  const HeldAcross& held = bench.record();
  EXPECT_GT(held.sigma_mm(100), held.sigma_mm(150) + 1);
  EXPECT_GT(held.sigma_mm(300), held.sigma_mm(250) + 1);
  EXPECT_GT(held.sigma_mm(0), held.sigma_mm(100) + 2);
}

TEST(HeldAcross, LinesThatShowNoTubeDoNotAddUp) {
  HeldBench bench;
  for (LineConstraint& line : bench.lines) line.variance_px2 = 200;
  EXPECT_TRUE(std::isinf(bench.record().sigma_mm(200)));
}

// A mark says where along itself the tube is.
TEST(HeldAcross, WhatComesAfterTheLinesIsNoLine) {
  HeldBench bench;
  for (LineConstraint& line : bench.lines) line.variance_px2 = 10;
  const double without = bench.record().sigma_mm(20);
  bench.lines.push_back({.s_mm = 20, .variance_px2 = 0.01});
  EXPECT_EQ(bench.record().sigma_mm(20), without);
}

}  // namespace
}  // namespace tubed
