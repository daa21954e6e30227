#include "drivers/aurora/port_replies.hpp"

#include <gtest/gtest.h>

#include <string>

#include "drivers/aurora/command.hpp"

namespace tubed::aurora {
namespace {

const std::string kTool =
    "02"
    "1"
    "0"
    "00"
    "05"
    "NDI         "
    "001"
    "3A1B2C00"
    "3F";
const std::string kPart = "610058              ";
const std::string kLocation =
    "A1-00123"
    "0"
    "0"
    "02"
    "01";

TEST(HandleList, HasHandlesAndTheirStatus) {
  const auto list = parse_handle_list("020A01F0B01F");
  ASSERT_TRUE(list);
  ASSERT_EQ(list->count, 2);
  EXPECT_EQ(list->entries()[0].handle, 0x0A);
  EXPECT_EQ(list->entries()[1].handle, 0x0B);
  EXPECT_TRUE(list->entries()[1].status.initialised());
  EXPECT_FALSE(list->entries()[1].status.enabled());
}

TEST(HandleList, MayBeEmpty) { EXPECT_EQ(parse_handle_list("00")->count, 0); }

TEST(HandleList, IsNoneUnlessEveryCharacterIsAccountedFor) {
  for (const char* payload :
       {"", "0", "01", "010A01", "000A01F", "010A01F0", "010G01F", "FF0A01F", "210A01F"}) {
    EXPECT_FALSE(parse_handle_list(payload)) << payload;
  }
}

TEST(ToolReply, SaysWhatIsPluggedInWhere) {
  const auto reply = parse_tool(kTool + kLocation, kToolField | kLocationField);
  ASSERT_TRUE(reply && reply->tool && reply->location);
  EXPECT_EQ(reply->tool->kind, ToolKind::kProbe);
  EXPECT_EQ(reply->tool->switches, 1);
  EXPECT_EQ(reply->tool->subtype, 5);
  EXPECT_EQ(reply->tool->manufacturer.text(), "NDI");
  EXPECT_EQ(reply->tool->revision.text(), "001");
  EXPECT_EQ(reply->tool->serial_number, 0x3A1B2C00U);
  EXPECT_TRUE(reply->tool->status.enabled());
  EXPECT_EQ(reply->location->control_unit_serial.text(), "A1-00123");
  EXPECT_EQ(reply->location->port, 2);
  EXPECT_EQ(reply->location->channel, 1);
  EXPECT_FALSE(reply->part_number);
}

TEST(ToolReply, HasThePartNumberBetweenToolAndLocation) {
  const auto reply = parse_tool(kTool + kPart + kLocation, kToolField | kPartNumberField | kLocationField);
  ASSERT_TRUE(reply && reply->part_number && reply->location);
  EXPECT_EQ(reply->part_number->text(), "610058");
  EXPECT_EQ(reply->location->port, 2);
}

TEST(ToolReply, OfAPlugThatIsGoneHasNothingElse) {
  const auto reply = parse_tool("UNOCCUPIED", kToolField | kLocationField);
  ASSERT_TRUE(reply);
  EXPECT_TRUE(reply->unoccupied);
  EXPECT_FALSE(reply->tool);
}

TEST(ToolReply, IsNoneWhenCutOrLonger) {
  const std::string whole = kTool + kLocation;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_FALSE(parse_tool(whole.substr(0, size), kToolField | kLocationField)) << size;
  }
  EXPECT_FALSE(parse_tool(whole + "0", kToolField | kLocationField));
}

TEST(ApiRevision, NamesTheFamily) {
  const auto revision = parse_api_revision("D.001.007");
  ASSERT_TRUE(revision);
  EXPECT_EQ(revision->family, 'D');
  EXPECT_EQ(revision->major, 1);
  EXPECT_EQ(revision->minor, 7);
  for (const char* payload :
       {"", "D.001.00", "D.001.0071", "D-001.007", "D.0x1.007", "D.-01.007", "7.001.007"}) {
    EXPECT_FALSE(parse_api_revision(payload)) << payload;
  }
}

TEST(Firmware, StandsBehindTheFreezeTag) {
  EXPECT_EQ(find_firmware("Tracker\nFreeze Tag: AURORA Rev 008 \nFreeze Date: 01/01/2010\n"),
            "AURORA Rev 008");
  EXPECT_EQ(find_firmware("Freeze Tag: AURORA Rev 009"), "AURORA Rev 009");
  EXPECT_FALSE(find_firmware("Tracker\nFreeze Tag:\n"));
  EXPECT_FALSE(find_firmware(""));
}

TEST(UserParameter, IsFoundByItsWholeName) {
  const char* payload = "Info.Timeout.PINIT2=9\nInfo.Timeout.PINIT=5\n";
  EXPECT_EQ(find_user_parameter(payload, "Info.Timeout.PINIT"), "5");
  EXPECT_FALSE(find_user_parameter(payload, "Info.Timeout"));
}

}  // namespace
}  // namespace tubed::aurora
