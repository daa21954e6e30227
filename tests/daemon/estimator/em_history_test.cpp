#include "daemon/estimator/coils/em_history.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace tubed {
namespace {

EmFrame frame_at(std::int64_t ms) {
  EmFrame frame;
  frame.measured = from_ns(ms * 1'000'000);
  frame.tracker_frame = static_cast<std::uint32_t>(ms);
  return frame;
}

TEST(EmHistory, FindsTheNewestMeasurementNotLaterThanATime) {
  const auto history = std::make_unique<EmHistory>();
  for (const int ms : {25, 50, 75}) {
    history->add(frame_at(ms));
  }
  EXPECT_EQ(history->newest_until(from_ns(60'000'000))->tracker_frame, 50U);
  EXPECT_EQ(history->newest_until(from_ns(75'000'000))->tracker_frame, 75U);
  EXPECT_EQ(history->newest_until(from_ns(24'000'000)), nullptr);
}

TEST(EmHistory, TimeOnlyGoesForward) {
  const auto history = std::make_unique<EmHistory>();
  EXPECT_TRUE(history->add(frame_at(50)));
  EXPECT_FALSE(history->add(frame_at(50)));
  EXPECT_FALSE(history->add(frame_at(25)));
  EXPECT_EQ(history->size(), 1U);
}

TEST(EmHistory, ForgetsTheOldestFirst) {
  const auto history = std::make_unique<EmHistory>();
  for (std::size_t i = 1; i <= EmHistory::kCapacity + 10; ++i) {
    history->add(frame_at(static_cast<std::int64_t>(i)));
  }
  EXPECT_EQ(history->newest_until(from_ns(10'000'000)), nullptr);
  EXPECT_EQ(history->newest_until(from_ns(11'000'000))->tracker_frame, 11U);
}

}  // namespace
}  // namespace tubed
