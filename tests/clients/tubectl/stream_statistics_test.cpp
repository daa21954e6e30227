#include "clients/tubectl/watch/stream_statistics.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "clients/tubectl/watch/sample_text.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;

/// A sample received at `received_ms`, exposed `latency_ms` earlier.
std::unique_ptr<TubeSample> image_sample(std::int64_t received_ms, std::int64_t latency_ms) {
  auto sample = std::make_unique<TubeSample>();
  sample->received_monotonic_ns = received_ms * kMillisecond_ns;
  sample->estimate.has_image = true;
  sample->estimate.stamps.exposure_monotonic_ns = (received_ms - latency_ms) * kMillisecond_ns;
  sample->estimate.validity = tubed_VALIDITY_VALID;
  return sample;
}

TEST(StreamStatistics, PercentilesAreNearestRank) {
  std::vector<double> values(100);
  std::iota(values.rbegin(), values.rend(), 1);

  const auto percentiles = percentiles_of(values);

  ASSERT_TRUE(percentiles.has_value());
  EXPECT_EQ(percentiles->p50, 50);
  EXPECT_EQ(percentiles->p90, 90);
  EXPECT_EQ(percentiles->p99, 99);
  EXPECT_EQ(percentiles_of({7.0})->p99, 7);
  EXPECT_FALSE(percentiles_of({}).has_value());
}

TEST(StreamStatistics, RateCountsIntervalsNotSamples) {
  StreamStatistics statistics;

  for (std::int64_t i = 0; i <= 30; ++i) statistics.add(*image_sample(1000 + i * 100, 5));

  EXPECT_DOUBLE_EQ(statistics.rate_hz(), 10);
}

TEST(StreamStatistics, LatencyRunsFromExposureToReceptionAndTicksWithoutImageCountApart) {
  StreamStatistics statistics;
  statistics.add(*image_sample(1000, 5));
  auto tick = image_sample(1033, 0);
  tick->estimate.has_image = false;
  tick->estimate.stamps.em_measured_monotonic_ns = 1030 * kMillisecond_ns;
  statistics.add(*tick);

  const nlohmann::json report = statistics.to_json();

  EXPECT_EQ(report["latency_ms"]["exposure"]["count"], 1);
  EXPECT_EQ(report["latency_ms"]["exposure"]["p50"], 5.0);
  EXPECT_EQ(report["latency_ms"]["em"]["p50"], 3.0);
  EXPECT_EQ(report["interval_ms"]["max"], 33.0);
}

TEST(StreamStatistics, LossBeforeTheFirstSampleIsNobodysLoss) {
  StreamStatistics statistics;
  auto first = image_sample(1000, 5);
  first->lost_before = 400;
  auto second = image_sample(1033, 5);
  second->lost_before = 2;

  statistics.add(*first);
  statistics.add(*second);

  EXPECT_EQ(statistics.to_json()["lost"], 2);
}

TEST(StreamStatistics, EveryReasonAndEventIsCountedByName) {
  StreamStatistics statistics;
  auto sample = image_sample(1000, 5);
  sample->estimate.validity = tubed_VALIDITY_QUESTIONABLE;
  sample->estimate.reasons = tubed_REASON_COIL_LOST | tubed_REASON_DEMO_DATA;
  statistics.add(*sample);
  statistics.add(TubeEvent::kLivelinessLost);

  const nlohmann::json report = statistics.to_json();

  EXPECT_EQ(report["validity"], (nlohmann::json{{"QUESTIONABLE", 1}}));
  EXPECT_EQ(report["reasons"], (nlohmann::json{{"COIL_LOST", 1}, {"DEMO_DATA", 1}}));
  EXPECT_EQ(report["events"], (nlohmann::json{{"liveliness lost", 1}}));
}

TEST(SampleText, ALineSaysWhatMattersAndJsonKeepsTheWireNames) {
  auto sample = image_sample(1000, 5);
  std::snprintf(sample->estimate.instrument_id, sizeof(sample->estimate.instrument_id), "catheter");
  sample->estimate.sequence_number = 42;
  sample->estimate.reasons = tubed_REASON_IMAGE_OFF;

  const std::string line = line_of(sample->estimate, sample->received_monotonic_ns);

  EXPECT_NE(line.find("catheter #42 VALID IMAGE_OFF"), std::string::npos) << line;
  EXPECT_NE(line.find("no shape"), std::string::npos)
      << line;  // no coefficients: no tip, certainly not the origin
  EXPECT_NE(line.find("5.0 ms since exposure"), std::string::npos) << line;
  EXPECT_EQ(to_json(sample->estimate)["stamps"]["exposure_monotonic_ns"], 995 * kMillisecond_ns);
}

}  // namespace
}  // namespace tubed
