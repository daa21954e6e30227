#include "clients/exporter/metrics_text.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "idl/validity.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

InstrumentReports reports_at(std::int64_t received_ns) {
  InstrumentReports reports;
  std::strcpy(reports.health.instrument_id, "cath-1");
  reports.status_received_ns = reports.health_received_ns = received_ns;
  reports.status.validity = 1;
  reports.status.estimate_age_ns = 12'000'000;
  reports.status.stage_count = 1;
  std::strcpy(reports.status.stages[0].name, "em");
  reports.status.stages[0].age_ns = 30'000'000;
  reports.health.validity_counts[1] = 42;
  reports.health.stage_count = 1;
  std::strcpy(reports.health.stages[0].name, "em");
  reports.health.stages[0].steps = 7;
  return reports;
}

bool says(const std::string& text, const std::string& line) {
  return text.find(line + "\n") != std::string::npos;
}

TEST(MetricsText, CountsAndStatesCarryTheirInstrument) {
  const std::string text = metrics_text({{"cath-1", reports_at(kSecond_ns)}}, kSecond_ns);
  EXPECT_TRUE(says(text, R"(tubed_up{instrument="cath-1"} 1)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_validity{instrument="cath-1",validity="VALID"} 1)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_validity{instrument="cath-1",validity="INVALID"} 0)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_estimates_total{instrument="cath-1",validity="VALID"} 42)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_stage_steps_total{instrument="cath-1",stage="em"} 7)")) << text;
}

TEST(MetricsText, SayHowOldTheNewestEstimateAndTheSignsOfLifeOfStagesAre) {
  InstrumentReports reports = reports_at(kSecond_ns);
  std::string text = metrics_text({{"cath-1", reports}}, kSecond_ns);
  EXPECT_TRUE(says(text, R"(tubed_estimate_age_seconds{instrument="cath-1"} 0.012)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_stage_age_seconds{instrument="cath-1",stage="em"} 0.03)")) << text;
  reports.status.estimate_age_ns = reports.status.stages[0].age_ns = -1;
  text = metrics_text({{"cath-1", reports}}, kSecond_ns);
  EXPECT_EQ(text.find("age_seconds{"), std::string::npos) << "never is no age: " << text;
}

TEST(MetricsText, ADaemonWhoseStatusStaysAwayIsDown) {
  const InstrumentReports reports = reports_at(kSecond_ns);
  const std::int64_t late = kSecond_ns + kSecond_ns * 3 / 2;
  EXPECT_TRUE(says(metrics_text({{"cath-1", reports}}, late), R"(tubed_up{instrument="cath-1"} 1)"));
  EXPECT_TRUE(says(metrics_text({{"cath-1", reports}}, late + 1), R"(tubed_up{instrument="cath-1"} 0)"));
}

TEST(MetricsText, ASilentDaemonHasNoFigures) {
  const std::string text = metrics_text({{"cath-1", reports_at(kSecond_ns)}}, 4 * kSecond_ns + 1);
  EXPECT_TRUE(says(text, R"(tubed_up{instrument="cath-1"} 0)")) << text;
  EXPECT_EQ(text.find("tubed_validity{"), std::string::npos) << text;
  EXPECT_EQ(text.find("tubed_stage_steps_total{"), std::string::npos) << text;
}

TEST(MetricsText, BucketsOfAHistogramAddUp) {
  InstrumentReports reports = reports_at(kSecond_ns);
  reports.health.exposure_to_publish.buckets[0] = 2;   // below 1.19 us
  reports.health.exposure_to_publish.buckets[4] = 3;   // 2 .. 2.38 us
  reports.health.exposure_to_publish.buckets[95] = 1;  // the rest
  const std::string text = metrics_text({{"cath-1", reports}}, kSecond_ns);
  const std::string name = R"(tubed_exposure_to_publish_seconds_bucket{instrument="cath-1",le=)";
  EXPECT_TRUE(says(text, name + R"("2e-06"} 2)")) << text;
  EXPECT_TRUE(says(text, name + R"("4e-06"} 5)")) << text;
  EXPECT_TRUE(says(text, name + R"("+Inf"} 6)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_exposure_to_publish_seconds_count{instrument="cath-1"} 6)")) << text;
}

TEST(MetricsText, WhatIsWrongInTheRoomHasNumbersOnceCoilsAndImagesWereCompared) {
  InstrumentReports reports = reports_at(kSecond_ns);
  EXPECT_EQ(metrics_text({{"a", reports}}, kSecond_ns).find("tubed_em_image_as_stated_ratio{"),
            std::string::npos);
  reports.health.agreement.probability = 0.5F;
  reports.health.agreement.as_stated = 0.25F;
  reports.health.agreement.explanation = 1;
  reports.health.agreement.shift_mm[1] = 3;
  reports.health.agreement.shift_mm[2] = -4;
  const std::string text = metrics_text({{"a", reports}}, kSecond_ns);
  EXPECT_TRUE(says(text, R"(tubed_em_image_as_stated_ratio{instrument="cath-1"} 0.25)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_em_image_shift_meters{instrument="cath-1"} 0.005)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_em_image_explanation{instrument="cath-1",explanation="registration"} 1)"))
      << text;
  EXPECT_TRUE(says(text, R"(tubed_em_image_explanation{instrument="cath-1",explanation="none"} 0)")) << text;
  reports.health.agreement.explanation = 9;
  EXPECT_TRUE(says(metrics_text({{"a", reports}}, kSecond_ns),
                   R"(tubed_em_image_explanation{instrument="cath-1",explanation="mirrored"} 1)"));
}

TEST(MetricsText, WhatWasNotCountedIsNotZero) {
  InstrumentReports reports = reports_at(kSecond_ns);
  EXPECT_EQ(metrics_text({{"a", reports}}, kSecond_ns).find("tubed_stage_allocations_total{"),
            std::string::npos);
  reports.health.stages[0].allocations_counted = true;
  EXPECT_NE(metrics_text({{"a", reports}}, kSecond_ns).find("tubed_stage_allocations_total{"),
            std::string::npos);
}

TEST(MetricsText, RefusedReadersUnreadablePacketsAndRivalsHaveNamesOfTheirOwn) {
  InstrumentReports reports = reports_at(kSecond_ns);
  reports.status.reasons = static_cast<std::uint32_t>(Reason::kRivalWriter);
  reports.health.stage_count = 3;
  std::strcpy(reports.health.stages[1].name, "dds");
  reports.health.stages[1].refused = 12;
  std::strcpy(reports.health.stages[2].name, "shm-door");
  reports.health.stages[2].refused = 3;
  const std::string text = metrics_text({{"cath-1", reports}}, kSecond_ns);
  EXPECT_TRUE(says(text, R"(tubed_rival_writer{instrument="cath-1"} 1)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_malformed_packets_total{instrument="cath-1"} 12)")) << text;
  EXPECT_TRUE(says(text, R"(tubed_shm_readers_total{instrument="cath-1",outcome="refused"} 3)")) << text;
  EXPECT_EQ(text.find(R"(stage="dds")"), std::string::npos) << "it is no stage";
}

TEST(MetricsText, WhyAnImageIsRefusedIsALabelThatDoesNotChangeWithTheAge) {
  InstrumentReports reports = reports_at(kSecond_ns);
  std::strcpy(reports.status.stages[0].why, "no sign of life for 12.5 s");
  const std::string text = metrics_text({{"cath-1", reports}}, kSecond_ns);
  EXPECT_TRUE(
      says(text, R"(tubed_stage_why{instrument="cath-1",stage="em",why="no sign of life for #.# s"} 1)"))
      << text;
}

TEST(MetricsText, WhatHarmsALineIsReplacedInLabels) {
  const std::string text = metrics_text({{"a\n\xff\x1b", InstrumentReports{}}}, kSecond_ns);
  EXPECT_TRUE(says(text, "tubed_up{instrument=\"a\uFFFD\uFFFD\uFFFD\"} 0")) << text;
}

TEST(MetricsText, QuotesInNamesAreEscaped) {
  const std::string text = metrics_text({{"a\"b\\c", InstrumentReports{}}}, kSecond_ns);
  EXPECT_TRUE(says(text, R"(tubed_up{instrument="a\"b\\c"} 0)")) << text;
}

}  // namespace
}  // namespace tubed
