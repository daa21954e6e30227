#include "clients/evaluation/flash_latency.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tubed {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// A camera of 20 images a second whose pictures reach the daemon `late` after the light and are stamped
/// `stamped_late` after it; shapes come 5 ms after their image.
struct Room {
  std::int64_t late_ns = 30 * kMs;
  std::int64_t stamped_late_ns = 12 * kMs;
  FlashLatency latency;

  /// Images from `from_ns` to `until_ns`; those that began after `white_from_ns` are refused.
  void run(std::int64_t from_ns, std::int64_t until_ns, std::int64_t white_from_ns, bool has_stamps = true) {
    for (std::int64_t seen_ns = from_ns; seen_ns < until_ns; seen_ns += 50 * kMs) {
      FlashSample sample;
      sample.received_ns = seen_ns + late_ns + 5 * kMs;
      sample.is_image_instant = true;
      sample.is_rejected = seen_ns >= white_from_ns;
      if (has_stamps) sample.exposure_ns = seen_ns + stamped_late_ns;
      latency.add(sample);
    }
  }
};

constexpr std::int64_t kNever = std::int64_t{1} << 60;

TEST(FlashLatency, AFlashIsAnsweredByTheFirstImageThatShowsIt) {
  Room room;
  EXPECT_FALSE(room.latency.is_ready());
  room.run(0, 100 * kMs, kNever);
  EXPECT_TRUE(room.latency.is_ready());
  room.latency.turn_white(120 * kMs);
  EXPECT_TRUE(room.latency.is_waiting());
  room.run(100 * kMs, 400 * kMs, 120 * kMs);  // the image at 150 shows it
  ASSERT_EQ(room.latency.to_shape_ms().size(), 1U);
  EXPECT_DOUBLE_EQ(room.latency.to_shape_ms()[0], 150 + 30 + 5 - 120);
  EXPECT_DOUBLE_EQ(room.latency.to_stamp_ms()[0], 150 + 12 - 120);
  EXPECT_FALSE(room.latency.is_waiting());
  EXPECT_FALSE(room.latency.is_ready()) << "no noise has been taken since";
}

TEST(FlashLatency, ARefusalFromBeforeTheFlashIsNoAnswer) {
  FlashLatency latency;
  latency.turn_white(100 * kMs);
  latency.add({.received_ns = 99 * kMs, .is_image_instant = true, .is_rejected = true});
  EXPECT_TRUE(latency.to_shape_ms().empty());
  EXPECT_TRUE(latency.is_waiting());
}

TEST(FlashLatency, AFlashThatNobodyAnsweredIsCountedAndForgotten) {
  Room room;
  room.latency.turn_white(0);
  room.run(50 * kMs, 400 * kMs, kNever);
  room.latency.turn_to_noise();
  room.run(400 * kMs, 800 * kMs, 400 * kMs);  // refused for another reason
  EXPECT_EQ(room.latency.flashes(), 1);
  EXPECT_TRUE(room.latency.to_shape_ms().empty());
  EXPECT_FALSE(room.latency.is_ready());
}

TEST(FlashLatency, FlashesAtEveryPhaseTellHowLateTheStampsAre) {
  Room room;
  std::mt19937 random(3);
  std::int64_t now_ns = 0;
  for (int flash = 0; flash < 400; ++flash) {
    room.run(now_ns, now_ns + 200 * kMs, kNever);
    now_ns += 200 * kMs;
    const auto white_ns = now_ns + static_cast<std::int64_t>(random() % (50 * kMs));
    room.latency.turn_white(white_ns);
    room.run(now_ns, now_ns + 200 * kMs, white_ns);
    now_ns += 200 * kMs;
    room.latency.turn_to_noise();
  }
  EXPECT_EQ(room.latency.to_shape_ms().size(), 400U);
  EXPECT_DOUBLE_EQ(room.latency.period_ms().value_or(0), 50);
  // Of 400 waits, uniform over 50 ms: the mean is known to 0.7 ms.
  EXPECT_NEAR(room.latency.stamps_late_ms().value_or(1e9), 12, 3);
}

TEST(FlashLatency, WithoutStampsOfThisHostThereIsNoOffset) {
  Room room;
  for (int flash = 0; flash < 20; ++flash) {
    const std::int64_t now_ns = flash * 400 * kMs;
    room.run(now_ns, now_ns + 200 * kMs, kNever, false);
    room.latency.turn_white(now_ns + 200 * kMs);
    room.run(now_ns + 200 * kMs, now_ns + 400 * kMs, 0, false);
    room.latency.turn_to_noise();
  }
  EXPECT_EQ(room.latency.to_shape_ms().size(), 20U);
  EXPECT_FALSE(room.latency.stamps_late_ms());
}

}  // namespace
}  // namespace tubed
