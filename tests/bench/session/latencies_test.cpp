#include "bench/session/latencies.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace tubed {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kStartNs = 5'000 * kMs;

InjectedImage image(std::uint32_t frame, std::int64_t exposure_ms) {
  const std::int64_t exposure_ns = kStartNs + exposure_ms * kMs;
  return {frame, exposure_ns, exposure_ns + kMs / 10, exposure_ns + kMs / 5};
}

/// An estimate of the first instrument made from that image and written at `returned_ms`.
WrittenEstimate estimate(std::uint32_t frame, std::int64_t exposure_ms, std::int64_t returned_ms) {
  WrittenEstimate written{};
  written.instrument = 1;
  written.image_frame = frame;
  written.has_image = 1;
  written.exposure_ns = kStartNs + exposure_ms * kMs;
  written.write_returned_ns = kStartNs + returned_ms * kMs;
  return written;
}

/// Three images, 30 ms apart; the second was superseded by the third.
SessionRecord one_superseded() {
  SessionRecord record;
  record.start_ns = kStartNs;
  record.images = {image(1, 0), image(2, 30), image(3, 60)};
  record.written = {estimate(1, 0, 45), estimate(3, 60, 80)};
  return record;
}

TEST(Latencies, CountFromTheIntendedExposureToTheReturnOfTheWrite) {
  EXPECT_EQ(exposure_to_written(one_superseded()).values, (std::vector<double>{45, 20}));
}

TEST(Latencies, ASupersededImageWaitsForTheShapeOfANewerOne) {
  EXPECT_EQ(exposure_to_newer_shape(one_superseded()).values, (std::vector<double>{45, 50, 20}));
}

TEST(Latencies, AnImageAfterWhichNoShapeWasWrittenAnyMoreHasNoLatency) {
  SessionRecord record = one_superseded();
  record.images.push_back(image(4, 90));

  EXPECT_EQ(exposure_to_newer_shape(record).values.size(), 3U);
}

TEST(Latencies, SupersededAndLateImagesAreCounted) {
  const ImageCounts counts = count_images(one_superseded(), 30);

  EXPECT_EQ(counts.injected, 3);
  EXPECT_EQ(counts.used, 2);
  EXPECT_EQ(counts.superseded, 1);
  EXPECT_EQ(counts.late, 1);
}

TEST(Latencies, OtherInstrumentsAndShapesWithoutImageDoNotCount) {
  SessionRecord record = one_superseded();
  record.written.push_back(estimate(2, 30, 35));
  record.written.back().instrument = 2;
  record.written.push_back(estimate(2, 30, 36));
  record.written.back().has_image = 0;

  EXPECT_EQ(exposure_to_written(record).values.size(), 2U);
}

TEST(Latencies, ImagesBeforeTheCountingBeganDoNotCount) {
  SessionRecord record = one_superseded();
  record.images.erase(record.images.begin());

  EXPECT_EQ(exposure_to_written(record).values, (std::vector<double>{20}));
}

TEST(Latencies, ThePartsOfTheStagesAddUpToTheWhole) {
  SessionRecord record = one_superseded();
  record.written = {estimate(1, 0, 45)};
  WrittenEstimate& written = record.written.front();
  written.image_grabbed_ns = kStartNs + 1 * kMs;
  written.frangi_started_ns = kStartNs + 3 * kMs;
  written.frangi_finished_ns = kStartNs + 6 * kMs;
  written.optimizer_started_ns = kStartNs + 10 * kMs;
  written.optimizer_finished_ns = kStartNs + 15 * kMs;
  written.write_called_ns = kStartNs + 21 * kMs;

  std::vector<double> parts;
  for (const StageTimes& stage : stage_times(record)) parts.push_back(stage.times.values.at(0));

  EXPECT_EQ(parts, (std::vector<double>{1, 2, 3, 4, 5, 6, 24}));
  EXPECT_EQ(std::accumulate(parts.begin(), parts.end(), 0.0), exposure_to_written(record).values.at(0));
}

TEST(Latencies, CpuIsAShareOfOneCoreFromLookToLook) {
  SessionRecord record;
  ProcessCosts costs;
  for (const auto& [t_s, cpu_s] : {std::pair{0.0, 1.0}, {1.0, 1.2}, {3.0, 1.4}}) {
    costs.t_s = t_s;
    costs.cpu_s = cpu_s;
    record.costs.push_back(costs);
  }

  const TimedValues share = cpu_percent(record);

  ASSERT_EQ(share.values.size(), 2U);
  EXPECT_NEAR(share.values[0], 20, 1e-9);
  EXPECT_NEAR(share.values[1], 10, 1e-9);
}

TEST(Latencies, CpuOfAShapeIsAllThatWasSpentOverTheShapesFromImages) {
  SessionRecord record = one_superseded();
  record.costs.resize(3);
  record.costs[0].cpu_s = 1.0;
  record.costs[1].cpu_s = 1.3;
  record.costs[2].cpu_s = 1.5;

  EXPECT_EQ(cpu_ms_a_shape(record).values, (std::vector<double>{250}));
  record.written.clear();
  EXPECT_TRUE(cpu_ms_a_shape(record).values.empty());
}

TEST(Latencies, LossBeforeTheFirstSampleIsNobodysLoss) {
  std::vector<ReceivedEstimate> received(3);
  received[0].lost_before = 100;
  received[2].lost_before = 2;

  EXPECT_EQ(lost_of(received), 2);
}

}  // namespace
}  // namespace tubed
