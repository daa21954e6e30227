// A bring-up of the emulated Aurora in virtual time. What the emulated one assumes itself is not asserted:
// that a conversation is recorded, read back, and left in order.
#include "clients/tubectl/check/aurora_bringup.hpp"

#include <gtest/gtest.h>

#include <random>

#include "clients/tubectl/check/anonymous_wire_log.hpp"
#include "clients/tubectl/check/aurora_assumptions.hpp"
#include "drivers/aurora/wire_log.hpp"
#include "tests/clients/tubectl/hand_written_log.hpp"
#include "tests/drivers/aurora_serial/emulated_line.hpp"

namespace tubed {
namespace {

using aurora::emulator::Device;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// An emulated tracker, a line to it, and a person who does what `on_progress` does.
class Bench {
 public:
  Device device{aurora::emulator::DeviceSettings{}, aurora::circling(8), aurora::kPowerOn};
  aurora::EmulatedLine line{device};
  BringupSettings settings{seconds(4), false, seconds(5)};
  std::function<void(const std::string& progress)> on_progress = [](const std::string&) {};
  std::function<bool()> interrupted = [] { return false; };
  std::string said;

  BringupEnd run() {
    AuroraBringup bringup(line, settings,
                          {[this](std::string_view words) {
                             said += std::string(words) + "\n";
                             on_progress(std::string(words));
                           },
                           interrupted, [] { return false; }});
    const BringupEnd end = bringup.run();
    text = aurora::format_wire_trace(bringup.trace(), "test");
    return end;
  }
  [[nodiscard]] aurora::WireLog log() const {
    return std::get<aurora::WireLog>(aurora::parse_wire_log(text));
  }
  [[nodiscard]] AssumptionVerdict verdict(const std::string& id) const {
    for (const JudgedAssumption& one : judge_assumptions(read_conversation(log()))) {
      if (one.assumption->id == id) {
        return one.judgement.verdict;
      }
    }
    throw std::runtime_error("no assumption " + id);
  }

  std::string text;
};

/// All that came from the tracker: a log has it in the pieces in which it was read.
std::string received(const aurora::WireLog& log) {
  std::string bytes;
  for (const aurora::WireLogEntry& entry : log.entries) {
    if (entry.event == aurora::WireEvent::kReceived) {
      bytes.append(entry.bytes.begin(), entry.bytes.end());
    }
  }
  return bytes;
}

TEST(AuroraBringup, TriesNearlyEverythingAndLeavesTheTrackerAsItComesFromTheSwitch) {
  Bench bench;
  ASSERT_EQ(bench.run(), BringupEnd::kDone);
  EXPECT_FALSE(bench.device.tracking());
  EXPECT_EQ(bench.device.link().rate, aurora::BaudRate::k9600);
  EXPECT_EQ(bench.line.rate, 9600);
  for (const JudgedAssumption& one : judge_assumptions(read_conversation(bench.log()))) {
    const std::string id = one.assumption->id;
    const bool needs_a_person = id == "A37" || id == "A38";
    EXPECT_EQ(one.judgement.verdict == AssumptionVerdict::kNotTried, needs_a_person)
        << id << ": " << one.judgement.evidence;
  }
}

TEST(AuroraBringup, WritesALogThatReadsBackToTheSameTable) {
  Bench bench;
  bench.run();
  const aurora::WireLog log = bench.log();
  const auto again = std::get<aurora::WireLog>(aurora::parse_wire_log(aurora::format_wire_log(log)));
  EXPECT_EQ(again.entries, log.entries);
  EXPECT_EQ(assumption_table(judge_assumptions(read_conversation(again)), 100),
            assumption_table(judge_assumptions(read_conversation(log)), 100));
  EXPECT_NE(bench.text.find("note step: counter over TSTOP and TSTART"), std::string::npos);
}

TEST(AuroraBringup, TakesAboutAMinuteWithThreePlugsWhoseMemoryIsRead) {
  Bench bench;
  aurora::emulator::DeviceSettings slow;
  slow.durations.pinit = milliseconds(2500);
  Device device(slow, aurora::circling(8), aurora::kPowerOn);
  aurora::EmulatedLine line(device);
  AuroraBringup bringup(line, {}, {[](std::string_view) {}, [] { return false; }, [] { return false; }});
  ASSERT_EQ(bringup.run(), BringupEnd::kDone);
  EXPECT_GT(line.time - aurora::kPowerOn, seconds(30));
  EXPECT_LT(line.time - aurora::kPowerOn, seconds(75));
}

TEST(AuroraBringup, EndsWhereverItIsInterruptedAndPutsTheLinkBack) {
  for (int commands = 0; commands < 400; commands += 23) {
    Bench bench;
    int left = commands;
    bench.interrupted = [&left] { return left-- <= 0; };
    EXPECT_EQ(bench.run(), BringupEnd::kInterrupted) << commands;
    EXPECT_FALSE(bench.device.tracking()) << commands;
    EXPECT_EQ(bench.device.link().rate, aurora::BaudRate::k9600) << commands;
    EXPECT_EQ(bench.text.find(" > ") == std::string::npos, commands == 0) << commands;
  }
}

TEST(AuroraBringup, AsksAPersonForPlugsAndSeesThem) {
  Bench bench;
  bench.settings.interactive = true;
  bench.on_progress = [&](const std::string& words) {
    if (words.starts_with(">>> unplug")) {
      bench.device.ports().pull_out(1);
    } else if (words.starts_with(">>> plug it in")) {
      bench.device.ports().plug_in(1);
    }
  };
  ASSERT_EQ(bench.run(), BringupEnd::kDone);
  EXPECT_EQ(bench.verdict("A37"), AssumptionVerdict::kHolds);
  EXPECT_EQ(bench.verdict("A38"), AssumptionVerdict::kHolds);
  EXPECT_NE(bench.said.find("left out"), std::string::npos);  // nobody plugged in another tool
  EXPECT_FALSE(bench.device.tracking());
}

TEST(AuroraBringup, GivesUpOnATrackerThatDoesNotAnswer) {
  Bench bench;
  bench.line.replace = {"INIT", ""};
  EXPECT_EQ(bench.run(), BringupEnd::kNoTracker);
  EXPECT_FALSE(bench.log().entries.empty());
  EXPECT_EQ(bench.verdict("A6"), AssumptionVerdict::kNotTried);
}

TEST(AuroraBringup, StopsWhenTheTrackerFallsSilent) {
  Bench bench;
  bench.on_progress = [&](const std::string& words) {
    if (words.starts_with("measuring")) {
      bench.device.power_cycle(bench.line.time, std::chrono::hours(1));
    }
  };
  EXPECT_EQ(bench.run(), BringupEnd::kNoTracker);
  EXPECT_LT(bench.line.time - aurora::kPowerOn, seconds(120));
}

TEST(AuroraBringup, StopsWhenThePortGoes) {
  Bench bench;
  bench.on_progress = [&](const std::string& words) {
    if (words.starts_with("measuring")) {
      bench.device.hang_up(bench.line.time, std::chrono::hours(1));
    }
  };
  EXPECT_EQ(bench.run(), BringupEnd::kPortGone);
  EXPECT_FALSE(bench.log().entries.empty());
}

TEST(AuroraBringup, IsJudgedHoweverItsLogIsCutOrDamaged) {
  Bench bench;
  bench.settings.measuring = milliseconds(500);
  bench.run();
  std::mt19937 random(1);
  for (int i = 0; i < 60; ++i) {
    std::string text = bench.text.substr(0, random() % bench.text.size());
    for (int damage = 0; damage < i % 3 && !text.empty(); ++damage) {
      text[random() % text.size()] = static_cast<char>(random() % 256);
    }
    const auto parsed = aurora::parse_wire_log(text);
    if (const auto* const fault = std::get_if<aurora::WireLogFault>(&parsed)) {
      EXPECT_GE(fault->line, 1);
      EXPECT_FALSE(fault->why.empty());
    } else {
      const auto judged = judge_assumptions(read_conversation(std::get<aurora::WireLog>(parsed)));
      EXPECT_EQ(judged.size(), aurora_assumptions().size());
      EXPECT_FALSE(assumption_json(judged, "").empty());
    }
  }
}

TEST(AnonymousWireLog, HasNoSerialNumberAndTheSameReplies) {
  Bench bench;
  bench.settings.measuring = milliseconds(500);
  bench.run();
  const aurora::WireLog log = bench.log();
  ASSERT_NE(received(log).find("3C4B0001"), std::string::npos);
  const aurora::WireLog anonymous = without_serial_numbers(log);
  EXPECT_EQ(received(anonymous).find("3C4B000"), std::string::npos);
  const WireConversation before = read_conversation(log);
  const WireConversation after = read_conversation(anonymous);
  EXPECT_EQ(after.damaged, before.damaged);
  EXPECT_EQ(after.replies, before.replies);
  ASSERT_EQ(after.turns.size(), before.turns.size());
  for (std::size_t i = 0; i < after.turns.size(); ++i) {
    EXPECT_EQ(after.turns[i].reply.has_value(), before.turns[i].reply.has_value());
  }
}

TEST(AnonymousWireLog, BlanksVersionTextsAndAnswersThatCameDamaged) {
  const aurora::WireLog log = HandWrittenLog()
                                  .ask("VER", "7")
                                  .answer("AURORA Field Generator\nSerial Number: PFG-00471\nDate: 2009\n")
                                  .ask("PHINF", "0A0001")
                                  .receive("0200000BNDI         0013C4B000131FFFF\r")  // a wrong check sum
                                  .log();
  const aurora::WireLog anonymous = without_serial_numbers(log);
  const WireConversation after = read_conversation(anonymous);
  ASSERT_TRUE(after.turns[0].reply.has_value());
  EXPECT_EQ(after.turns[0].reply->payload, "AURORA Field Generator\nSerial Number: 000-00000\nDate: 2009\n");
  EXPECT_EQ(received(anonymous).find("3C4B"), std::string::npos);
  EXPECT_EQ(received(anonymous).size(), received(log).size());
}

}  // namespace
}  // namespace tubed
