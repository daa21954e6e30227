#include "daemon/pipeline/publisher_stage.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

struct PublisherBench {
  PublisherBench() : stage({&estimates}, em, outlet, bell) {
    stage.set_gather([this](std::vector<NamedReport>& reports) { reports.push_back({"em", &em_report}); });
  }
  void estimate(Validity validity) {
    estimates.back().validity = validity;
    estimates.back().stamps.optimizer_started_ns = to_ns(clock.now());
    estimates.back().stamps.optimizer_finished_ns = to_ns(clock.now());
    estimates.publish();
  }
  FakeClock clock;
  TripleBuffer<TubeEstimate> estimates;
  EmRing em;
  FakeOutlet outlet;
  Doorbell bell;
  StageReport em_report;
  PublisherStage stage;
};

TEST(PublisherStage, PublishesEachEstimateOnce) {
  PublisherBench bench;
  bench.estimate(Validity::kValid);
  EXPECT_TRUE(bench.stage.step(bench.clock));
  EXPECT_FALSE(bench.stage.step(bench.clock));
  EXPECT_EQ(bench.outlet.estimates.size(), 1U);
}

TEST(PublisherStage, AnEstimateFromBeforeAStallNeverLeaves) {
  PublisherBench bench;
  bench.estimate(Validity::kValid);
  bench.clock.advance(std::chrono::seconds(3));
  bench.stage.step(bench.clock);
  EXPECT_TRUE(bench.outlet.estimates.empty());
  StageReport report;
  bench.stage.describe(report);
  EXPECT_EQ(report.dropped, 1U);
}

TEST(PublisherStage, AnEstimateThatAStallInterruptedNeverLeaves) {
  PublisherBench bench;
  bench.estimates.back().stamps.optimizer_started_ns = to_ns(bench.clock.now());
  bench.clock.advance(std::chrono::seconds(3));
  bench.estimates.back().stamps.optimizer_finished_ns = to_ns(bench.clock.now());
  bench.estimates.publish();
  bench.stage.step(bench.clock);
  EXPECT_TRUE(bench.outlet.estimates.empty());
}

TEST(PublisherStage, AllEmMeasurementsLeaveInOrder) {
  PublisherBench bench;
  for (std::uint32_t number = 1; number <= 3; ++number) {
    EmFrame frame;
    frame.tracker_frame = number;
    bench.em.push(frame);
  }
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.em_frames, (std::vector<std::uint32_t>{1, 2, 3}));
}

TEST(PublisherStage, StatusLeavesOnEveryChangeAndOnceASecond) {
  PublisherBench bench;
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.statuses, 1);
  bench.clock.advance(milliseconds(100));
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.statuses, 1) << "nothing changed and no second has passed";
  bench.em_report.state = StageState::kReconnecting;
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.statuses, 2);
  bench.estimate(Validity::kInvalid);
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.statuses, 3) << "the validity changed";
  bench.clock.advance(milliseconds(1000));
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.statuses, 4);
  EXPECT_EQ(bench.outlet.healths, 2);
}

}  // namespace
}  // namespace tubed
