// Every fault that the emulated Aurora has, at 1 % and at 10 % of the replies, in virtual time.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/drivers/aurora_serial/session_bench.hpp"

namespace tubed::aurora {
namespace {

using emulator::Fault;
using Event = Session::Event;

struct FaultCase {
  Fault fault;
  double lost_each;           ///< measurements that one fault may cost, on average
  std::uint64_t longest_gap;  ///< measurements not seen in a row, at 1 %
  double time_p95_ms = 1;     ///< error of the time of measurement
};

// A reply takes 20 of 25 ms on the line. What is damaged and ends in time costs itself and 20 ms of quiet;
// what does not come is waited for, 62 ms; a delayed reply comes after 150 ms. A stale reply says that there
// was nothing newer when there was: it pulls the fitted times, up to a period.
constexpr FaultCase kCases[] = {
    {Fault::kCrc, 1.6, 4},      {Fault::kHeaderCrc, 1.6, 4}, {Fault::kLength, 2.4, 6},
    {Fault::kTruncate, 2.6, 6}, {Fault::kDrop, 2.6, 6},      {Fault::kGarbage, 0.1, 1},
    {Fault::kNoReply, 2.6, 6},  {Fault::kError, 0.1, 1},     {Fault::kDuplicate, 0.3, 2},
    {Fault::kStale, 1, 3, 25},  {Fault::kDelay, 6, 12},      {Fault::kSplit, 0.4, 2},
};

class SessionUnderFaults : public testing::TestWithParam<std::tuple<FaultCase, double>> {};

TEST_P(SessionUnderFaults, AcceptsNoWrongPoseAndLosesNoMoreThanTheFaultTakes) {
  const auto [fault, probability] = GetParam();
  SessionBench bench;
  ASSERT_TRUE(bench.start());
  bench.run_for(seconds(5));
  bench.device.faults().set(fault.fault, {.probability = probability});
  const auto before = bench.measurements;
  constexpr int kMeasurements = 20000;
  bench.run_for(kMeasurements * milliseconds(25));
  const double got = static_cast<double>(bench.measurements - before);
  const auto struck = static_cast<double>(bench.device.faults().struck(fault.fault));
  const double lost_each = (kMeasurements - got) / struck;
  std::printf(
      "%-12s %4.0f %%  struck %5.0f  lost %5.2f %%  each %.2f  longest gap %2lu  wrong %lu  time p95 %.2f "
      "ms\n",
      std::string(emulator::fault_name(fault.fault)).c_str(), 100 * probability, struck,
      100 * (1 - got / kMeasurements), lost_each, bench.longest_gap_frames, bench.wrong,
      percentile_of_absolute(bench.time_errors_ms, 0.95));
  EXPECT_GT(struck, probability * kMeasurements / 4);
  EXPECT_EQ(bench.wrong, 0U);
  EXPECT_EQ(bench.session.counts().link_losses, 0U);
  EXPECT_EQ(bench.session.counts().tracking_starts, 1U);
  EXPECT_FALSE(bench.session.poller().uses_text());
  EXPECT_LT(lost_each, fault.lost_each);
  EXPECT_LT(percentile_of_absolute(bench.time_errors_ms, 0.95), fault.time_p95_ms);
  if (probability < 0.05) {
    EXPECT_LE(bench.longest_gap_frames, fault.longest_gap);
  }
}

INSTANTIATE_TEST_SUITE_P(All, SessionUnderFaults,
                         testing::Combine(testing::ValuesIn(kCases), testing::Values(0.01, 0.1)),
                         [](const auto& one) {
                           std::string name(emulator::fault_name(std::get<0>(one.param).fault));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name + (std::get<1>(one.param) < 0.05 ? "_1" : "_10");
                         });

}  // namespace
}  // namespace tubed::aurora
