#include "clients/evaluation/latency_statistics.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

namespace tubed {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kBootOfDaemonNs = 1'700'000'000'000'000'000;

/// Exposed at 1000 ms of the daemon's clock; each stage takes another whole number of ms; received 30 ms
/// after the exposure by the listener's clock.
std::unique_ptr<TubeSample> image_sample() {
  auto sample = std::make_unique<TubeSample>();
  tubed_StageStamps& stamps = sample->estimate.stamps;
  sample->estimate.has_image = true;
  stamps.exposure_monotonic_ns = 1000 * kMs;
  stamps.image_grabbed_monotonic_ns = 1001 * kMs;
  stamps.frangi_started_monotonic_ns = 1003 * kMs;
  stamps.frangi_finished_monotonic_ns = 1006 * kMs;
  stamps.optimizer_started_monotonic_ns = 1010 * kMs;
  stamps.optimizer_finished_monotonic_ns = 1015 * kMs;
  stamps.publish_started_monotonic_ns = 1021 * kMs;
  sample->estimate.publish_time_ns = kBootOfDaemonNs + 1021 * kMs;
  sample->received_monotonic_ns = 1030 * kMs;
  return sample;
}

HostClock same_host() { return {kBootOfDaemonNs, 5 * kMs, true}; }

double p50_of(const nlohmann::json& report, const std::string& name) {
  for (const auto& row : report.at("rows")) {
    if (row.at("name") == "latency/" + name) return row.at("p50");
  }
  ADD_FAILURE() << "no row " << name;
  return -1;
}

TEST(LatencyStatistics, EveryStageHasItsPartAndThePartsAddUp) {
  LatencyStatistics statistics;
  statistics.add(*image_sample(), same_host());

  const nlohmann::json report = statistics.to_json(10);

  double sum = 0;
  const std::vector<std::pair<const char*, double>> parts{
      {"grab", 1},      {"wake_frangi", 2},    {"frangi", 3},   {"wake_optimizer", 4},
      {"optimizer", 5}, {"wake_publisher", 6}, {"way_image", 9}};
  for (const auto& [stage, expected_ms] : parts) {
    EXPECT_DOUBLE_EQ(p50_of(report, stage), expected_ms) << stage;
    sum += p50_of(report, stage);
  }
  EXPECT_DOUBLE_EQ(p50_of(report, "exposure_to_publish"), 21);
  EXPECT_DOUBLE_EQ(p50_of(report, "exposure_to_here"), sum);
}

TEST(LatencyStatistics, OnOneHostThereIsNoClockError) {
  LatencyStatistics statistics;
  statistics.add(*image_sample(), same_host());

  EXPECT_TRUE(statistics.is_same_host());
  EXPECT_EQ(statistics.clock_error_ms(), 0);
}

TEST(LatencyStatistics, FromAnotherHostLatencyGoesByBothRealTimeClocksAndTheErrorIsStated) {
  // The listener booted 400 s later: its monotonic clock is behind by as much. On the way: 9 ms.
  constexpr std::int64_t kLaterNs = 400'000 * kMs;
  auto sample = image_sample();
  sample->received_monotonic_ns -= kLaterNs;
  LatencyStatistics statistics;

  statistics.add(*sample, {kBootOfDaemonNs + kLaterNs, 5 * kMs, true});

  EXPECT_FALSE(statistics.is_same_host());
  EXPECT_DOUBLE_EQ(p50_of(statistics.to_json(10), "exposure_to_here"), 30);
  EXPECT_DOUBLE_EQ(statistics.clock_error_ms(), 5);
  EXPECT_NE(statistics.table(10).find("right to 5.0 ms"), std::string::npos);
}

TEST(LatencyStatistics, AClockThatNobodyDisciplinesIsNotBelieved) {
  LatencyStatistics statistics;
  statistics.add(*image_sample(), {kBootOfDaemonNs + 400'000 * kMs, 0, false});

  EXPECT_NE(statistics.table(10).find("NOT SYNCHRONISED"), std::string::npos);
}

TEST(LatencyStatistics, ASampleThatCameBeforeItWasSentProvesClocksApart) {
  constexpr std::int64_t kLaterNs = 400'000 * kMs;
  auto sample = image_sample();
  sample->received_monotonic_ns -= kLaterNs + 20 * kMs;  // 9 ms on the way, 20 ms behind
  LatencyStatistics statistics;

  statistics.add(*sample, {kBootOfDaemonNs + kLaterNs, 5 * kMs, true});

  EXPECT_NE(statistics.table(10).find("11.000 ms before they were sent"), std::string::npos)
      << statistics.table(10);
}

TEST(LatencyStatistics, LatencyIsAlsoTheWayOfACatheterMeanwhile) {
  LatencyStatistics statistics;
  statistics.add(*image_sample(), same_host());

  const nlohmann::json report = statistics.to_json(10);

  for (const auto& row : report.at("rows")) {
    if (row.at("name") == "latency/exposure_to_here") {
      EXPECT_DOUBLE_EQ(row.at("p50_mm"), 0.3);  // 30 ms at 10 mm/s
      return;
    }
  }
  FAIL() << "no row exposure_to_here";
}

TEST(LatencyStatistics, ShapesFromCoilsAloneCountFromTheirMeasurement) {
  auto sample = image_sample();
  sample->estimate.has_image = false;
  sample->estimate.stamps.em_measured_monotonic_ns = 1005 * kMs;
  sample->estimate.stamps.em_received_monotonic_ns = 1017 * kMs;
  LatencyStatistics statistics;

  statistics.add(*sample, same_host());

  const nlohmann::json report = statistics.to_json(10);
  EXPECT_EQ(report.at("with_image"), 0);
  EXPECT_DOUBLE_EQ(p50_of(report, "em_delivery"), 12);
  EXPECT_DOUBLE_EQ(p50_of(report, "em_to_here"), 25);
}

TEST(LatencyStatistics, AStageThatTookNoPartHasNoRow) {
  auto sample = image_sample();
  sample->estimate.stamps.image_grabbed_monotonic_ns = 0;
  LatencyStatistics statistics;

  statistics.add(*sample, same_host());

  const nlohmann::json report = statistics.to_json(10);
  ASSERT_FALSE(report.at("rows").empty());
  for (const auto& row : report.at("rows")) EXPECT_NE(row.at("name"), "latency/grab");
}

}  // namespace
}  // namespace tubed
