// Replies as recorded, and what is sent because of them.
#include "drivers/aurora/port_setup.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

namespace tubed::aurora {
namespace {

/// Plays replies by command; what nobody foresaw is not answered. Returns the commands, without check sums.
std::vector<std::string> play(PortSetup& setup, std::vector<std::pair<std::string, std::string>> script) {
  std::vector<std::string> sent;
  setup.begin();
  while (setup.state() == PortSetup::State::kBusy && sent.size() < 100) {
    const std::string text(setup.command().text());
    const std::string command = text.substr(0, text.size() - 5);
    sent.push_back(command);
    std::string payload;
    for (auto line = script.begin(); line != script.end(); ++line) {
      if (line->first == command) {
        payload = line->second;
        script.erase(line);
        break;
      }
    }
    Reply reply;
    reply.payload = as_bytes(payload);
    reply.kind = payload == "OKAY" ? ReplyKind::kOkay : ReplyKind::kText;
    if (payload.starts_with("ERROR")) {
      reply.kind = ReplyKind::kError;
      reply.error_code = static_cast<std::uint8_t>(parse_hex(payload.substr(5)).value());
    }
    setup.take(payload.empty() ? nullptr : &reply);
  }
  return sent;
}

/// PHINF 0025: a catheter's coil with its port status, at port and channel.
std::string tool(const std::string& status, const std::string& port, const std::string& channel) {
  return "0B000000NDI         0003C4B0001" + status + "610029              3C4B000000" + port + channel;
}

CoilMap both_coils() {
  CoilMap map;
  map.place(1, {1, 0});
  map.place(2, {1, 1});
  return map;
}

TEST(PortSetup, FindsTheSecondCoilThatAppearsAfterTheFirstWasInitialised) {
  PortSetup setup(both_coils(), {});
  const auto sent = play(setup, {{"PHSR:01", "00"},
                                 {"PHSR:02", "010A001"},
                                 {"PINIT:0A", "OKAY"},
                                 {"PHSR:02", "00"},
                                 {"PHSR:03", "020A01F0B01F"},
                                 {"PHSR:04", "00"},
                                 {"PHINF:0A0025", tool("1F", "01", "00")},
                                 {"PENA:0AD", "OKAY"},
                                 {"PHINF:0B0025", tool("1F", "01", "01")},
                                 {"PENA:0BD", "OKAY"}});
  ASSERT_EQ(setup.state(), PortSetup::State::kDone);
  ASSERT_EQ(setup.found().size(), 2U);
  EXPECT_EQ(setup.found()[1].handle, 0x0B);
  EXPECT_EQ(setup.found()[1].plug, (CoilPlug{1, 1}));
  EXPECT_FALSE(setup.found()[0].simulated);
  EXPECT_TRUE(setup.found()[0].usable);
  EXPECT_TRUE(setup.found()[1].usable);
  EXPECT_EQ(sent.front(), "PHSR:01");
}

TEST(PortSetup, FreesStaleHandlesFirst) {
  PortSetup setup(both_coils(), {});
  const auto sent = play(
      setup,
      {{"PHSR:01", "010A000"}, {"PHF:0A", "OKAY"}, {"PHSR:01", "00"}, {"PHSR:02", "00"}, {"PHSR:03", "00"}});
  EXPECT_EQ(setup.state(), PortSetup::State::kDone);
  EXPECT_EQ((std::vector<std::string>{sent.begin(), sent.begin() + 3}),
            (std::vector<std::string>{"PHSR:01", "PHF:0A", "PHSR:01"}));
  EXPECT_TRUE(setup.found().empty());
}

TEST(PortSetup, DisablesWhatNobodyUses) {
  PortSetup setup(both_coils(), {});
  const auto sent = play(setup, {{"PHSR:01", "00"},
                                 {"PHSR:02", "00"},
                                 {"PHSR:03", "00"},
                                 {"PHSR:04", "010A03F"},
                                 {"PHINF:0A0025", tool("3F", "07", "00")},
                                 {"PDIS:0A", "OKAY"}});
  EXPECT_EQ(setup.state(), PortSetup::State::kDone);
  EXPECT_EQ(sent.back(), "PDIS:0A");
}

TEST(PortSetup, NamesThePortOfAToolThatCannotBeInitialisedAndTriesItOnce) {
  PortSetup setup(both_coils(), {});
  const auto sent = play(setup, {{"PHSR:01", "00"},
                                 {"PHSR:02", "010A001"},
                                 {"PINIT:0A", "ERROR13"},
                                 {"PHINF:0A0020", "3C4B0000000200"},
                                 {"PHSR:02", "010A001"},
                                 {"PHSR:03", "00"}});
  EXPECT_EQ(setup.state(), PortSetup::State::kDone);
  EXPECT_EQ(std::count(sent.begin(), sent.end(), "PINIT:0A"), 1);
  ASSERT_EQ(setup.found().size(), 1U);
  EXPECT_EQ(setup.found()[0].error_code, 0x13);
  EXPECT_EQ(setup.found()[0].plug, (CoilPlug{2, 0}));
  EXPECT_FALSE(setup.found()[0].usable);
}

TEST(PortSetup, GivesUpWritingADefinitionThatIsNotAnswered) {
  const std::vector<std::uint8_t> rom(70, 0xAB);
  const std::vector<ToolDefinition> tools = {{1, rom}};
  PortSetup setup(both_coils(), tools);
  std::vector<std::string> written;
  for (const std::string& command : play(setup, {{"PHSR:01", "00"},
                                                 {"PHSR:02", "010A001"},
                                                 {"PHINF:0A0020", "3C4B0000000100"},
                                                 {"PVWR:0A0000" + std::string(128, 'A'), ""}})) {
    if (command.starts_with("PVWR")) {
      written.push_back(command.substr(0, 11));
    }
  }
  EXPECT_EQ(written, (std::vector<std::string>(3, "PVWR:0A0000")));
}

// Genuine definition files are shorter than the memory, and a tool that got only a part of it stays ERROR13.
TEST(PortSetup, WritesTheWholeMemoryOfAToolWhoseDefinitionFileIsShort) {
  std::vector<std::uint8_t> rom(329, 0xAB);
  const std::vector<ToolDefinition> tools = {{1, rom}};
  PortSetup setup(both_coils(), tools);
  std::vector<std::pair<std::string, std::string>> script = {
      {"PHSR:01", "00"}, {"PHSR:02", "010A001"}, {"PHINF:0A0020", "3C4B0000000100"}};
  for (int block = 0; block < 16; ++block) {
    char address[5];
    std::snprintf(address, sizeof(address), "%04X", block * 64);
    const int bytes = std::clamp(329 - block * 64, 0, 64);
    std::string contents;
    for (int i = 0; i < 64; ++i) {
      contents += i < bytes ? "AB" : "00";
    }
    script.push_back({"PVWR:0A" + std::string(address) + contents, "OKAY"});
  }
  script.push_back({"PINIT:0A", "OKAY"});
  script.push_back({"PHSR:02", "00"});
  script.push_back({"PHSR:03", "00"});
  const auto sent = play(setup, script);
  EXPECT_EQ(std::count_if(sent.begin(), sent.end(),
                          [](const std::string& command) { return command.starts_with("PVWR"); }),
            16);
  EXPECT_NE(std::find(sent.begin(), sent.end(), "PINIT:0A"), sent.end());
  EXPECT_EQ(setup.state(), PortSetup::State::kDone);
}

TEST(PortSetup, LeavesOutAToolThatTheConfigurationDoesNotExpect) {
  CoilMap map = both_coils();
  map.expect(1, {.serial_number = 0x3C4B0002U, .part_number = {}});
  PortSetup setup(map, {});
  const auto sent = play(setup, {{"PHSR:01", "00"},
                                 {"PHSR:02", "00"},
                                 {"PHSR:03", "010A01F"},
                                 {"PHSR:04", "00"},
                                 {"PHINF:0A0025", tool("1F", "01", "00")}});
  ASSERT_EQ(setup.found().size(), 1U);
  EXPECT_TRUE(setup.found()[0].other_tool);
  EXPECT_FALSE(setup.found()[0].usable);
  EXPECT_EQ(setup.found()[0].part_number.text(), "610029");
  EXPECT_EQ(std::count(sent.begin(), sent.end(), "PENA:0AD"), 0);
}

TEST(PortSetup, LooksForTheLinkWhenAToolIsNotAnsweredForAndLeavesItOutTheSecondTime) {
  PortSetup setup(both_coils(), {});
  const std::vector<std::pair<std::string, std::string>> script = {
      {"PHSR:01", "00"}, {"PHSR:02", "010A001"}, {"PHSR:02", "010A001"}, {"PHSR:03", "00"}};
  EXPECT_EQ(play(setup, script).back(), "PINIT:0A");
  EXPECT_EQ(setup.state(), PortSetup::State::kNoAnswer);
  play(setup, script);
  EXPECT_EQ(setup.state(), PortSetup::State::kDone);
}

TEST(PortSetup, SaysHowFarItIs) {
  PortSetup setup(both_coils(), {});
  setup.begin();
  EXPECT_EQ(setup.progress().text(), "PHSR, looking for tools");
  Reply reply;
  for (const std::string_view payload : {"00", "020A0010B001"}) {
    reply.payload = as_bytes(payload);
    setup.take(&reply);
  }
  EXPECT_EQ(setup.progress().text(), "PINIT of handle 0A, 1 of 2");
}

TEST(PortSetup, SaysThatTheTrackerMustBeStoppedFirst) {
  PortSetup setup(both_coils(), {});
  play(setup, {{"PHSR:01", "ERROR0C"}});
  EXPECT_EQ(setup.state(), PortSetup::State::kMustHalt);
  play(setup, {{"PHSR:01", "ERROR10"}});
  EXPECT_EQ(setup.state(), PortSetup::State::kMustInit);
}

TEST(PortSetup, GivesUpWhenNothingIsAnswered) {
  PortSetup setup(both_coils(), {});
  EXPECT_EQ(play(setup, {}), (std::vector<std::string>(3, "PHSR:01")));
  EXPECT_EQ(setup.state(), PortSetup::State::kNoAnswer);
}

}  // namespace
}  // namespace tubed::aurora
