#include "clients/tubectl/watch/sample_text.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

namespace tubed {
namespace {

std::unique_ptr<tubed_TubeIdentity> identity() {
  auto identity = std::make_unique<tubed_TubeIdentity>();
  std::strcpy(identity->instrument_id, "catheter");
  std::strcpy(identity->world_frame, "table");
  std::strcpy(identity->world_axes, "LPS");
  return identity;
}

void name_the_tracker(tubed_TrackerIdentity& tracker) {
  std::strcpy(tracker.firmware, "AURORA Rev 008");
  std::strcpy(tracker.api_revision, "D.001.007");
  std::strcpy(tracker.control_unit_serial, "P5-00807");
  std::strcpy(tracker.field_generator, "SC-00808");
  tracker.tool_count = 1;
  tracker.tools[0].port = 3;
  tracker.tools[0].serial_number = 0x3C4B0001;
  std::strcpy(tracker.tools[0].part_number, "610029");
}

TEST(SampleText, AnIdentityInJsonNamesTheTrackerEachToolAndTheAxesOfTheWorld) {
  const auto sample = identity();
  name_the_tracker(sample->tracker);

  const nlohmann::json json = to_json(*sample);

  EXPECT_EQ(json["world_axes"], "LPS");
  EXPECT_EQ(
      json["tracker"],
      (nlohmann::json{{"firmware", "AURORA Rev 008"},
                      {"api_revision", "D.001.007"},
                      {"control_unit_serial", "P5-00807"},
                      {"field_generator", "SC-00808"},
                      {"tool_count", 1},
                      {"tools", {{{"port", 3}, {"serial_number", 0x3C4B0001}, {"part_number", "610029"}}}}}));
}

TEST(SampleText, ALineSaysHowMuchOfTheTubeNothingHolds) {
  const auto estimate = std::make_unique<tubed_TubeEstimate>();
  estimate->length_mm = 90;
  estimate->coefficient_count = 6;
  estimate->coefficient_spacing_mm = 30;
  estimate->point_count = 10;
  EXPECT_NE(line_of(*estimate, 0).find(", nothing holds 100 %"), std::string::npos) << line_of(*estimate, 0);
  for (int i = 0; i < 7; ++i) estimate->points[i].held_by = tubed_HELD_BY_COIL;
  EXPECT_NE(line_of(*estimate, 0).find(", nothing holds 30 %"), std::string::npos) << line_of(*estimate, 0);
  for (int i = 7; i < 10; ++i) estimate->points[i].held_by = tubed_HELD_BY_IMAGE;
  EXPECT_EQ(line_of(*estimate, 0).find("nothing holds"), std::string::npos) << line_of(*estimate, 0);
}

TEST(SampleText, AnIdentityInALineNamesTheTrackerAndItsTools) {
  const auto sample = identity();
  name_the_tracker(sample->tracker);

  const std::string line = line_of(*sample);

  EXPECT_NE(line.find("world = table, axes LPS"), std::string::npos) << line;
  EXPECT_NE(
      line.find("tracker AURORA Rev 008, API D.001.007, control unit P5-00807, field generator SC-00808, "
                "port 3 serial 3C4B0001, part 610029"),
      std::string::npos)
      << line;
}

TEST(SampleText, ALineSaysWhenTheTrackerHasNotSaidWhichItIs) {
  EXPECT_NE(line_of(*identity()).find("the tracker has not said which it is"), std::string::npos);
}

TEST(SampleText, AStatusSaysHowOldTheNewestEstimateAndEachStagesSignOfLifeAre) {
  const auto status = std::make_unique<tubed_TubeStatus>();
  status->estimate_age_ns = 400'000'000;
  status->stage_count = 1;
  status->stages[0].age_ns = 30'000'000;
  EXPECT_NE(line_of(*status).find("newest estimate: 0.4s"), std::string::npos) << line_of(*status);
  EXPECT_EQ(to_json(*status)["estimate_age_ns"], 400'000'000);
  EXPECT_EQ(to_json(*status)["stages"][0]["age_ns"], 30'000'000);
  status->estimate_age_ns = -1;
  EXPECT_NE(line_of(*status).find("newest estimate: never"), std::string::npos) << line_of(*status);
}

TEST(SampleText, BytesThatAreNoTextAreReplacedInJsonAndOnATerminal) {
  const auto estimate = std::make_unique<tubed_TubeEstimate>();
  std::strcpy(estimate->instrument_id, "c\xff\x1b[2Jé");

  EXPECT_EQ(to_json(*estimate)["instrument_id"], "c\uFFFD\uFFFD[2Jé");
  EXPECT_NO_THROW(to_json(*estimate).dump());
  EXPECT_EQ(line_of(*estimate, 0).find('\x1b'), std::string::npos);

  const auto status = std::make_unique<tubed_TubeStatus>();
  status->stage_count = 1;
  std::strcpy(status->stages[0].why, "\xc3");
  EXPECT_EQ(to_json(*status)["stages"][0]["why"], "\uFFFD");
  EXPECT_NE(line_of(*status).find(": \uFFFD"), std::string::npos);
}

TEST(SampleText, ATimeAtTheEndOfTheRangeIsALongLatency) {
  const auto estimate = std::make_unique<tubed_TubeEstimate>();
  estimate->stamps.em_measured_monotonic_ns = std::numeric_limits<std::int64_t>::min();
  EXPECT_NE(line_of(*estimate, 1'000'000'000).find("9223372037"), std::string::npos) << line_of(*estimate, 1);
}

}  // namespace
}  // namespace tubed
