#include "drivers/aurora/can_coil_assembler.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "tests/drivers/aurora/drawn_replies.hpp"

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;
using Frames = std::vector<CanFrame>;

constexpr MonotonicTime kStart = from_ns(1'000'000'000);

HandleReading reading_at(double x_mm) {
  HandleReading reading;
  reading.report = Report::kValid;
  reading.rotation = {1, 0, 0, 0};
  reading.p_em_mm = {x_mm, 0, -200};
  reading.indicator = 0.01;
  reading.port_status.bits = 0x3F;
  return reading;
}

enum class Layout { kFd, kClassic };

/// SYNC and all frames of `coils` coils; coil i stands at x = 10 i mm.
Frames measurement_frames(Layout layout, int coils, std::uint32_t frame) {
  const CanSync sync{frame, frame * 3125};
  Frames frames{pack_sync(sync)};
  for (int coil = 0; coil < coils; ++coil) {
    if (layout == Layout::kFd) {
      frames.push_back(pack_fd_coil(coil, reading_at(10 * coil), sync, {}, 0));
    } else {
      const auto parts = pack_classic_coil(coil, reading_at(10 * coil), sync);
      frames.insert(frames.end(), parts.begin(), parts.end());
    }
  }
  return frames;
}

/// Everything that leaves the assembler while it takes `frames` at one time.
std::vector<CanMeasurement> taken(CanCoilAssembler& assembler, const Frames& frames,
                                  MonotonicTime at = kStart) {
  std::vector<CanMeasurement> out;
  for (const CanFrame& frame : frames) {
    if (const auto measurement = assembler.accept(frame, at)) {
      out.push_back(*measurement);
    }
  }
  return out;
}

class EachLayout : public testing::TestWithParam<Layout> {};
INSTANTIATE_TEST_SUITE_P(CanCoilAssembler, EachLayout, testing::Values(Layout::kFd, Layout::kClassic));

TEST_P(EachLayout, AMeasurementLeavesWithItsLastCoil) {
  CanCoilAssembler assembler(5);
  Frames frames = measurement_frames(GetParam(), 5, 80);
  const CanFrame last = frames.back();
  frames.pop_back();
  EXPECT_TRUE(taken(assembler, frames).empty());
  const auto measurement = assembler.accept(last, kStart + milliseconds(4));
  ASSERT_TRUE(measurement);
  EXPECT_EQ(measurement->sync.frame, 80U);
  EXPECT_EQ(measurement->coil_count, 5);
  EXPECT_EQ(measurement->coils_lost, 0);
  EXPECT_EQ(measurement->sync_received, kStart);
  EXPECT_EQ(measurement->last_received, kStart + milliseconds(4));
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_DOUBLE_EQ(measurement->coils[i].p_em_mm.x(), 10.0 * static_cast<double>(i));
  }
}

TEST_P(EachLayout, ALostFrameCostsItsCoilOnly) {
  const Frames whole = measurement_frames(GetParam(), 3, 80);
  for (std::size_t lost = 1; lost < whole.size(); ++lost) {
    CanCoilAssembler assembler(3);
    Frames frames = whole;
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(lost));
    EXPECT_TRUE(taken(assembler, frames).empty());
    const auto measurement = assembler.expire(kStart + milliseconds(21));
    ASSERT_TRUE(measurement);
    EXPECT_EQ(measurement->coils_lost, 1);
    const std::size_t coil = GetParam() == Layout::kFd ? lost - 1 : (lost - 1) / 3;
    EXPECT_EQ(measurement->coils[coil].state, CanCoilState::kMissing);
    EXPECT_TRUE(measurement->coils[coil].p_em_mm.hasNaN());
    EXPECT_EQ(assembler.counts().lost_coils, 1U);
    EXPECT_EQ(assembler.counts().partial_coils, GetParam() == Layout::kClassic ? 1U : 0U);
  }
}

TEST_P(EachLayout, ALostSyncCostsTheMeasurementAndNothingIsTakenForAnother) {
  CanCoilAssembler assembler(2);
  EXPECT_EQ(taken(assembler, measurement_frames(GetParam(), 2, 80)).size(), 1U);
  Frames without_sync = measurement_frames(GetParam(), 2, 88);
  without_sync.erase(without_sync.begin());
  EXPECT_TRUE(taken(assembler, without_sync, kStart + milliseconds(5)).empty());
  const auto next = taken(assembler, measurement_frames(GetParam(), 2, 96), kStart + milliseconds(50));
  ASSERT_EQ(next.size(), 1U);
  EXPECT_EQ(next[0].step.missed, 1U);
  EXPECT_EQ(assembler.counts().missed, 1U);
  EXPECT_EQ(assembler.counts().unmatched, without_sync.size());
}

TEST_P(EachLayout, CoilsOfAnotherMeasurementAreNotMixedIn) {
  CanCoilAssembler assembler(2);
  const Frames now = measurement_frames(GetParam(), 2, 80);
  const Frames later = measurement_frames(GetParam(), 2, 88);
  Frames mixed = now;
  mixed.back() = later.back();
  EXPECT_TRUE(taken(assembler, mixed).empty());
  EXPECT_EQ(assembler.counts().unmatched, 1U);
  EXPECT_EQ(assembler.expire(kStart + milliseconds(21))->coils_lost, 1);
}

TEST_P(EachLayout, PartsThatComeTooLateAreNotTaken) {
  CanCoilAssembler assembler(1);
  Frames frames = measurement_frames(GetParam(), 1, 80);
  const CanFrame late = frames.back();
  frames.pop_back();
  EXPECT_TRUE(taken(assembler, frames).empty());
  EXPECT_FALSE(assembler.accept(late, kStart + milliseconds(21)));
  EXPECT_EQ(assembler.counts().unmatched, 1U);
  EXPECT_FALSE(assembler.expire(kStart + milliseconds(22)));  // nothing whole in it
  EXPECT_EQ(assembler.counts().empty, 1U);
}

TEST_P(EachLayout, FramesThatComeTwiceAreCountedOnce) {
  CanCoilAssembler assembler(2);
  Frames twice;
  for (const CanFrame& frame : measurement_frames(GetParam(), 2, 80)) {
    twice.insert(twice.end(), {frame, frame});
  }
  const auto measurements = taken(assembler, twice);
  ASSERT_EQ(measurements.size(), 1U);
  EXPECT_EQ(measurements[0].coils_lost, 0);
  const auto& counts = assembler.counts();
  EXPECT_EQ(counts.duplicates + counts.unmatched, twice.size() / 2);
}

TEST_P(EachLayout, ADamagedFrameCostsItsCoilOnly) {
  DrawnReplies drawn(3);
  const Frames whole = measurement_frames(GetParam(), 2, 80);
  for (int k = 0; k < 3000; ++k) {
    Frames frames = whole;
    CanFrame& hit = frames[1 + drawn.below(static_cast<std::uint32_t>(frames.size() - 1))];
    hit.bytes[drawn.below(hit.size)] ^= static_cast<std::uint8_t>(1 + drawn.below(255));
    CanCoilAssembler assembler(2);
    EXPECT_TRUE(taken(assembler, frames).empty());
    const auto measurement = assembler.expire(kStart + milliseconds(21));
    ASSERT_TRUE(measurement);
    ASSERT_EQ(measurement->coils_lost, 1);
    ASSERT_EQ(assembler.counts().bad_frames, 1U);
  }
}

TEST_P(EachLayout, CoilsMayComeInAnyOrder) {
  CanCoilAssembler assembler(3);
  Frames frames = measurement_frames(GetParam(), 3, 80);
  std::reverse(frames.begin() + 1, frames.end());
  EXPECT_EQ(taken(assembler, frames).size(), 1U);
}

TEST(CanCoilAssembler, AnIncompleteMeasurementLeavesWhenTheNextSyncComes) {
  CanCoilAssembler assembler(2);
  Frames frames = measurement_frames(Layout::kFd, 2, 80);
  frames.pop_back();
  EXPECT_TRUE(taken(assembler, frames).empty());
  const auto before = assembler.accept(pack_sync({88, 0}), kStart + milliseconds(15));
  ASSERT_TRUE(before);
  EXPECT_EQ(before->sync.frame, 80U);
  EXPECT_EQ(before->coils_lost, 1);
}

TEST(CanCoilAssembler, ARepeatedSyncDoesNotOpenItsMeasurementAgain) {
  CanCoilAssembler assembler(1);
  const Frames frames = measurement_frames(Layout::kFd, 1, 80);
  EXPECT_EQ(taken(assembler, frames).size(), 1U);
  EXPECT_TRUE(taken(assembler, frames, kStart + milliseconds(25)).empty());
  EXPECT_EQ(assembler.counts().duplicates, 1U);
}

TEST(CanCoilAssembler, AnOldMeasurementIsNotTakenForANewOne) {
  CanCoilAssembler assembler(1);
  taken(assembler, measurement_frames(Layout::kFd, 1, 80));
  EXPECT_TRUE(taken(assembler, measurement_frames(Layout::kFd, 1, 72), kStart + milliseconds(25)).empty());
  EXPECT_EQ(assembler.counts().old_syncs, 1U);
}

TEST(CanCoilAssembler, FollowsATrackerThatWasStartedAnew) {
  CanCoilAssembler assembler(1);
  taken(assembler, measurement_frames(Layout::kFd, 1, 80'000));
  EXPECT_TRUE(taken(assembler, measurement_frames(Layout::kFd, 1, 8), kStart + milliseconds(25)).empty());
  const auto second = taken(assembler, measurement_frames(Layout::kFd, 1, 16), kStart + milliseconds(50));
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0].step.kind, FrameKind::kRestarted);
}

TEST(CanCoilAssembler, KeepsWhatTheGatewayLastSaid) {
  CanCoilAssembler assembler(1);
  EXPECT_FALSE(assembler.status());
  EXPECT_FALSE(assembler.accept(pack_status({kCanProtocol, 5, {0x0080}, 3, 1}), kStart));
  ASSERT_TRUE(assembler.status());
  EXPECT_EQ(assembler.status()->coil_count, 5);
  EXPECT_EQ(assembler.status()->gateway_error, 1);
}

TEST(CanCoilAssembler, CountsCoilsThatNobodyAskedForAndForeignFrames) {
  CanCoilAssembler assembler(1);
  EXPECT_EQ(taken(assembler, measurement_frames(Layout::kFd, 3, 80)).size(), 1U);
  EXPECT_EQ(assembler.counts().unexpected_coils, 2U);
  EXPECT_FALSE(assembler.accept(CanFrame{0x123, 8, {}}, kStart));
  EXPECT_EQ(assembler.counts().foreign, 1U);
}

TEST(CanCoilAssembler, NeverExpiresWhatIsNotOpen) {
  CanCoilAssembler assembler(1);
  EXPECT_FALSE(assembler.expire(kStart));
  taken(assembler, measurement_frames(Layout::kFd, 1, 80));
  EXPECT_FALSE(assembler.expire(kStart + milliseconds(100)));
  EXPECT_EQ(assembler.counts().empty, 0U);
}

}  // namespace
}  // namespace tubed::aurora
