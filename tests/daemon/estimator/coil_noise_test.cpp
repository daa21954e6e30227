#include "daemon/estimator/coils/coil_noise.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

/// Feeds measurements every 25 ms: noise of `amplitude_mm` in a random direction, a lasting error of
/// `lasting_mm` of every coil, and steady motion of `speed_mm_s`.
CoilNoise heard(double amplitude_mm, double lasting_mm, double speed_mm_s, int count) {
  const RoomDescription room = one_view_room();
  auto history = std::make_unique<EmHistory>();
  CoilNoise noise{EstimatorSettings{}};
  for (int i = 1; i <= count; ++i) {
    const MonotonicTime now = from_ns(1'000'000'000) + i * milliseconds(25);
    EmFrame frame = measure_coils(room, now, amplitude_mm, static_cast<unsigned>(i));
    for (int coil = 0; coil < frame.coil_count; ++coil) {
      frame.coils[static_cast<std::size_t>(coil)].p_em_mm +=
          Eigen::Vector3d(lasting_mm, -lasting_mm, speed_mm_s * 0.025 * i);
    }
    history->add(frame);
    noise.observe(*history->newest_until(now), *history, room.instruments.front());
  }
  return noise;
}

TEST(CoilNoise, OfFourMillimetresInARandomDirectionIsFoundAnAxis) {
  const CoilNoise noise = heard(4, 0, 0, 60);
  ASSERT_TRUE(noise.known());
  EXPECT_NEAR(noise.noise_position_mm(), 4 / std::sqrt(3.0), 0.35);  // of fixed length: not quite normal
  EXPECT_LT(noise.lasting_position_mm(2.31), 1.2);
}

TEST(CoilNoise, ErrorsThatStayAreNoNoise) {
  const CoilNoise noise = heard(0.5, 2, 0, 60);
  EXPECT_NEAR(noise.noise_position_mm(), 0.5 / std::sqrt(3.0), 0.05);
  EXPECT_NEAR(noise.lasting_position_mm(2.31), 2.31, 0.05);
}

TEST(CoilNoise, SteadyMotionIsNoNoise) {
  EXPECT_NEAR(heard(0.5, 0, 40, 60).noise_position_mm(), 0.5 / std::sqrt(3.0), 0.05);
}

TEST(CoilNoise, IsUnknownAtFirstAndThenAllIsTakenForNoise) {
  const CoilNoise noise = heard(0.5, 0, 0, 3);
  EXPECT_FALSE(noise.known());
  EXPECT_DOUBLE_EQ(noise.noise_position_mm(), EstimatorSettings{}.sigma_position_mm);
}

TEST(CoilNoise, RepeatedValuesAreNoMeasurements) {
  const RoomDescription room = one_view_room();
  auto history = std::make_unique<EmHistory>();
  CoilNoise noise{EstimatorSettings{}};
  for (int i = 1; i <= 40; ++i) {
    const MonotonicTime now = from_ns(1'000'000'000) + i * milliseconds(25);
    history->add(measure_coils(room, now, 0.5, 7));
    noise.observe(*history->newest_until(now), *history, room.instruments.front());
  }
  EXPECT_FALSE(noise.known());
}

}  // namespace
}  // namespace tubed
