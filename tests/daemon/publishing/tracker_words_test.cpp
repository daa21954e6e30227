#include "daemon/publishing/tracker_words.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/publishing/distinct_values.hpp"

namespace tubed {
namespace {

TEST(TrackerWords, NameTheTrackerAndEveryToolInOneLine) {
  EXPECT_EQ(
      tracker_words(distinct_identity("catheter").tracker),
      "tracker is AURORA Rev 008, API D.001.007, control unit P5-00807, field generator SC-00808; tools: "
      "port 809 serial 0000032A part 610811, port 812 serial 0000032D part 610814");
}

TEST(TrackerWords, LeaveOutWhatTheTrackerDidNotSay) {
  TrackerIdentityValues only_firmware;
  only_firmware.firmware = "AURORA Rev 008";
  EXPECT_EQ(tracker_words(only_firmware), "tracker is AURORA Rev 008; no tool has said which it is");
  TrackerIdentityValues only_tool;
  only_tool.tools = {{1, 0x3C4B0001, ""}};
  EXPECT_EQ(tracker_words(only_tool), "tracker is of unknown firmware; tools: port 1 serial 3C4B0001");
}

}  // namespace
}  // namespace tubed
