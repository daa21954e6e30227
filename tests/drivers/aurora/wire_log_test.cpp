// The trace ring and the text it is written as.
#include "drivers/aurora/wire_log.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tubed::aurora {
namespace {

using namespace std::chrono_literals;

std::vector<std::string> notes_of(const WireTrace& trace) {
  std::vector<std::string> notes;
  trace.each([&](const WireRecord& record) { notes.emplace_back(as_text(record.bytes)); });
  return notes;
}

TEST(WireTrace, KeepsWhatHappenedInItsOrder) {
  WireTrace trace(4096);
  trace.baud_rate(from_ns(1), 9600);
  trace.serial_break(from_ns(2));
  trace.sent(from_ns(3), as_bytes("INIT:E3A5\r"));
  trace.received(from_ns(4), as_bytes("OKAYA896\r"));
  std::vector<WireEvent> events;
  trace.each([&](const WireRecord& record) { events.push_back(record.event); });
  EXPECT_EQ(events, (std::vector<WireEvent>{WireEvent::kBaudRate, WireEvent::kBreak, WireEvent::kSent,
                                            WireEvent::kReceived}));
}

TEST(WireTrace, ForgetsTheOldestAndNothingElse) {
  std::mt19937 random(5);
  WireTrace trace(4096);
  std::vector<std::string> all;
  for (int i = 0; i < 5000; ++i) {
    std::string note = std::to_string(i) + std::string(random() % 900, 'x');
    all.push_back(note);
    trace.note(from_ns(i), note);
    const std::vector<std::string> kept = notes_of(trace);
    ASSERT_EQ(kept.size() + trace.forgotten(), all.size());
    ASSERT_TRUE(std::equal(kept.rbegin(), kept.rend(), all.rbegin())) << i;
    ASSERT_GE(kept.size(), i == 0 ? 1U : 2U);
  }
}

TEST(WireTrace, UsesMostOfItsRoom) {
  WireTrace trace(1U << 16U);
  for (int i = 0; i < 10000; ++i) {
    trace.sent(from_ns(i), as_bytes("BX:0801 00EC\r"));
  }
  EXPECT_EQ(trace.count(), (1U << 16U) / 32);
}

TEST(WireTrace, KeepsAVeryLongReceptionInPieces) {
  WireTrace trace(1U << 14U);
  const std::vector<std::uint8_t> bytes(5000, 0x55);
  trace.received(from_ns(1), bytes);
  std::size_t kept = 0;
  trace.each([&](const WireRecord& record) { kept += record.bytes.size(); });
  EXPECT_EQ(kept, bytes.size());
}

TEST(WireLog, LooksLikeTheExampleOfTheReadme) {
  WireTrace trace(4096);
  const auto began = from_ns(1'000'000'000);
  trace.baud_rate(began, 9600);
  trace.serial_break(began + 412us);
  trace.received(began + 1302117us, as_bytes("RESETBE6F\r"));
  trace.sent(began + 1302500us, as_bytes("APIREV "));
  trace.received(began + 2s, std::vector<std::uint8_t>{0xC4, 0xA5, 0x5C, 0x0A, 0x20});
  trace.note(began + 3s, "tracking");
  EXPECT_EQ(format_wire_trace(trace, "an example"),
            "tubed wire log 1\n"
            "# an example\n"
            "# time 0 is CLOCK_MONOTONIC 1000000000 ns\n"
            "0.000000 baud 9600\n"
            "0.000412 break\n"
            "1.302117 < RESETBE6F\\r\n"
            "1.302500 > APIREV\\x20\n"
            "2.000000 < \\xC4\\xA5\\\\\\n\\x20\n"
            "3.000000 note tracking\n");
}

TEST(WireLog, IsReadAsItWasWritten) {
  std::mt19937 random(7);
  WireLog log;
  log.header = {"first", "second"};
  for (int i = 0; i < 300; ++i) {
    WireLogEntry entry;
    entry.time = std::chrono::microseconds(random());
    entry.event = static_cast<WireEvent>(i % 5);
    if (entry.event == WireEvent::kBaudRate) {
      entry.bits_per_second = static_cast<int>(random() % 1'000'000);
    } else if (entry.event == WireEvent::kNote) {
      entry.note = "n" + std::to_string(random());
    } else if (entry.event != WireEvent::kBreak) {
      entry.bytes.resize(1 + random() % 3000);
      std::generate(entry.bytes.begin(), entry.bytes.end(),
                    [&] { return static_cast<std::uint8_t>(random()); });
    }
    log.entries.push_back(entry);
  }
  const auto read = parse_wire_log(format_wire_log(log));
  ASSERT_TRUE(std::holds_alternative<WireLog>(read));
  EXPECT_EQ(std::get<WireLog>(read).header, log.header);
  EXPECT_EQ(std::get<WireLog>(read).entries, log.entries);
}

TEST(WireLog, MayHaveCommentsAndEmptyLinesAnywhere) {
  const auto read = parse_wire_log("tubed wire log 1\n\n#\n0 > A\\r\n# in between\n\n1.5 < B\\r");
  ASSERT_TRUE(std::holds_alternative<WireLog>(read));
  EXPECT_EQ(std::get<WireLog>(read).entries.size(), 2U);
  EXPECT_EQ(std::get<WireLog>(read).entries[1].time, 1500ms);
}

struct BadLog {
  const char* text;
  int line;
};

class BadWireLog : public testing::TestWithParam<BadLog> {};

TEST_P(BadWireLog, IsRefusedWithItsLine) {
  const auto read = parse_wire_log(GetParam().text);
  ASSERT_TRUE(std::holds_alternative<WireLogFault>(read)) << GetParam().text;
  EXPECT_EQ(std::get<WireLogFault>(read).line, GetParam().line);
  EXPECT_FALSE(std::get<WireLogFault>(read).why.empty());
}

INSTANTIATE_TEST_SUITE_P(
    All, BadWireLog,
    testing::Values(BadLog{"", 1}, BadLog{"tubed wire log 2\n", 1}, BadLog{"tubed wire log 1\nx > A", 2},
                    BadLog{"tubed wire log 1\n0 > A\n-1 > A", 3}, BadLog{"tubed wire log 1\n1. = A", 2},
                    BadLog{"tubed wire log 1\n1 baud fast", 2}, BadLog{"tubed wire log 1\n1 > A\\", 2},
                    BadLog{"tubed wire log 1\n1 > A\\xA", 2}, BadLog{"tubed wire log 1\n1 > A\\t", 2}));

}  // namespace
}  // namespace tubed::aurora
