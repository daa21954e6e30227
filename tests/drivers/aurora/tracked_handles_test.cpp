// Handles that are tracked, their coils, and what replies say of them.
#include "drivers/aurora/tracked_handles.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

namespace tubed::aurora {
namespace {

/// Sensors 1 and 2 are the two coils of port 1, sensor 4 is the first one of port 2.
CoilMap three_coils() {
  CoilMap coils;
  coils.place(1, {1, 0});
  coils.place(2, {1, 1});
  coils.place(4, {2, 0});
  return coils;
}

constexpr std::array<TrackedHandle, 3> kThree{{{10, 0, false}, {11, 1, false}, {12, 3, false}}};

HandleReading reading(std::uint8_t handle, Report report, double x_mm = 0) {
  HandleReading reading;
  reading.handle = handle;
  reading.report = report;
  if (report == Report::kValid) {
    reading.p_em_mm = {x_mm, 0, -200};
    reading.rotation = {1, 0, 0, 0};
  }
  return reading;
}

TrackingReply reply_with(const std::vector<HandleReading>& readings) {
  TrackingReply reply;
  reply.handle_count = static_cast<int>(readings.size());
  std::copy(readings.begin(), readings.end(), reply.handles.begin());
  return reply;
}

TEST(TrackedHandles, EachIsTheCoilOfItsPlugInWhateverOrderTheReplyHasThem) {
  TrackedHandles handles(three_coils());
  handles.start(kThree);
  handles.take(reply_with(
      {reading(12, Report::kValid, 3), reading(10, Report::kValid, 1), reading(11, Report::kValid, 2)}));
  EmFrame frame;
  handles.fill(frame);
  ASSERT_EQ(frame.coil_count, 4);
  EXPECT_DOUBLE_EQ(frame.coils[0].p_em_mm.x(), 1);
  EXPECT_DOUBLE_EQ(frame.coils[1].p_em_mm.x(), 2);
  EXPECT_EQ(frame.coils[2].status, CoilStatus::kDisabled);  // no sensor 3
  EXPECT_DOUBLE_EQ(frame.coils[3].p_em_mm.x(), 3);
  EXPECT_EQ(frame.origin, Origin::kDevice);
  EXPECT_FALSE(handles.coil_is_absent());
}

TEST(TrackedHandles, OneThatTheReplyDoesNotHaveIsGone) {
  TrackedHandles handles(three_coils());
  handles.start(kThree);
  handles.take(reply_with({reading(10, Report::kValid, 1), reading(12, Report::kUnoccupied)}));
  EXPECT_FALSE(handles.has_lost(10));
  EXPECT_TRUE(handles.has_lost(11));
  EXPECT_TRUE(handles.has_lost(12));
  EXPECT_FALSE(handles.has_lost(99));  // not tracked
  EXPECT_TRUE(handles.coil_is_absent());
}

TEST(TrackedHandles, ACoilThatGotNoHandleIsAbsentThoughAllHandlesAreThere) {
  TrackedHandles handles(three_coils());
  handles.start(std::span(kThree).first(2));
  handles.take(reply_with({reading(10, Report::kValid), reading(11, Report::kMissing)}));
  EXPECT_TRUE(handles.coil_is_absent());
  EXPECT_EQ(handles.numbers().size(), 2U);
}

TEST(TrackedHandles, OneSimulatedHandleMakesTheFrameSimulated) {
  TrackedHandles handles(three_coils());
  auto tracked = kThree;
  tracked[1].simulated = true;
  handles.start(tracked);
  EmFrame frame;
  handles.fill(frame);
  EXPECT_EQ(frame.origin, Origin::kSimulated);
}

}  // namespace
}  // namespace tubed::aurora
