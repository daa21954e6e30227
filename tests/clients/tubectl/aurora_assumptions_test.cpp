// Every assumption against conversations in which it holds and does not. Replies are recorded ones where the
// protocol's description has them (drivers/aurora/README.md), else made from the layouts there.
#include "clients/tubectl/check/aurora_assumptions.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/clients/tubectl/hand_written_log.hpp"

namespace tubed {
namespace {

using aurora::Report;
using std::chrono::milliseconds;
using std::chrono::seconds;

const std::string kTool = "0200000BNDI         0013C4B000131";  // field 0001: 33 characters

Judgement judgement_of(const std::string& id, const WireConversation& conversation) {
  for (const JudgedAssumption& one : judge_assumptions(conversation)) {
    if (one.assumption->id == id) {
      return one.judgement;
    }
  }
  throw std::runtime_error("no assumption " + id);
}

HandWrittenLog a_log() { return {}; }

/// Tracking has begun, one coil, first BX answered as recorded: MISSING, frame 0.
HandWrittenLog tracking_log() {
  return a_log()
      .ask("PHSR", "03")
      .answer("010A01F")
      .ask("PENA", "0AD")
      .answer("OKAY")
      .ask("TSTART")
      .answer("OKAY")
      .ask("BX", "0001")
      .measure({without_pose(0x0A, Report::kMissing)});
}

/// TSTOP and TSTART with options, `pause` apart.
HandWrittenLog paused_log(std::string_view options, std::uint32_t frame_after) {
  return tracking_log()
      .track(0xA000, 10)
      .ask("TSTOP")
      .wait(milliseconds(340))
      .answer("OKAY")
      .ask("TSTART", options)
      .wait(milliseconds(1500))
      .answer("OKAY")
      .track(frame_after, 3);
}

struct Case {
  const char* id;
  AssumptionVerdict verdict;
  HandWrittenLog log;
};

constexpr AssumptionVerdict kHolds = AssumptionVerdict::kHolds;
constexpr AssumptionVerdict kFails = AssumptionVerdict::kDoesNotHold;

std::vector<Case> cases_of_the_line() {
  return {
      {"A1", kHolds, a_log().send("INIT:E3A5\r").receive("OKAYA896\r")},
      {"A1", kFails, a_log().send("INIT:E3A5\r").receive("OKAYA897\r")},
      {"A2", kHolds, a_log().send("APIREV \r").receive("D.001.0075194\r")},
      {"A2", kFails, a_log().send("APIREV \r").answer("ERROR01")},
      {"A3", kHolds, a_log().ask("INIT").answer("OKAY").serial_break().receive("RESETBE6F\r")},
      {"A3", kFails, a_log().ask("INIT").answer("OKAY").answer("OKAY")},
      {"A4", kHolds, a_log().serial_break().wait(milliseconds(1300)).receive("RESETBE6F\r")},
      {"A4", kFails, a_log().serial_break().wait(seconds(3)).ask("INIT").answer("OKAY")},
      {"A5", kHolds, a_log().ask("COMM", "50000").answer("OKAY").baud(115200).ask("INIT").answer("OKAY")},
      {"A5", kFails, a_log().ask("COMM", "50000").answer("OKAY").baud(115200).ask("INIT").wait(seconds(1))},
      {"A6", kHolds, a_log().ask("COMM", "A0000").answer("OKAY").baud(230400).ask("INIT").answer("OKAY")},
      {"A6", kFails, a_log().ask("COMM", "A0000").answer("ERROR06")},
      {"A7", kHolds, a_log().ask("COMM", "60000").answer("OKAY").baud(921600).ask("INIT").answer("OKAY")},
      {"A7", kFails, a_log().ask("COMM", "60000").answer("OKAY").baud(921600).ask("INIT").wait(seconds(1))},
      {"A8", kHolds, a_log().ask("APIREV").receive("D.001.0075194\r")},
      {"A8", kFails, a_log().ask("APIREV").answer("G.001.003")},
      {"A9", kHolds, a_log().ask("VER", "4").answer("AURORA\nFreeze Tag: AURORA Rev 006\n")},
      {"A9", kFails, a_log().ask("VER", "4").answer("AURORA Rev 006")},
      {"A10", kHolds, a_log().ask("GET", "Info.Timeout.PINIT").answer("Info.Timeout.PINIT=5\n")},
      {"A10", kFails, a_log().ask("GET", "Info.Timeout.PINIT").answer("ERROR34")},
  };
}

std::vector<Case> cases_of_ports() {
  const HandWrittenLog one_plug = a_log().ask("PHSR", "02").answer("010A001");
  return {
      {"A11", kHolds, a_log().send("PHSR:01E03E\r").receive("020A01F0B01F3465\r")},
      {"A11", kFails, a_log().ask("PHSR", "00").answer("020A01F0B01")},
      {"A12", kHolds, a_log().ask("PHSR", "02").answer("020A0010B003")},
      {"A12", kFails, a_log().ask("PHSR", "02").answer("010A01F")},
      {"A13", kHolds, a_log().send("PINIT:0AD5EB\r").wait(milliseconds(2500)).receive("ERROR133A42\r")},
      {"A13", kFails, a_log().send("PINIT:0AD5EB\r").wait(seconds(6)).receive("OKAYA896\r")},
      {"A14", kHolds,
       HandWrittenLog(one_plug)
           .ask("PINIT", "0A")
           .answer("OKAY")
           .ask("PHSR", "03")
           .answer("020A01F0B01F")
           .ask("PHINF", "0B0020")
           .answer("00000000000101")},
      {"A14", kFails,
       HandWrittenLog(one_plug)
           .ask("PHINF", "0B0020")
           .answer("00000000000101")
           .ask("PINIT", "0B")
           .answer("OKAY")},
      {"A15", kHolds,
       a_log()
           .ask("PHINF", "0A0021")
           .answer(kTool + "00000000000100")
           .ask("PHINF", "0B0021")
           .answer(kTool + "00000000000101")},
      {"A15", kFails,
       a_log()
           .ask("PHINF", "0A0021")
           .answer(kTool + "00000000000100")
           .ask("PHINF", "0B0021")
           .answer("0200000BNDI         0013C4B000231"
                   "00000000000101")},
      {"A16", kHolds, a_log().ask("PHINF", "0A0001").answer(kTool)},
      {"A16", kFails, a_log().ask("PHINF", "0A0001").answer(kTool + "0")},
      {"A17", kHolds, a_log().ask("TSTART").wait(milliseconds(1400)).answer("OKAY")},
      {"A17", kFails, a_log().ask("TSTOP").wait(seconds(6)).ask("INIT").answer("OKAY")},
  };
}

// The recorded BX reply is a Polaris's, whose layout is the same.
std::vector<Case> cases_of_measurements() {
  const std::string recorded_bx(
      "\xC4\xA5\x37\x00\x3B\x23\x02\x01\x02\x31\x00\x00\x00\x28\x01\x00\x00\x02\x01\x7F\x28\x0F\x3F\x80\x12"
      "\x1D"
      "\x3F\x20\x1D\xC6\x3E\xA2\x80\xCD\x3E\x1C\x78\xB1\xC2\xD8\xD4\x24\x43\xC8\x7F\x09\xC5\xC5\x5F\x0A\x3D"
      "\x31"
      "\x00\x00\x00\x2A\x01\x00\x00\x00\x00\x07\xA1",
      63);
  aurora::HandleReading turned = pose_of(0x0A, 8);
  turned.rotation = {0.8, 0, 0, 0.6};
  // Recorded on firmware Rev 006: nothing was enabled.
  const HandWrittenLog never_enabled = a_log()
                                           .ask("PHSR", "02")
                                           .answer("010A001")
                                           .send("PINIT:0AD5EB\r")
                                           .receive("ERROR133A42\r")
                                           .ask("PHSR", "03")
                                           .receive("001400\r")
                                           .send("TSTART:5423\r")
                                           .receive("OKAYA896\r");
  return {
      {"A18", kHolds, tracking_log()},
      {"A18", kFails, a_log().ask("TSTART").answer("OKAY").ask("BX", "0001").measure({pose_of(0x0A, 8)})},
      {"A19", kHolds, a_log().send("BX:0001C26D\r").receive(recorded_bx)},
      {"A19", kFails, a_log().send("BX:0001C26D\r").receive("\xC4\xA5\x04 not a header\r")},
      {"A20", kHolds, a_log().send("TX:0001031A\r").receive("010ADISABLED\n0000B1B4\r")},
      {"A20", kFails, a_log().send("TX:0001031A\r").answer("010ABROKEN\n0000")},
      {"A21", kHolds,
       HandWrittenLog(never_enabled).send("TX:0001031A\r").receive("010ADISABLED\n0000B1B4\r")},
      {"A21", kFails, HandWrittenLog(never_enabled).ask("BX", "0001").measure({})},
      {"A22", kHolds, a_log().ask("BX", "0001").measure({pose_of(0x0A, 8)})},
      {"A22", kFails, a_log().ask("BX", "0001").measure({turned})},
      {"A23", kHolds, a_log().ask("BX", "0001").measure({pose_of(0x0A, 8), pose_of(0x0B, 8)})},
      {"A23", kFails, a_log().ask("BX", "0001").measure({pose_of(0x0A, 8), pose_of(0x0B, 16)})},
      {"A24", kHolds, tracking_log().track(0xA018, 5, 16)},
      {"A24", kFails, tracking_log().track(0xA018, 5, 1)},
      {"A25", kHolds, tracking_log().track(0xA018, 80)},
      {"A25", kFails, tracking_log().track(0xA018, 80, 16)},
      {"A27", kHolds, a_log().baud(921600).send("BX:0001C26D\r").wait(milliseconds(2)).receive(recorded_bx)},
      {"A27", kFails, a_log().baud(921600).send("BX:0001C26D\r").wait(milliseconds(17)).receive(recorded_bx)},
  };
}

HandWrittenLog polled_fast(std::uint32_t step_every_second_reply, std::uint32_t step_of_the_others) {
  HandWrittenLog log = tracking_log().baud(921600);
  std::uint32_t frame = 0xA018;
  for (int i = 0; i < 60; ++i) {
    log.send("BX:0001C26D\r").measure({pose_of(0x0A, frame)}).wait(milliseconds(2));
    frame += i % 2 == 0 ? step_every_second_reply : step_of_the_others;
  }
  return log;
}

std::vector<Case> cases_of_the_counter() {
  // The pause is 1.98 s: 79 measurements of 8 counts, 633 = 0x279.
  return {
      {"A26", kHolds, polled_fast(8, 0)},
      {"A26", kFails, polled_fast(8, 8)},
      {"A28", kHolds, paused_log("", 0xA050)},
      {"A28", kFails, paused_log("", 0x0008)},
      {"A29", kHolds, paused_log("", 0xA048 + 0x278)},
      {"A29", kFails, paused_log("", 0xA050)},
      {"A30", kHolds, paused_log("80", 0x0008)},
      {"A30", kFails, paused_log("80", 0xA2C0)},
  };
}

std::vector<Case> cases_while_tracking() {
  return {
      {"A31", kHolds, tracking_log().ask("PHSR", "00").answer("ERROR0C")},
      {"A31", kFails, tracking_log().ask("PHSR", "00").answer("010A03F")},
      {"A32", kHolds, tracking_log().ask("PHINF", "0A0001").answer(kTool)},
      {"A32", kFails, tracking_log().ask("PHINF", "0A0001").answer("ERROR0C")},
      {"A33", kHolds, tracking_log().ask("VER", "4").answer("AURORA\n")},
      {"A33", kFails, tracking_log().ask("COMM", "50000").answer("ERROR0C")},
      {"A34", kHolds, tracking_log().ask("PINIT", "0A").answer("ERROR0C")},
      {"A34", kFails, tracking_log().ask("PDIS", "0A").answer("OKAY")},
      {"A35", kHolds, tracking_log().ask("INIT").answer("ERROR0C")},
      {"A35", kFails, tracking_log().ask("INIT").answer("OKAY")},
      {"A36", kHolds, tracking_log().ask("VER", "5").answer_around("013", "VER", "5").answer("013")},
      {"A36", kFails, tracking_log().ask("VER", "5").answer_around("013", "VER", "5").wait(seconds(1))},
      {"A37", kHolds,
       tracking_log()
           .track(0xA018, 2)
           .ask("BX", "0801")
           .measure({without_pose(0x0A, Report::kDisabled)}, 0x80)},
      {"A37", kFails,
       tracking_log().track(0xA018, 2).ask("BX", "0801").measure({pose_of(0x0A, 0xA028)}, 0x80)},
      {"A38", kHolds,
       tracking_log()
           .ask("BX", "0801")
           .measure({}, 0xC0)
           .ask("TSTOP")
           .answer("OKAY")
           .ask("PHSR", "02")
           .answer("010B001")},
      {"A38", kFails,
       tracking_log()
           .ask("BX", "0801")
           .measure({}, 0xC0)
           .ask("TSTOP")
           .answer("OKAY")
           .ask("PHSR", "02")
           .answer("00")},
  };
}

std::vector<Case> all_cases() {
  std::vector<Case> all;
  for (const auto& cases : {cases_of_the_line(), cases_of_ports(), cases_of_measurements(),
                            cases_of_the_counter(), cases_while_tracking()}) {
    all.insert(all.end(), cases.begin(), cases.end());
  }
  return all;
}

TEST(AuroraAssumptions, HoldOrDoNotAsTheConversationSays) {
  for (const Case& one : all_cases()) {
    const Judgement judgement = judgement_of(one.id, one.log.conversation());
    EXPECT_EQ(name_of(judgement.verdict), name_of(one.verdict)) << one.id << ": " << judgement.evidence;
    EXPECT_TRUE(judgement.time.has_value()) << one.id;
    EXPECT_FALSE(judgement.evidence.empty()) << one.id;
  }
}

TEST(AuroraAssumptions, AllHaveAConversationInWhichTheyHoldAndOneInWhichTheyDoNot) {
  std::map<std::string, std::set<AssumptionVerdict>> seen;
  for (const Case& one : all_cases()) {
    seen[one.id].insert(one.verdict);
  }
  for (const Assumption& assumption : aurora_assumptions()) {
    EXPECT_EQ(seen[assumption.id].size(), 2U) << assumption.id;
  }
}

TEST(AuroraAssumptions, AreNotTriedByAnEmptyLogAndSayWhatWouldTryThem) {
  for (const JudgedAssumption& one : judge_assumptions({})) {
    EXPECT_EQ(one.judgement.verdict, AssumptionVerdict::kNotTried) << one.assumption->id;
    EXPECT_FALSE(one.judgement.time.has_value()) << one.assumption->id;
    EXPECT_FALSE(one.judgement.evidence.empty()) << one.assumption->id;
  }
}

TEST(AuroraAssumptions, QuoteTheBytesOfTheEvidence) {
  const Judgement judgement =
      judgement_of("A6", a_log().wait(seconds(3)).ask("COMM", "A0000").answer("ERROR06").conversation());
  EXPECT_EQ(judgement.evidence, "> COMM:A00000BF8 < ERROR06");
  EXPECT_EQ(judgement.time, milliseconds(3050));
}

TEST(AuroraAssumptions, TakeAMeasurementApartInTheEvidence) {
  const Judgement judgement =
      judgement_of("A18", a_log()
                              .ask("TSTART")
                              .answer("OKAY")
                              .ask("BX", "0001")
                              .measure({pose_of(0x0A, 8), without_pose(0x0B, Report::kDisabled)}, 0x40)
                              .conversation());
  EXPECT_EQ(judgement.evidence, "0 of 1: > BX:0001C26D < 0A pose 00000008, 0B DISABLED, status 0040");
}

TEST(AuroraAssumptions, NameTheTrackerByWhatItSays) {
  const HandWrittenLog log =
      a_log().ask("VER", "4").answer("Freeze Tag: AURORA Rev 006\n").ask("APIREV").answer("D.001.005");
  EXPECT_EQ(tracker_name(log.conversation()), "AURORA Rev 006, API D.001.005");
  EXPECT_EQ(tracker_name({}), "firmware not said");
}

TEST(AuroraAssumptions, StandInTheReadmeWordForWord) {
  std::ostringstream text;
  text << std::ifstream(TUBED_SOURCE_DIR "/drivers/aurora/README.md").rdbuf();
  const std::string readme = text.str();
  for (const Assumption& one : aurora_assumptions()) {
    const std::string row = std::string("| ") + one.id + " | " + one.text + " | " + one.known_by + " |";
    EXPECT_NE(readme.find(row), std::string::npos) << row;
  }
  EXPECT_EQ(readme.find("| A" + std::to_string(aurora_assumptions().size() + 1) + " |"), std::string::npos);
}

TEST(AuroraAssumptions, FitTheTerminalTheyAreShownIn) {
  const auto judged = judge_assumptions(paused_log("80", 8).conversation());
  for (const int width : {60, 80, 110, 120, 200}) {
    std::istringstream table(assumption_table(judged, width));
    std::size_t longest = 0;
    for (std::string line; std::getline(table, line);) {
      longest = std::max(longest, line.size());
    }
    EXPECT_LE(longest, static_cast<std::size_t>(width));
    EXPECT_GE(longest, static_cast<std::size_t>(width) * 2 / 3);
  }
}

TEST(AuroraAssumptions, AreCountedAtTheEndOfTheTable) {
  const auto judged = judge_assumptions(a_log().ask("COMM", "A0000").answer("ERROR06").conversation());
  const std::string table = assumption_table(judged, 120);
  EXPECT_NE(table.find("\n2 hold; 1 do not hold: A6; 35 not tried: A2 A4"), std::string::npos) << table;
  const auto json = nlohmann::json::parse(assumption_json(judged, "some tracker"));
  EXPECT_EQ(json["tracker"], "some tracker");
  EXPECT_EQ(json["holds"], 2);
  EXPECT_EQ(json["assumptions"][5]["verdict"], "does not hold");
  EXPECT_EQ(json["assumptions"][5]["evidence"], "> COMM:A00000BF8 < ERROR06");
  EXPECT_TRUE(json["assumptions"][6]["time_s"].is_null());
}

}  // namespace
}  // namespace tubed
