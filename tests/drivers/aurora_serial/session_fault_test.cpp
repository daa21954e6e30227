// Every fault that the emulated Aurora has, at 1 % and at 10 % of the replies, in virtual time.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed::aurora {
namespace {

using emulator::Fault;
using Event = Session::Event;

struct FaultCase {
  Fault fault;
  double lost_each;        ///< measurements that one fault may cost, on average
  std::uint64_t max_gap;   ///< measurements not seen in a row, at 1 %
  double time_p95_ms = 1;  ///< error of the time of measurement
};

// A reply takes 20 of 25 ms on the line. What is damaged and ends in time costs itself and 20 ms of quiet;
// what does not come is waited for, 62 ms; a delayed reply comes after 150 ms. A stale reply says that there
// was nothing newer when there was: it pulls the fitted times, up to a period.
constexpr double kMaxStaleMs = 20;  ///< no pose is older than its time says by more
constexpr FaultCase kCases[] = {
    {Fault::kCrc, 1.6, 4},      {Fault::kHeaderCrc, 1.6, 4}, {Fault::kLength, 2.4, 6},
    {Fault::kTruncate, 2.6, 6}, {Fault::kDrop, 2.6, 6},      {Fault::kGarbage, 0.1, 1},
    {Fault::kNoReply, 2.6, 6},  {Fault::kError, 0.1, 1},     {Fault::kDuplicate, 0.3, 2},
    {Fault::kStale, 1, 3, 4},   {Fault::kDelay, 6, 12},      {Fault::kSplit, 0.4, 2},
};

/// Tracking replies of each case; TUBED_FAULT_REPLIES=1000000 for the table of drivers/aurora/README.md.
int replies_a_case() {
  const char* const wanted = std::getenv("TUBED_FAULT_REPLIES");
  return wanted != nullptr ? std::atoi(wanted) : 20'000;
}

class SessionUnderFaults : public testing::TestWithParam<std::tuple<FaultCase, double>> {};

TEST_P(SessionUnderFaults, AcceptsNoWrongPoseAndLosesNoMoreThanTheFaultTakes) {
  const auto [fault, probability] = GetParam();
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  bench.device.faults().set(fault.fault, {.probability = probability});
  bench.watched = fault.fault;
  const auto before = bench.measurements;
  const MonotonicTime began = bench.line.time;
  const std::uint64_t end =
      bench.device.counts().tracking_replies + static_cast<std::uint64_t>(replies_a_case());
  while (bench.device.counts().tracking_replies < end) {
    bench.run_for(seconds(10));
  }
  const double measured = seconds_between(began, bench.line.time) * 40;
  const double got = static_cast<double>(bench.measurements - before);
  const auto struck = static_cast<double>(bench.device.faults().struck(fault.fault));
  const double lost_each = (measured - got) / struck;
  std::printf(
      "%-12s %4.0f %%  struck %6.0f  lost %5.2f %%  each %.2f  longest gap %2lu  in step after %lu replies  "
      "wrong %lu  time p95 %.2f ms, oldest %.2f ms\n",
      std::string(emulator::fault_name(fault.fault)).c_str(), 100 * probability, struck,
      100 * (1 - got / measured), lost_each, bench.max_gap_frames, bench.max_replies_to_resynchronise,
      bench.wrong, percentile_of_absolute(bench.time_errors_ms, 0.95), max_of(bench.time_errors_ms));
  EXPECT_GT(struck, probability * replies_a_case() / 4);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_EQ(bench.session.counts().link_losses, 0U);
  EXPECT_EQ(bench.session.counts().tracking_starts, 1U);
  EXPECT_FALSE(bench.session.poller().encoding().uses_text());
  EXPECT_LT(lost_each, fault.lost_each);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95), fault.time_p95_ms);
  EXPECT_LE(max_of(bench.time_errors_ms), kMaxStaleMs);
  if (probability < 0.05 && replies_a_case() <= 100'000) {  // in a million three come in a row
    EXPECT_LE(bench.max_gap_frames, fault.max_gap);
  }
  // The first whole reply behind a damaged one is understood, whatever came before.
  EXPECT_LE(bench.max_replies_to_resynchronise, 1U);
}

TEST(SessionFault, AReplyInCharactersIsUnderstoodAtOnceBehindBinaryOnesThatWereCut) {
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  bench.watched = Fault::kTruncate;
  for (int repetition = 0; repetition < 200; ++repetition) {
    // After four in vain text is asked for; what the last one left may end in characters.
    bench.device.faults().set(Fault::kTruncate, {.next = 4});
    bench.run_for(seconds(2));
  }
  EXPECT_EQ(bench.device.faults().struck(Fault::kTruncate), 800U);
  EXPECT_EQ(bench.max_replies_to_resynchronise, 1U);
}

std::string case_name(Fault fault, double probability) {
  std::string name(emulator::fault_name(fault));
  std::replace(name.begin(), name.end(), '-', '_');
  return name + (probability < 0.05 ? "_1" : "_10");
}

INSTANTIATE_TEST_SUITE_P(All, SessionUnderFaults,
                         testing::Combine(testing::ValuesIn(kCases), testing::Values(0.01, 0.1)),
                         [](const auto& one) {
                           return case_name(std::get<0>(one.param).fault, std::get<1>(one.param));
                         });

/// Faults of the tracker itself: at 10 % it hardly ever tracks.
class SessionWithATrackerThatFails : public testing::TestWithParam<std::tuple<Fault, double>> {};

TEST_P(SessionWithATrackerThatFails, AcceptsNoWrongPoseAndTracksAgain) {
  const auto [fault, probability] = GetParam();
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  bench.poses_are_true = fault != Fault::kStuck;
  bench.device.faults().set(fault, {.probability = probability});
  const auto before = bench.measurements;
  const MonotonicTime began = bench.line.time;
  const std::uint64_t spoilt_before = bench.spoilt;
  const std::uint64_t end =
      bench.device.counts().tracking_replies + static_cast<std::uint64_t>(replies_a_case());
  // A tracker that is switched off every quarter of a second never answers a million times.
  const MonotonicTime latest = began + std::chrono::hours(10);
  while (bench.device.counts().tracking_replies < end && bench.line.time < latest) {
    bench.run_for(seconds(10));
  }
  const double measured = seconds_between(began, bench.line.time) * 40;
  const auto got = static_cast<double>(bench.measurements - before);
  std::printf(
      "%-12s %4.0f %%  struck %6lu  lost %5.2f %%  coils not OK %lu  starts %lu  resumed %lu  wrong %lu  "
      "oldest %.2f ms\n",
      std::string(emulator::fault_name(fault)).c_str(), 100 * probability,
      bench.device.faults().struck(fault), 100 * (1 - got / measured), bench.spoilt - spoilt_before,
      bench.session.counts().tracking_starts, bench.session.counts().resumptions, bench.wrong,
      max_of(bench.time_errors_ms));
  EXPECT_GT(bench.device.faults().struck(fault), 0U);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_LE(max_of(bench.time_errors_ms), kMaxStaleMs);
  bench.device.faults().clear();
  bench.run_for(seconds(10));
  const auto tracking = bench.measurements;
  bench.poses_are_true = true;
  bench.run_for(seconds(10));
  EXPECT_NEAR(static_cast<double>(bench.measurements - tracking), 400, 3);
  EXPECT_EQ(bench.coils_seen(), 5);
}

INSTANTIATE_TEST_SUITE_P(
    All, SessionWithATrackerThatFails,
    testing::Combine(testing::Values(Fault::kBreak, Fault::kHangUp, Fault::kPowerCycle, Fault::kCoilBroken,
                                     Fault::kOutOfVolume, Fault::kStuck),
                     testing::Values(0.01, 0.1)),
    [](const auto& one) { return case_name(std::get<0>(one.param), std::get<1>(one.param)); });

}  // namespace
}  // namespace tubed::aurora
