#include "daemon/estimator/coils/coil_observation.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kStuck_ns = 150'000'000;

struct CoilBench {
  RoomDescription room = one_view_room();
  std::unique_ptr<EmHistory> history = std::make_unique<EmHistory>();
  CoilObservations observe(const EmFrame& frame) {
    history->add(frame);
    return observe_coils(history->newest_until(frame.measured), *history, room.instruments.front(),
                         room.T_world_em, kStuck_ns);
  }
};

TEST(CoilObservation, ASensorOutsideTheFieldIsMissingNotAtTheOrigin) {
  CoilBench bench;
  EmFrame frame = measure_coils(bench.room, from_ns(1), 0, 1);
  frame.coils[2] = CoilSample{};
  frame.coils[3].status = CoilStatus::kOutOfVolume;
  const CoilObservations coils = bench.observe(frame);
  EXPECT_EQ(coils.coils[2].state, CoilState::kMissing);
  EXPECT_EQ(coils.coils[3].state, CoilState::kOutOfVolume);
  EXPECT_EQ(coils.used_count(), 3);
}

TEST(CoilObservation, TheFirstCoilThatTakesPartHoldsTheTipIfItIsNear) {
  CoilBench bench;
  EmFrame frame = measure_coils(bench.room, from_ns(1), 0, 1);
  CoilObservations coils = bench.observe(frame);
  EXPECT_EQ(coils.first_used_mm(), 10);
  EXPECT_TRUE(coils.hold_tip());
  coils.coils[0].state = CoilState::kOutlier;
  EXPECT_EQ(coils.first_used_mm(), 90);
  EXPECT_FALSE(coils.hold_tip());
  for (CoilObservation& coil : coils.coils) coil.state = CoilState::kMissing;
  EXPECT_EQ(coils.first_used_mm(), 0);
}

TEST(CoilObservation, OkWithoutAFinitePoseIsMissing) {
  CoilBench bench;
  EmFrame frame = measure_coils(bench.room, from_ns(1), 0, 1);
  frame.coils[0].p_em_mm.x() = CoilSample::kNaN;
  frame.coils[1].tangent_em.setZero();
  EXPECT_EQ(bench.observe(frame).used_count(), 3);
}

TEST(CoilObservation, PosesAreTakenToTheWorld) {
  CoilBench bench;
  bench.room.T_world_em = Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
  const EmFrame frame = measure_coils(bench.room, from_ns(1), 0, 1);
  const CoilObservations coils = bench.observe(frame);
  EXPECT_LT((coils.coils[1].p_world_mm - bench.room.T_world_em * frame.coils[1].p_em_mm).norm(), 1e-12);
  EXPECT_LT(
      (coils.coils[1].tangent_world - bench.room.T_world_em.linear() * frame.coils[1].tangent_em).norm(),
      1e-9);
}

TEST(CoilObservation, ACoilMountedTheOtherWayRoundIsTurned) {
  CoilBench bench;
  bench.room.instruments[0].coils[0].flipped = true;
  const EmFrame frame = measure_coils(bench.room, from_ns(1), 0, 1);
  EXPECT_LT((bench.observe(frame).coils[0].tangent_world + frame.coils[0].tangent_em).norm(), 1e-9);
}

TEST(CoilObservation, ValuesThatRepeatBitByBitAreStuckAfterTheLimit) {
  CoilBench bench;
  CoilObservations coils;
  for (int i = 0; i <= 6; ++i) {
    EmFrame frame = measure_coils(bench.room, from_ns(1 + i * 25'000'000LL), 1, static_cast<unsigned>(i));
    frame.coils[4] = measure_coils(bench.room, from_ns(1), 1, 99).coils[4];
    coils = bench.observe(frame);
    EXPECT_EQ(coils.coils[4].state, i < 6 ? CoilState::kUsed : CoilState::kStuck) << i * 25 << " ms";
  }
  EXPECT_EQ(coils.used_count(), 4);
}

// What says nothing now and then would otherwise be believed for the limit's length each time.
TEST(CoilObservation, StuckValuesStayStuckOverMeasurementsThatAreMissing) {
  CoilBench bench;
  for (int i = 0; i <= 20; ++i) {
    EmFrame frame = measure_coils(bench.room, from_ns(1 + i * 25'000'000LL), 1, static_cast<unsigned>(i));
    frame.coils[4] = measure_coils(bench.room, from_ns(1), 1, 99).coils[4];
    const bool is_missing = i % 5 == 4;
    if (is_missing) frame.coils[4] = CoilSample{};
    const CoilState state = bench.observe(frame).coils[4].state;
    if (i >= 6 && !is_missing) {
      EXPECT_EQ(state, CoilState::kStuck) << i * 25 << " ms";
    }
  }
}

TEST(CoilObservation, WithoutAnyMeasurementAllAreMissing) {
  CoilBench bench;
  const CoilObservations coils = observe_coils(nullptr, *bench.history, bench.room.instruments.front(),
                                               bench.room.T_world_em, kStuck_ns);
  EXPECT_EQ(coils.count, 5);
  EXPECT_EQ(coils.used_count(), 0);
}

TEST(CoilObservation, TheNearestCoilOfAPlaceTakesPartOrNot) {
  CoilObservations coils;
  EXPECT_FALSE(coils.nearest_is_used(0));
  coils.count = 3;
  for (int i = 0; i < 3; ++i) {
    coils.coils[static_cast<std::size_t>(i)].s_mm = 10 + 80 * i;
    coils.coils[static_cast<std::size_t>(i)].state = i == 1 ? CoilState::kOutlier : CoilState::kUsed;
  }
  EXPECT_TRUE(coils.nearest_is_used(0));
  EXPECT_TRUE(coils.nearest_is_used(49));
  EXPECT_FALSE(coils.nearest_is_used(51));
  EXPECT_FALSE(coils.nearest_is_used(129));
  EXPECT_TRUE(coils.nearest_is_used(131));
  EXPECT_TRUE(coils.nearest_is_used(1000));
}

}  // namespace
}  // namespace tubed
