#include "drivers/aurora_can/can_packer.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed {
namespace {

using aurora::CanTrackerState;
using std::chrono::milliseconds;

constexpr MonotonicTime kStart = from_ns(5'000'000'000);

std::optional<aurora::CanStatus> status_in(std::span<const aurora::CanFrame> frames) {
  return frames.size() == 1 ? aurora::unpack_status(frames[0]) : std::nullopt;
}

TEST(CanPacker, SendsStatusOnceASecondWhileTheTrackerIsAway) {
  CanPacker packer(CanLayout::kFd, 5);
  int sent = 0;
  for (int slice = 0; slice < 200; ++slice) {  // of 50 ms
    const auto status =
        status_in(packer.pack_away(CanTrackerState::kNoTracker, kStart + slice * milliseconds(50)));
    sent += status ? 1 : 0;
    if (status) {
      EXPECT_EQ(status->coil_count, 0);
      EXPECT_EQ(status->tracker_state(), CanTrackerState::kNoTracker);
      EXPECT_FALSE(status->is_measuring());
    }
  }
  EXPECT_EQ(sent, 10);
}

TEST(CanPacker, SendsStatusAtOnceWhenTheStateChanges) {
  CanPacker packer(CanLayout::kClassic, 5);
  for (const auto state : {CanTrackerState::kNoPort, CanTrackerState::kNoTracker, CanTrackerState::kStarting,
                           CanTrackerState::kNotMeasuring, CanTrackerState::kGatewayEnds}) {
    const auto status = status_in(packer.pack_away(state, kStart));
    ASSERT_TRUE(status);
    EXPECT_EQ(status->tracker_state(), state);
  }
}

TEST(CanPacker, SaysWithTheFirstMeasurementThatTheTrackerIsBack) {
  CanPacker packer(CanLayout::kFd, 5);
  ASSERT_EQ(packer.pack({}, kStart).size(), 3U + 5U);
  ASSERT_EQ(packer.pack({}, kStart + milliseconds(25)).size(), 2U + 5U) << "no news, no STATUS";
  ASSERT_EQ(packer.pack_away(CanTrackerState::kNotMeasuring, kStart + milliseconds(1100)).size(), 1U);
  const auto frames = packer.pack({}, kStart + milliseconds(1200));
  const auto status = aurora::unpack_status(frames[2]);
  ASSERT_TRUE(status);
  EXPECT_TRUE(status->is_measuring());
  EXPECT_EQ(status->coil_count, 5);
}

// The emulated tracker is switched on, found, started, and tracks.
TEST(CanTrackerStates, FollowTheSession) {
  aurora::SessionBench serial;
  serial.session.attach(serial.line);
  std::vector<CanTrackerState> states;
  for (int slice = 0; slice < 2000; ++slice) {
    const auto event = serial.session.run(serial.line.time + milliseconds(50), serial.frame);
    const CanTrackerState state = can_tracker_state(serial.session);
    if (states.empty() || states.back() != state) {
      states.push_back(state);
    }
    if (event == aurora::Session::Event::kMeasurement) {
      break;
    }
  }
  EXPECT_EQ(states, (std::vector{CanTrackerState::kNoTracker, CanTrackerState::kStarting,
                                 CanTrackerState::kNotMeasuring}));
}

TEST(CanTrackerStates, HaveWordsEachAndUnknownOnesToo) {
  std::vector<std::string_view> words;
  for (const int code : {0, 1, 2, 3, 4, 5, 99}) {
    words.push_back(aurora::describe(static_cast<CanTrackerState>(code)));
  }
  std::sort(words.begin(), words.end());
  EXPECT_EQ(std::unique(words.begin(), words.end()), words.end());
}

}  // namespace
}  // namespace tubed
