// What a person reads about plugs: the cause first.
#include "drivers/aurora/port_words.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tubed::aurora {
namespace {

/// Sensors 1 and 2 at port 1, 3 and 4 at port 2.
CoilMap two_tools() {
  CoilMap map;
  map.place(1, {1, 0});
  map.place(2, {1, 1});
  map.place(3, {2, 0});
  map.place(4, {2, 1});
  return map;
}

FoundCoil coil(std::uint8_t handle, CoilPlug plug) {
  FoundCoil found;
  found.handle = handle;
  found.plug = plug;
  found.serial_number = 0x3C4B0009;
  found.part_number = BoundedText<20>("610029");
  found.usable = true;
  return found;
}

const std::vector<FoundCoil> kAll = {coil(0x0A, {1, 0}), coil(0x0B, {2, 0}), coil(0x0C, {1, 1}),
                                     coil(0x0D, {2, 1})};

TEST(PortWords, AreEmptyWhenAllIsWell) {
  EXPECT_TRUE(describe_missing(two_tools(), kAll, {}).empty());
  EXPECT_TRUE(describe_unused(two_tools(), kAll).empty());
  EXPECT_TRUE(describe_system_status({}).empty());
}

TEST(PortWords, SayWhichErrorAToolEndedWithBeforeAnythingElse) {
  auto found = kAll;
  found[1].usable = false;
  found[1].error_code = 0x13;
  found.erase(found.begin() + 3);  // the second coil never appeared
  EXPECT_EQ(describe_missing(two_tools(), found, {}).text(),
            "port 2: ERROR13, cannot initialise the port handle: the tool's memory is unreadable or "
            "unprogrammed; sensor 3, 4 left out");
}

TEST(PortWords, NameAPlugWithoutAToolAndOneThatWasPulled) {
  EXPECT_EQ(describe_missing(two_tools(), std::span(kAll).first(1), {}).text(),
            "port 1: the tool has no channel 1; sensor 2 left out; port 2: no tool; sensor 3, 4 left out");
  FoundSet pulled;
  pulled.set(1).set(3);
  EXPECT_EQ(describe_missing(two_tools(), kAll, pulled).text(),
            "port 2: the tool was unplugged; sensor 3, 4 left out");
}

TEST(PortWords, NameAnotherCatheterInThePlug) {
  CoilMap map = two_tools();
  for (const int sensor : {1, 2}) {
    map.expect(sensor, {0x3C4B0001U, BoundedText<20>("610029")});
  }
  auto found = kAll;
  for (const std::size_t i : {0U, 2U}) {
    found[i].other_tool = true;
    found[i].usable = false;
  }
  EXPECT_EQ(describe_missing(map, found, {}).text(),
            "port 1: tool 3C4B0009 (part 610029) is plugged in, tool 3C4B0001 (part 610029) is configured; "
            "sensor 1, 2 left out");
}

TEST(PortWords, NameWhatIsPluggedInAndNotConfigured) {
  auto found = kAll;
  found.push_back(coil(0x0E, {4, 0}));
  found.push_back(coil(0x0F, {5, 0}));
  found.back().usable = false;
  found.back().error_code = 0x13;
  EXPECT_TRUE(describe_missing(two_tools(), found, {}).empty());
  EXPECT_EQ(describe_unused(two_tools(), found).text(),
            "not in the configuration, not tracked: port 4 channel 0, port 5 channel 0 (ERROR13)");
}

TEST(PortWords, SayWhatTheTrackerComplainsOf) {
  EXPECT_EQ(describe_system_status({0x0400}).text(),
            "the field generator or other hardware was unplugged or changed: check its cable");
  EXPECT_NE(describe_system_status({0x0301}).text().find("diagnostic"), std::string_view::npos);
  EXPECT_NE(describe_system_status({0x0301}).text().find("temperature"), std::string_view::npos);
  EXPECT_NE(describe_system_status({0x0301}).text().find("synchronisation"), std::string_view::npos);
}

}  // namespace
}  // namespace tubed::aurora
