#include <gtest/gtest.h>

#include <random>

#include "tests/second_aurora/scripted_host.hpp"

namespace tubed::second_aurora {
namespace {

TEST(SecondAuroraLine, PowerOnAndBreakAreAnsweredWithReset) {
  ScriptedHost host(with_coils({1}));
  EXPECT_EQ(host.ask("INIT:"), "OKAY");
  host.heard.clear();
  host.device.serial_break(host.now_ns);
  host.listen(1290 * kMillisecond_ns);
  EXPECT_TRUE(host.heard.empty());
  host.listen(30 * kMillisecond_ns);
  EXPECT_EQ(host.heard, framed("RESET"));
  EXPECT_EQ(host.ask("PHSR:00"), "ERROR10");
}

TEST(SecondAuroraLine, CommIsAnsweredAtTheOldRateAndFollowedByTheNew) {
  ScriptedHost host(with_coils({1}));
  ASSERT_EQ(host.ask("COMM:50000"), "OKAY");
  host.listen(20 * kMillisecond_ns);
  host.baud = 115200;
  EXPECT_EQ(host.ask("INIT:"), "OKAY");
  EXPECT_EQ(host.ask("COMM:A0000"), "ERROR06");
  EXPECT_EQ(host.ask("COMM:5000"), "ERROR07");
}

TEST(SecondAuroraLine, WhoListensAtAnotherRateHearsNoiseAndIsHeardAsNoise) {
  ScriptedHost host(with_coils({1}));
  host.send("INIT \r");
  host.now_ns += 200 * kMillisecond_ns;
  host.device.speak(host.now_ns, 115200, host.heard);
  EXPECT_FALSE(host.heard.empty());
  EXPECT_NE(host.heard, framed("OKAY"));
  host.baud = 19200;
  EXPECT_EQ(host.ask("INIT:").substr(0, 7), "damaged");
}

TEST(SecondAuroraLine, EveryByteTakesTenBits) {
  Settings settings = with_coils({1});
  settings.timing.latency_timer_ns = 0;
  ScriptedHost host(settings);
  host.send("ECHO 0123456789\r");
  // 16 bytes there, other_ns, then 15 bytes back: 1.0417 ms each at 9600.
  const std::int64_t first_ns = 17 * 1'041'667 + settings.timing.other_ns;
  host.listen(first_ns - 10'000);
  EXPECT_EQ(host.heard.size(), 0u);
  host.listen(20'000);
  EXPECT_EQ(host.heard.size(), 1u);
  host.listen(14 * 1'041'667);
  EXPECT_EQ(host.heard.size(), 15u);
}

TEST(SecondAuroraLine, ALatencyTimerHandsOverPackets) {
  Settings settings = with_coils({1});
  settings.timing.latency_timer_ns = 16 * kMillisecond_ns;
  ScriptedHost host(settings);
  host.ask("COMM:50000");
  host.listen(20 * kMillisecond_ns);
  host.baud = 115200;
  host.now_ns = host.now_ns / settings.timing.latency_timer_ns * settings.timing.latency_timer_ns +
                16 * kMillisecond_ns;
  host.heard.clear();
  host.send("ECHO 0123456789\r");
  host.listen(15 * kMillisecond_ns);
  EXPECT_TRUE(host.heard.empty());
  host.listen(kMillisecond_ns);
  EXPECT_EQ(host.heard.size(), 15u);
  // 6.6 ms there, 5 ms of work, and the 62nd byte is out 5.4 ms later, before the timer's tick.
  host.listen(6 * kMillisecond_ns);
  host.heard.clear();
  host.send("ECHO " + std::string(70, 'x') + "\r");
  host.listen(17'100'000);
  EXPECT_EQ(host.heard.size(), 62u);
  host.listen(8'900'000);
  EXPECT_EQ(host.heard.size(), 75u);
}

TEST(SecondAuroraLine, CommandsSentTooEarlyAreAnsweredInOrder) {
  for (const bool works_ahead : {true, false}) {
    Settings settings = with_coils({1});
    settings.firmware.works_ahead_while_sending = works_ahead;
    ScriptedHost host(settings);
    host.send("INIT \rECHO one\rECHO two\r");
    host.listen(300 * kMillisecond_ns);
    const std::string text(host.heard.begin(), host.heard.end());
    EXPECT_EQ(text, "OKAYA896\rone" + hex(crc16("one"), 4) + "\rtwo" + hex(crc16("two"), 4) + "\r");
  }
}

TEST(SecondAuroraLine, StepsTakeWhatTheyTakeOnARealDevice) {
  ScriptedHost host(with_coils({1}));
  const auto duration_s = [&host](const char* command) {
    const std::int64_t before_ns = host.now_ns;
    EXPECT_EQ(host.ask(command), "OKAY") << command;
    return 1e-9 * static_cast<double>(host.now_ns - before_ns);
  };
  // 10 bytes there and 9 back take 20 ms.
  EXPECT_NEAR(duration_s("INIT:"), 0.07, 0.005);
  EXPECT_NEAR(duration_s("PINIT:0A"), 2.55, 0.05);
  EXPECT_NEAR(duration_s("PINIT:0A"), 0.14, 0.05);
  EXPECT_NEAR(duration_s("TSTART:"), 1.7, 0.35);
  EXPECT_NEAR(duration_s("TSTOP:"), 0.34, 0.05);
}

TEST(SecondAuroraLine, APulledCableLosesBytesAndKeepsTheState) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  // On its way when the cable comes out.
  host.send("TSTOP \r");
  host.device.hang_up(host.now_ns, kSecond_ns);
  EXPECT_FALSE(host.device.connected(host.now_ns));
  host.send("TSTOP \r");
  host.listen(kSecond_ns);
  EXPECT_TRUE(host.device.connected(host.now_ns));
  EXPECT_TRUE(host.device.tracking());
  EXPECT_EQ(host.ask("TSTOP:"), "OKAY");
}

TEST(SecondAuroraLine, APowerCycleTakesThePortAwayAndForgetsEverything) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  host.heard.clear();
  host.device.power_cycle(host.now_ns, 2 * kSecond_ns);
  EXPECT_FALSE(host.device.connected(host.now_ns));
  host.listen(2 * kSecond_ns);
  EXPECT_TRUE(host.device.connected(host.now_ns));
  EXPECT_TRUE(host.heard.empty());
  host.listen(3 * kSecond_ns + 20 * kMillisecond_ns);
  EXPECT_EQ(host.heard, framed("RESET"));
  EXPECT_EQ(host.ask("TX:0001"), "ERROR0C");
}

TEST(SecondAuroraLine, ABreakEndsWhateverRubbishWasSent) {
  ScriptedHost host(with_coils({2, 1}));
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    std::string rubbish = "TSTART \rPENA 0A";
    for (std::size_t i = random() % 400; i > 0; --i) {
      rubbish += static_cast<char>(random());
    }
    host.baud = random() % 2 == 0 ? 9600 : 115200;
    host.send(rubbish);
    host.listen(static_cast<std::int64_t>(random() % 50) * kMillisecond_ns);
    ASSERT_GT(host.device.next_event_ns(), host.now_ns);
  }
  host.device.serial_break(host.now_ns);
  host.baud = 9600;
  host.listen(1400 * kMillisecond_ns);
  EXPECT_EQ(host.ask("INIT:"), "OKAY");
}

TEST(SecondAuroraLine, NothingIsDueWhenNobodyAsked) {
  ScriptedHost host(with_coils({1}));
  host.start_tracking();
  EXPECT_EQ(host.device.next_event_ns(), INT64_MAX);
}

}  // namespace
}  // namespace tubed::second_aurora
