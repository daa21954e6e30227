#include "daemon/estimator/coils/em_update.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

/// A state on an arc that is sure of itself, and coils measured on it.
struct EmBench {
  EmBench() : map(EstimatorSettings{}, 380, 5, 1), update(EstimatorSettings{}, map, 5), state(map, {}, 5) {
    const Eigen::Index n = map.spline().coefficient_count();
    for (Eigen::Index i = 0; i < n; ++i) {
      state.tube.C.col(i) = arc_point(static_cast<double>(i - 1) * map.spline().spacing_mm());
    }
    state.tube.m = state.tube.C;
    state.tube.P.setIdentity();
    state.tube.P *= 1e-4;
    const auto history = std::make_unique<EmHistory>();
    const EmFrame frame = measure_coils(room, from_ns(1), 2, 3);
    coils = observe_coils(&frame, *history, room.instruments.front(), room.T_world_em, 150'000'000);
  }
  void carry_off(double way_mm) {
    const Eigen::Index n = map.spline().coefficient_count();
    state.tube.C.leftCols(n).row(0).array() += way_mm;
    state.tube.m = state.tube.C;
  }
  RoomDescription room = one_view_room();
  TubeMap map;
  EmUpdate update;
  TubeState state;
  CoilObservations coils;
};

TEST(EmUpdate, AStateThatIsAstrayTwiceRunningIsLost) {
  EmBench bench;
  ASSERT_TRUE(bench.update.take(bench.coils, bench.state));
  bench.carry_off(150);
  EXPECT_TRUE(bench.update.take(bench.coils, bench.state)) << "once may be anything";
  EXPECT_GT(bench.update.pull().chi_squared, EmUpdate::kAstray * bench.update.pull().expected);
  EXPECT_FALSE(bench.update.take(bench.coils, bench.state));
}

TEST(EmUpdate, WhatAHandDoesIsNotAstray) {
  EmBench bench;
  bench.carry_off(10);
  for (int measurement = 0; measurement < 5; ++measurement) {
    EXPECT_TRUE(bench.update.take(bench.coils, bench.state)) << measurement;
  }
}

TEST(EmUpdate, AstrayOnceAndBackIsForgotten) {
  EmBench bench;
  for (int time = 0; time < 3; ++time) {
    bench.carry_off(150);
    EXPECT_TRUE(bench.update.take(bench.coils, bench.state)) << time;
    bench.carry_off(-150);
    EXPECT_TRUE(bench.update.take(bench.coils, bench.state)) << time;
  }
}

}  // namespace
}  // namespace tubed
