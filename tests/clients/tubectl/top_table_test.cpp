#include "clients/tubectl/watch/top_table.hpp"

#include "TubeEstimate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace tubed {
namespace {

/// Bucket i holds [2^(i/4), 2^((i+1)/4)) us.
tubed_LatencyHistogram counted(std::initializer_list<std::pair<int, std::uint32_t>> buckets) {
  tubed_LatencyHistogram histogram{};
  for (const auto& [bucket, count] : buckets) {
    histogram.buckets[bucket] = count;
    histogram.count += count;
  }
  return histogram;
}

TEST(TopTable, AQuantileIsTheUpperEdgeOfItsBucket) {
  const tubed_LatencyHistogram histogram = counted({{0, 50}, {40, 50}});
  EXPECT_DOUBLE_EQ(quantile_ms(histogram, 0.5), 1e-3 * std::exp2(0.25));
  EXPECT_DOUBLE_EQ(quantile_ms(histogram, 0.51), 1e-3 * std::exp2(41 / 4.0));
  EXPECT_DOUBLE_EQ(quantile_ms(histogram, 1), 1e-3 * std::exp2(41 / 4.0));
}

TEST(TopTable, NothingCountedHasNoQuantile) { EXPECT_LT(quantile_ms(counted({}), 0.5), 0); }

TEST(TopTable, BetweenTwoReportsOnlyWhatIsNewCounts) {
  const tubed_LatencyHistogram difference = between(counted({{4, 10}}), counted({{4, 13}, {8, 2}}));
  EXPECT_EQ(difference.count, 5U);
  EXPECT_EQ(difference.buckets[4], 3U);
  EXPECT_EQ(difference.buckets[8], 2U);
}

TEST(TopTable, AfterARestartEverythingCounts) {
  EXPECT_EQ(between(counted({{4, 100}}), counted({{4, 3}})).count, 3U);
}

/// One stage, `steps` so far, at second `second` of a start of the daemon.
tubed_TubeHealth health(std::uint64_t start, std::int64_t second, std::uint64_t steps) {
  tubed_TubeHealth health{};
  health.daemon_start = start;
  health.time_ns = second * 1'000'000'000;
  health.estimates = steps;
  health.stage_count = 1;
  std::strcpy(health.stages[0].name, "optimizer");
  health.stages[0].steps = steps;
  return health;
}

tubed_TubeStatus status() {
  tubed_TubeStatus status{};
  status.estimate_age_ns = 12'000'000;
  std::strcpy(status.instrument_id, "cath-1");
  status.validity = 1;
  status.time_ns = 90'000'000'000;
  status.stage_count = 1;
  std::strcpy(status.stages[0].name, "optimizer");
  status.stages[0].state = 2;
  std::strcpy(status.stages[0].why, "images are late");
  return status;
}

TEST(TopTable, ShowsRatesOfTheIntervalAndWhyAStageIsDegraded) {
  const std::string table = top_table(status(), health(7, 10, 300), health(7, 12, 360));
  EXPECT_NE(table.find("cath-1  VALID  -  newest estimate: 12ms  30.0 estimates/s"), std::string::npos)
      << table;
  EXPECT_NE(table.find("degraded         90s     30.0"), std::string::npos) << table;
  EXPECT_NE(table.find("images are late"), std::string::npos) << table;
}

TEST(TopTable, SaysThatSomebodyElsePublishesTheInstrument) {
  tubed_TubeStatus rivalled = status();
  rivalled.reasons = tubed_REASON_RIVAL_WRITER;
  EXPECT_NE(top_table(rivalled, health(7, 10, 300), health(7, 12, 360)).find("RIVAL: somebody else"),
            std::string::npos);
  EXPECT_EQ(top_table(status(), health(7, 10, 300), health(7, 12, 360)).find("RIVAL"), std::string::npos);
}

TEST(TopTable, SaysWhetherCoilsAndImagesAgreeOnceTheyWereCompared) {
  EXPECT_EQ(top_table(status(), health(7, 10, 300), health(7, 12, 360)).find("coils and images"),
            std::string::npos);
  tubed_TubeHealth compared = health(7, 12, 360);
  compared.agreement.probability = 0.9F;
  compared.agreement.as_stated = 0.97F;
  compared.agreement.shift_mm[0] = 3;
  compared.agreement.shift_mm[2] = 4;
  const std::string agree = top_table(status(), health(7, 10, 300), compared);
  EXPECT_NE(agree.find("coils and images agree (as stated 97 %): seen off by 5.0 mm"), std::string::npos)
      << agree;
  compared.agreement.disagree = true;
  compared.agreement.explanation = 4;
  compared.agreement.magnification = 0.05F;
  tubed_TubeIdentity identity{};
  identity.camera_count = 1;
  std::strcpy(identity.cameras[0].name, "lateral");
  const std::string disagree = top_table(status(), health(7, 10, 300), compared, &identity);
  EXPECT_NE(disagree.find("the focal length of camera lateral looks about 5 % too large"), std::string::npos)
      << disagree;
}

TEST(TopTable, AcrossARestartThereIsNoRate) {
  const std::string table = top_table(status(), health(7, 10, 300), health(8, 12, 360));
  EXPECT_NE(table.find("  - estimates/s"), std::string::npos) << table;
}

}  // namespace
}  // namespace tubed
