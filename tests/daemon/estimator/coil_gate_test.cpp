// Which coils take part, from measurements whose innovations are written down.
#include "daemon/estimator/coils/coil_gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr double kInterval_s = 0.025;
constexpr int kCoils = 5;

/// Coils on the arc, except for what `off_mm` adds in z; each of them is expected there to 2 mm.
class GateBench {
 public:
  GateBench() {
    for (Eigen::Index i = 0; i < C.cols(); ++i) {
      C.col(i) = arc_point(static_cast<double>(i - 1) * spline.spacing_mm());
    }
    coils.count = kCoils;
    begin();
  }

  void begin() { gate.begin(with({0, 0, 0, 0, 0}), time, time); }

  CoilObservations with(const std::vector<double>& off_mm) const {
    CoilObservations measured;
    measured.count = kCoils;
    for (int i = 0; i < kCoils; ++i) {
      CoilObservation& coil = measured.coils[static_cast<std::size_t>(i)];
      coil.state = CoilState::kUsed;
      coil.s_mm = 20 + 80 * i;
      const CubicBasis basis = spline.basis(coil.s_mm);
      coil.p_world_mm =
          combine(C, basis.first, basis.value) + Eigen::Vector3d(0, 0, off_mm[static_cast<std::size_t>(i)]);
    }
    return measured;
  }

  void measure(const std::vector<double>& off_mm, double sigma_mm = 2) {
    time += std::chrono::milliseconds(25);
    coils = with(off_mm);
    CoilInnovations innovations(kCoils);
    innovations.count = kCoils;
    innovations.covariance_mm2.diagonal().setConstant(sigma_mm * sigma_mm);
    for (int i = 0; i < kCoils; ++i) {
      innovations.coil[static_cast<std::size_t>(i)] = i;
      innovations.innovation_mm(3 * i + 2) = off_mm[static_cast<std::size_t>(i)];
    }
    gate.judge(innovations, faults, spline, C, time, kInterval_s, coils);
  }

  [[nodiscard]] bool uses(int coil) const { return coils.coils[static_cast<std::size_t>(coil)].used(); }

  /// The coils alone are asked; they name this one, or none (-1).
  void answer(int named, bool confirmed = false) {
    CoilObservations alone = with({0, 0, 0, 0, 0});
    if (named >= 0) alone.coils[static_cast<std::size_t>(named)].state = CoilState::kOutlier;
    gate.take_answer(true, alone, time, confirmed);
  }

  EstimatorSettings settings;
  UniformCubicBSpline spline{26, 380};
  Eigen::Matrix3Xd C{3, 26};
  CoilGate gate{settings, kCoils};
  CoilFaults faults{settings.coil_faults, kCoils};
  CoilObservations coils;
  MonotonicTime time = from_ns(1'000'000'000);
};

TEST(CoilGate, ACoilThatTheOthersContradictTakesNoPartAndComesBack) {
  GateBench bench;
  bench.measure({0, 0, 40, 0, 0});
  EXPECT_FALSE(bench.uses(2));
  EXPECT_TRUE(bench.uses(1) && bench.uses(3));
  EXPECT_FALSE(bench.gate.most_are_out());
  bench.measure({0, 0, 40, 0, 0});
  bench.measure({0, 0, 0, 0, 0});
  EXPECT_FALSE(bench.uses(2));  // it says something else than the time before
  bench.measure({0, 0, 0, 0, 0});
  EXPECT_TRUE(bench.uses(2));
}

TEST(CoilGate, OneThatJumpedBetweenTwoCalmOnesStaysOutWhileItIsThere) {
  GateBench bench;
  for (int i = 0; i < 40; ++i) bench.measure({0, 0, 0, 0, 0});  // no longer young
  bench.measure({0, 0, 25, 0, 0});
  for (int i = 0; i < 100; ++i) bench.measure({0, 0, 25, 0, 0}, 30);  // known so badly that it would agree
  EXPECT_FALSE(bench.uses(2));
  bench.measure({0, 0, 3, 0, 0});
  bench.measure({0, 0, 3, 0, 0});
  EXPECT_TRUE(bench.uses(2));
}

TEST(CoilGate, WhereMostContradictTheShapeIsWrong) {
  GateBench bench;
  bench.measure({90, -80, 70, 0, 0});
  EXPECT_TRUE(bench.gate.most_are_out());
}

TEST(CoilGate, AsksTheCoilsAloneOftenAfterABeginningAndThenEachHalfSecond) {
  GateBench bench;
  int asked = 0;
  for (int i = 0; i < 100; ++i) {
    bench.measure({0, 0, 0, 0, 0});
    if (bench.gate.asks_alone(bench.time, kInterval_s)) {
      ++asked;
      bench.answer(-1);
    }
  }
  EXPECT_EQ(asked, 19 + 4);  // 0.5 s at each measurement, then each half second of two
}

TEST(CoilGate, ACoilInUseThatTheCoilsAloneNameDisownsTheShape) {
  GateBench bench;
  bench.measure({0, 0, 0, 0, 0});
  bench.answer(1);
  EXPECT_TRUE(bench.gate.shape_is_disowned());
  bench.gate.own_shape();
  EXPECT_FALSE(bench.gate.shape_is_disowned());
}

TEST(CoilGate, AGatedCoilThatNobodyNamesIsToleratedForHalfASecondAndLongerWithImages) {
  for (const bool confirmed : {false, true}) {
    GateBench bench;
    int measurements = 0;
    while (!bench.gate.shape_is_disowned() && measurements < 400) {
      bench.measure({0, 0, 40, 0, 0});
      bench.answer(-1, confirmed);
      ++measurements;
    }
    EXPECT_NEAR(measurements * kInterval_s, confirmed ? 5 : 0.5, 1.5 * kInterval_s) << confirmed;
  }
}

TEST(CoilGate, BeliefsSayWhatWasKnownBeforeTheMeasurement) {
  GateBench bench;
  bench.measure({0, 0, 40, 0, 0});
  CoilObservations next = bench.with({0, 0, 0, 0, 0});
  bench.gate.write_beliefs(next);
  EXPECT_DOUBLE_EQ(next.coils[2].belief, 0.1);
  EXPECT_DOUBLE_EQ(next.coils[1].belief, 1 - bench.settings.coil_faults.probability);
}

/// Root of what the jump of that coil, 12 mm in z, leaves open there after it is believed again: when the
/// shape without it is known so badly that it agrees.
double open_mm(int coil) {
  GateBench bench;
  for (int i = 0; i < 25; ++i) bench.measure({0, 0, 0, 0, 0});
  std::vector<double> jumped(kCoils, 0);
  jumped[static_cast<std::size_t>(coil)] = 12;
  for (int i = 0; i < 4; ++i) bench.measure(jumped);
  EXPECT_FALSE(bench.uses(coil));
  for (int i = 0; i < 40; ++i) bench.measure(jumped, 20);
  EXPECT_TRUE(bench.uses(coil) || coil == 2);
  return std::sqrt(bench.gate.end_jumps().square_mm2(20 + 80 * coil, bench.time)(2, 2));
}

TEST(CoilGate, WhatAnEndCoilJumpedByIsLeftOpenWhenItIsBelievedAgain) {
  for (const int end : {0, kCoils - 1}) EXPECT_NEAR(open_mm(end), 12 / std::sqrt(2.0), 0.3) << end;
  EXPECT_EQ(open_mm(2), 0) << "it stays out";
}

TEST(CoilGate, WhatAnEndCoilJumpedByIsLeftOpenWhereABeginningTakesIt) {
  GateBench bench;
  for (int i = 0; i < 25; ++i) bench.measure({0, 0, 0, 0, 0});
  for (int i = 0; i < 4; ++i) bench.measure({0, 0, 0, 0, 12});
  bench.begin();
  EXPECT_NEAR(std::sqrt(bench.gate.end_jumps().square_mm2(340, bench.time)(2, 2)), 12 / std::sqrt(2.0), 0.3);
  bench.gate.reset();
  EXPECT_TRUE(bench.gate.end_jumps().square_mm2(340, bench.time).isZero());
}

TEST(CoilGate, WhatJumpsTogetherIsAMotionThatLeavesNothingOpen) {
  GateBench bench;
  for (int i = 0; i < 25; ++i) bench.measure({0, 0, 0, 0, 0});
  for (int i = 0; i < 4; ++i) bench.measure({0, 0, 0, 12, 12});
  for (int i = 0; i < 40; ++i) bench.measure({0, 0, 0, 12, 12}, 20);
  EXPECT_TRUE(bench.gate.end_jumps().square_mm2(340, bench.time).isZero());
}

}  // namespace
}  // namespace tubed
