#include "clients/tubectl/watch/status_line.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "idl/validity.hpp"

namespace tubed {
namespace {

TubeSample sample_at(std::int64_t received_ns, Validity validity) {
  TubeSample sample;
  sample.estimate.validity = static_cast<std::uint32_t>(validity);
  sample.estimate.reasons = static_cast<std::uint32_t>(Reason::kDemoData);
  sample.received_monotonic_ns = received_ns;
  return sample;
}

TEST(StatusLine, SaysValidityReasonsRateAndStagesOnOneLine) {
  StatusLine line;
  for (int i = 0; i <= 10; ++i) line.add(sample_at(i * 50'000'000LL, Validity::kValid));
  tubed_TubeStatus status{};
  status.stage_count = 2;
  std::strcpy(status.stages[0].name, "em");
  status.stages[0].state = 1;
  std::strcpy(status.stages[0].why, "port 2: no tool; sensor 3, 4 left out");
  std::strcpy(status.stages[1].name, "grab-A");
  status.stages[1].state = 3;
  status.estimate_age_ns = 9'000'000;
  EXPECT_TRUE(line.add(status));

  EXPECT_TRUE(line.is_valid());
  EXPECT_EQ(line.text("cath-1"),
            "cath-1 VALID DEMO_DATA rate=20.0Hz latency=- age=9ms em=running grab-A=reconnecting "
            "em=\"port 2: no tool; sensor 3, 4 left out\"");
}

TEST(StatusLine, AfterAnEventTheLastShapeIsNotCurrent) {
  StatusLine line;
  line.add(sample_at(0, Validity::kValid));
  line.add(TubeNews{.event = TubeEvent::kLivelinessLost});
  EXPECT_FALSE(line.is_valid());
  EXPECT_TRUE(line.text("cath-1").starts_with("cath-1 NO_SHAPE \"liveliness lost\"")) << line.text("cath-1");

  line.add(sample_at(1, Validity::kValid));
  EXPECT_TRUE(line.is_valid());
}

TEST(StatusLine, ARivalIsNamedAndLeavesTheShapeCurrentButNotInOrder) {
  StatusLine line;
  line.add(TubeNews{.event = TubeEvent::kRivalSeen, .rival = "tubed, process 7 on host b"});
  line.add(sample_at(0, Validity::kValid));
  EXPECT_FALSE(line.is_valid());
  EXPECT_TRUE(line.text("cath-1").starts_with("cath-1 VALID ")) << line.text("cath-1");
  EXPECT_TRUE(line.text("cath-1").ends_with(" rival=\"tubed, process 7 on host b\"")) << line.text("cath-1");
  EXPECT_EQ(line.to_json("cath-1").at("rival"), "tubed, process 7 on host b");

  line.add(TubeNews{.event = TubeEvent::kRivalGone});
  EXPECT_TRUE(line.is_valid());
}

TEST(StatusLine, WithoutAnEstimateNothingIsValid) {
  const StatusLine line;
  EXPECT_FALSE(line.is_valid());
  EXPECT_TRUE(line.to_json("a").at("rate_hz").is_null());
}

TEST(StatusLine, AStateOfALaterVersionIsUnknown) { EXPECT_EQ(name_of_stage_state(6), "unknown"); }

}  // namespace
}  // namespace tubed
