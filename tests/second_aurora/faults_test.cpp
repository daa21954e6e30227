#include <gtest/gtest.h>

#include <set>

#include "tests/second_aurora/scripted_host.hpp"

namespace tubed::second_aurora {
namespace {

Fault once(FaultKind kind, std::int64_t duration_ns = 0, int parameter = 0) {
  return {.kind = kind, .next = 1, .duration_ns = duration_ns, .parameter = parameter};
}

std::uint32_t frame_of(const std::string& text) {
  return from_hex(text.substr(text.size() - 13, 8)).value_or(1);
}

class SecondAuroraFaults : public testing::Test {
 protected:
  SecondAuroraFaults() : host(with_coils({1})) {
    host.start_tracking();
    good = host.ask_binary("BX:0801");
  }
  // The next BX reply with this fault, and the test that exactly one fault struck.
  Bytes struck(const Fault& fault) {
    host.device.strike(fault, host.now_ns);
    const Bytes reply = host.ask_binary("BX:0801");
    EXPECT_EQ(host.device.counts().of(fault.kind), 1u);
    return reply;
  }
  ScriptedHost host;
  Bytes good;
};

TEST_F(SecondAuroraFaults, AWrongBodyKeepsTheHeaderAndIsFoundByTheCrc) {
  const Bytes reply = struck(once(FaultKind::BodyCrcWrong));
  ASSERT_EQ(reply.size(), good.size());
  EXPECT_EQ(crc16(std::span(reply).first(6)), 0);
  EXPECT_NE(crc16(reply), 0);
  EXPECT_EQ(crc16(host.ask_binary("BX:0801")), 0);
}

TEST_F(SecondAuroraFaults, AWrongHeaderCrcLeavesTheBodyWhole) {
  const Bytes reply = struck(once(FaultKind::HeaderCrcWrong));
  EXPECT_NE(crc16(std::span(reply).first(6)), 0);
  EXPECT_EQ(crc16(std::span(reply).subspan(6)), 0);
}

TEST_F(SecondAuroraFaults, AWrongLengthHasARightHeaderCrc) {
  const Bytes reply = struck(once(FaultKind::LengthWrong));
  EXPECT_EQ(reply.size(), good.size());
  EXPECT_NE(reply[2], good[2]);
  EXPECT_EQ(crc16(std::span(reply).first(6)), 0);
}

TEST_F(SecondAuroraFaults, TruncatedDroppedAndNoReplyAreShorter) {
  EXPECT_LT(struck(once(FaultKind::Truncated)).size(), good.size());
  EXPECT_EQ(struck(once(FaultKind::ByteDropped)).size(), good.size() - 1);
  EXPECT_EQ(struck(once(FaultKind::NoReply)).size(), 0u);
}

TEST_F(SecondAuroraFaults, NoiseComesBeforeAWholeReply) {
  const Bytes reply = struck(once(FaultKind::NoiseBefore, 0, 3));
  ASSERT_EQ(reply.size(), good.size() + 3);
  EXPECT_EQ(crc16(std::span(reply).subspan(3)), 0);
}

TEST_F(SecondAuroraFaults, AnErrorComesInTextInsteadOfBinary) {
  EXPECT_EQ(struck(once(FaultKind::ErrorInstead, 0, 0x05)), framed("ERROR05"));
}

TEST_F(SecondAuroraFaults, ADuplicateComesBehindTheReply) {
  Bytes reply = struck(once(FaultKind::Duplicated));
  host.listen(kSecond_ns);
  reply = host.heard;
  ASSERT_EQ(reply.size(), 2 * good.size());
  EXPECT_TRUE(std::equal(reply.begin(), reply.begin() + static_cast<std::ptrdiff_t>(good.size()),
                         reply.begin() + static_cast<std::ptrdiff_t>(good.size())));
}

TEST_F(SecondAuroraFaults, AStaleReplyIsThePreviousOneAgain) {
  EXPECT_EQ(struck(once(FaultKind::Stale)), good);
  EXPECT_NE(host.ask_binary("BX:0801"), good);
}

TEST_F(SecondAuroraFaults, LateRepliesAndPausesTakeTheirTime) {
  std::int64_t before_ns = host.now_ns;
  EXPECT_EQ(struck(once(FaultKind::Late, 150 * kMillisecond_ns)).size(), good.size());
  EXPECT_GT(host.now_ns - before_ns, 150 * kMillisecond_ns);
  before_ns = host.now_ns;
  EXPECT_EQ(struck(once(FaultKind::PauseInside, 90 * kMillisecond_ns)).size(), good.size());
  EXPECT_GT(host.now_ns - before_ns,
            90 * kMillisecond_ns + static_cast<std::int64_t>(good.size()) * 1'041'667);
}

TEST_F(SecondAuroraFaults, TextCanAnswerBinary) {
  const Bytes reply = struck(once(FaultKind::TextForBinary));
  EXPECT_EQ(std::string(reply.begin(), reply.begin() + 4), "010A");
}

TEST_F(SecondAuroraFaults, ResetHangUpAndPowerCycleComeInsteadOfAReply) {
  EXPECT_EQ(struck(once(FaultKind::HangUp, 500 * kMillisecond_ns)).size(), 0u);
  EXPECT_TRUE(host.device.tracking());
  EXPECT_EQ(struck(once(FaultKind::SpontaneousReset)).size(), 0u);
  host.listen(kSecond_ns);
  EXPECT_EQ(host.heard, framed("RESET"));
  host.start_tracking();
  EXPECT_EQ(struck(once(FaultKind::PowerCycle, 2 * kSecond_ns)).size(), 0u);
  EXPECT_FALSE(host.device.connected(host.now_ns));
}

TEST_F(SecondAuroraFaults, ACoilCanBeMissingForAWhile) {
  host.device.strike(once(FaultKind::CoilMissing, kSecond_ns), host.now_ns);
  host.listen(100 * kMillisecond_ns);
  EXPECT_EQ(host.ask("TX:0801").substr(4, 7), "MISSING");
  host.listen(kSecond_ns);
  EXPECT_EQ(host.ask("TX:0801").substr(4, 2), "+1");
}

TEST_F(SecondAuroraFaults, ACoilCanLeaveTheVolumeOrBreakForOneMeasurement) {
  const auto states = [this](FaultKind kind) {
    host.truths.clear();
    host.device.strike(once(kind), host.now_ns);
    host.listen(100 * kMillisecond_ns);
    std::vector<CoilState> seen;
    for (const auto& [frame, truth] : host.truths) {
      seen.push_back(truth.coils.at(0).state);
    }
    return seen;
  };
  const std::vector<CoilState> outside = states(FaultKind::CoilOutOfVolume);
  EXPECT_EQ(outside.at(0), CoilState::OutOfVolume);
  EXPECT_EQ(outside.at(1), CoilState::Valid);
  EXPECT_EQ(states(FaultKind::CoilBroken).at(0), CoilState::Broken);
}

TEST(SecondAuroraFaultNames, EveryKindHasItsOwn) {
  EXPECT_EQ(kFaultNames[static_cast<std::size_t>(FaultKind::CounterJumps)], "counter_jumps");
  EXPECT_EQ(kFaultNames[static_cast<std::size_t>(FaultKind::CoilMissing)], "coil_missing");
  EXPECT_EQ(std::set<std::string_view>(kFaultNames.begin(), kFaultNames.end()).size(), kFaultKinds);
}

TEST_F(SecondAuroraFaults, StuckPosesKeepTheirTrueTimeWhileTheCounterRuns) {
  host.device.strike(once(FaultKind::PosesStuck, kSecond_ns), host.now_ns);
  host.listen(100 * kMillisecond_ns);
  const std::string first = host.ask("TX:0801");
  host.listen(300 * kMillisecond_ns);
  const std::string second = host.ask("TX:0801");
  EXPECT_EQ(first.substr(4, 51), second.substr(4, 51));
  ASSERT_NE(frame_of(first), frame_of(second));
  const Truth& truth = host.truths[frame_of(second)];
  EXPECT_EQ(truth.coils[0].pose_time_ns, host.truths[frame_of(first)].coils[0].pose_time_ns);
  EXPECT_GT(truth.time_ns - truth.coils[0].pose_time_ns, 300 * kMillisecond_ns);
}

TEST_F(SecondAuroraFaults, ACounterThatStandsSurvivesARestartOfTracking) {
  host.device.strike(once(FaultKind::CounterStands, 12 * kSecond_ns), host.now_ns);
  host.listen(100 * kMillisecond_ns);
  const std::string standing = host.ask("TX:0801");
  const std::uint64_t measured = host.device.counts().measurements;
  host.ask("TSTOP:");
  host.ask("TSTART:80");
  EXPECT_EQ(host.ask("TX:0801").substr(4, 7), "MISSING");
  host.listen(kSecond_ns);
  EXPECT_EQ(host.ask("TX:0801"), standing);
  EXPECT_EQ(host.device.counts().measurements, measured);
  host.listen(12 * kSecond_ns);
  const std::string after = host.ask("TX:0801");
  EXPECT_NE(after, standing);
  EXPECT_TRUE(host.truths.contains(frame_of(after)));
}

TEST_F(SecondAuroraFaults, TheCounterCanJumpBack) {
  const std::uint32_t before = frame_of(host.ask("TX:0801"));
  host.device.strike(once(FaultKind::CounterJumps, 0, -1000), host.now_ns);
  host.listen(100 * kMillisecond_ns);
  const auto jump = static_cast<std::int32_t>(frame_of(host.ask("TX:0801")) - before);
  EXPECT_NEAR(jump, -8000, 150);
}

TEST_F(SecondAuroraFaults, FaultsStrikeWithTheirProbabilityAndTheSameForOneSeed) {
  const auto struck_of_500 = [] {
    Settings settings = with_coils({1});
    settings.faults = {{.kind = FaultKind::BodyCrcWrong, .probability = 0.1}};
    ScriptedHost other(settings);
    other.start_tracking();
    for (int i = 0; i < 500; ++i) {
      other.ask_binary("BX:0801");
    }
    return other.device.counts().of(FaultKind::BodyCrcWrong);
  };
  EXPECT_NEAR(static_cast<double>(struck_of_500()), 50, 21);  // three standard deviations
  EXPECT_EQ(struck_of_500(), struck_of_500());
}

TEST(SecondAuroraFaultsAtStart, AnyReplyCanBeStruck) {
  ScriptedHost host(with_coils({1}));
  Fault fault = once(FaultKind::ErrorInstead, 0, 0x05);
  fault.strikes = Strikes::AllReplies;
  host.device.strike(fault, host.now_ns);
  EXPECT_EQ(host.ask("INIT:"), "ERROR05");
  EXPECT_EQ(host.ask("PHSR:00"), "010A001");
}

TEST(SecondAuroraSettings, NonsenseIsRefused) {
  Settings settings = with_coils({3});
  EXPECT_THROW(SecondAurora(settings, moving_away, 0), std::invalid_argument);
  settings = with_coils({1});
  settings.ports.clear();
  EXPECT_THROW(SecondAurora(settings, moving_away, 0), std::invalid_argument);
  settings = with_coils({1});
  settings.timing.measurements_per_second = 0;
  EXPECT_THROW(SecondAurora(settings, moving_away, 0), std::invalid_argument);
  SecondAurora device(with_coils({1}), moving_away, 0);
  EXPECT_THROW(device.plug(5, Tool{}, 0), std::invalid_argument);
}

}  // namespace
}  // namespace tubed::second_aurora
