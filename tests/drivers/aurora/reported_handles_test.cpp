#include "drivers/aurora/reported_handles.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "drivers/aurora/tx_reply.hpp"

namespace tubed::aurora {
namespace {

using Agreement = ReportedHandles::Agreement;

TrackingReply reply_of(const std::vector<std::pair<int, Report>>& handles) {
  TrackingReply reply;
  for (const auto& [handle, report] : handles) {
    HandleReading& reading = reply.handles[static_cast<std::size_t>(reply.handle_count++)];
    reading.handle = static_cast<std::uint8_t>(handle);
    reading.report = report;
  }
  return reply;
}

ReportedHandles tracking_0a_0b() {
  ReportedHandles handles;
  constexpr std::array<std::uint8_t, 2> kTracked = {0x0A, 0x0B};
  constexpr std::array<std::uint8_t, 3> kFound = {0x0A, 0x0B, 0x0C};
  handles.start(kTracked, kFound);
  return handles;
}

TEST(ReportedHandles, TakeNoteOfHandlesThatAreNotEnabled) {
  ReportedHandles handles = tracking_0a_0b();
  EXPECT_EQ(handles.compare(reply_of({{0x0A, Report::kValid},
                                      {0x0B, Report::kMissing},
                                      {0x0C, Report::kDisabled},
                                      {0x0D, Report::kUnoccupied}})),
            Agreement::kComplete);
  EXPECT_EQ(handles.reported().size(), 4U);
  EXPECT_EQ(handles.newcomer(), 0x0D);
  EXPECT_EQ(handles.compare(reply_of({{0x0A, Report::kValid}, {0x0B, Report::kValid}})),
            Agreement::kComplete);
  EXPECT_EQ(handles.newcomer(), -1);
}

// Recorded with firmware Rev 006: PINIT:0A failed with ERROR13, nothing was enabled, TSTART was carried out.
TEST(ReportedHandles, KnowTheRecordedReplyOfATrackerThatTracksNothing) {
  TrackingReply reply;
  ASSERT_TRUE(decode_tx("010ADISABLED\n0000", reply));
  ReportedHandles handles;
  constexpr std::array<std::uint8_t, 1> kFound = {0x0A};
  handles.start({}, kFound);
  EXPECT_EQ(handles.compare(reply), Agreement::kComplete);
  EXPECT_EQ(handles.newcomer(), -1);
}

TEST(ReportedHandles, SeeWhenATrackedOneIsAbsentOrAnotherIsEnabled) {
  ReportedHandles handles = tracking_0a_0b();
  EXPECT_EQ(handles.compare(reply_of({{0x0A, Report::kValid}})), Agreement::kTrackedAbsent);
  EXPECT_EQ(
      handles.compare(reply_of({{0x0A, Report::kValid}, {0x0B, Report::kValid}, {0x0C, Report::kMissing}})),
      Agreement::kForeignEnabled);
}

TEST(ReportedHandles, RefuseAReplyThatHasAHandleTwice) {
  ReportedHandles handles = tracking_0a_0b();
  EXPECT_EQ(
      handles.compare(reply_of({{0x0A, Report::kValid}, {0x0B, Report::kValid}, {0x0A, Report::kValid}})),
      Agreement::kTwice);
}

}  // namespace
}  // namespace tubed::aurora
