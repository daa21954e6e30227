#include "daemon/pipeline/publisher_stage.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

struct PublisherBench {
  PublisherBench() : stage({&estimates}, em, tracker, outlet, bell) {
    stage.set_gather([this](std::vector<NamedReport>& reports) { reports.push_back({"em", &em_report}); });
  }
  void say(StageState state, std::string_view words) {
    em_report.state = state;
    em_report.why = {};
    words.copy(em_report.why.data(), em_report.why.size() - 1);
  }
  void step_after(milliseconds time) {
    clock.advance(time);
    stage.step(clock);
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
  TripleBuffer<TrackerIdentity> tracker;
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

TEST(PublisherStage, WordsThatChangeWhileTheStateStaysAreInTheStatusWithinATenthOfASecond) {
  PublisherBench bench;
  bench.stage.step(bench.clock);
  bench.say(StageState::kRunning, "");
  bench.step_after(milliseconds(20));
  bench.say(StageState::kRunning, "sensor 2 is not plugged in");
  bench.step_after(milliseconds(20));
  EXPECT_EQ(bench.outlet.words, "") << "words do not come more than ten times a second";
  bench.step_after(milliseconds(80));
  EXPECT_EQ(bench.outlet.words, "sensor 2 is not plugged in");
  EXPECT_EQ(bench.outlet.statuses, 3);
}

TEST(PublisherStage, WordsThatChangeAtEveryStepArePublishedTenTimesASecondAndLoggedOnceASecond) {
  PublisherBench bench;
  bench.say(StageState::kRunning, "0");
  bench.stage.step(bench.clock);
  for (int i = 1; i <= 200; ++i) {  // 2 s
    bench.say(StageState::kRunning, std::to_string(i));
    bench.step_after(milliseconds(10));
  }
  EXPECT_EQ(bench.outlet.lines, (std::vector<std::string>{"1 0", "1 100", "1 200"}));
  EXPECT_EQ(bench.outlet.statuses, 21);
}

TEST(PublisherStage, TheNewestWordsAreLoggedWhenTheSecondIsOver) {
  PublisherBench bench;
  bench.say(StageState::kReconnecting, "the device is gone");
  bench.stage.step(bench.clock);
  bench.say(StageState::kReconnecting, "no such port");
  bench.step_after(milliseconds(300));
  bench.say(StageState::kReconnecting, "the port belongs to another program");
  bench.step_after(milliseconds(300));
  EXPECT_EQ(bench.outlet.lines.size(), 1U);
  bench.step_after(milliseconds(400));
  EXPECT_EQ(bench.outlet.lines,
            (std::vector<std::string>{"3 the device is gone", "3 the port belongs to another program"}));
}

TEST(PublisherStage, AStateIsLoggedAtOnceAlthoughWordsHaveJustBeenLogged) {
  PublisherBench bench;
  bench.say(StageState::kStarting, "looking for the tracker");
  bench.stage.step(bench.clock);
  bench.say(StageState::kRunning, "");
  bench.step_after(milliseconds(10));
  EXPECT_EQ(bench.outlet.lines, (std::vector<std::string>{"0 looking for the tracker", "1 "}));
}

TEST(PublisherStage, AFlappingStateIsPublishedEachTimeAndLoggedOnceASecond) {
  PublisherBench bench;
  for (int i = 0; i < 100; ++i) {  // 3 s, begins with reconnecting, ends with running
    bench.say(i % 2 == 0 ? StageState::kReconnecting : StageState::kRunning, "");
    bench.step_after(milliseconds(30));
  }
  EXPECT_EQ(bench.outlet.statuses, 100);
  EXPECT_LE(bench.outlet.lines.size(), 4U);
  EXPECT_EQ(bench.outlet.lines[0], "3 ");
  bench.step_after(milliseconds(1000));
  EXPECT_EQ(bench.outlet.lines.back(), "1 ") << "the newest state is not lost";
}

TEST(PublisherStage, AFlappingValidityIsLoggedAtOnceAndThenOnceASecond) {
  PublisherBench bench;
  for (int i = 0; i < 60; ++i) {  // 2 s
    bench.estimate(i % 2 == 0 ? Validity::kValid : Validity::kQuestionable);
    bench.stage.step(bench.clock);
    bench.clock.advance(milliseconds(33));
  }
  EXPECT_LE(bench.outlet.lines.size(), 3U);
  EXPECT_EQ(bench.outlet.lines[0], "VALID -");
  for (int i = 0; i < 31; ++i) {  // another second, of doubt alone
    bench.estimate(Validity::kQuestionable);
    bench.step_after(milliseconds(33));
  }
  EXPECT_EQ(bench.outlet.lines.back(), "QUESTIONABLE -") << "the newest is not lost";
}

TEST(PublisherStage, WhichTrackerItIsLeavesOnceAChange) {
  PublisherBench bench;
  bench.stage.step(bench.clock);
  EXPECT_TRUE(bench.outlet.trackers.empty());
  bench.tracker.back().firmware = BoundedText<47>("AURORA Rev 008");
  bench.tracker.publish();
  bench.stage.step(bench.clock);
  bench.stage.step(bench.clock);
  ASSERT_EQ(bench.outlet.trackers.size(), 1U);
  EXPECT_EQ(bench.outlet.trackers[0].firmware.text(), "AURORA Rev 008");
}

TEST(PublisherStage, AHungOptimizerIsNotAvailableAfter250MsAndRecovers) {
  PublisherBench bench;
  bench.estimate(Validity::kValid);
  bench.stage.step(bench.clock);
  bench.step_after(milliseconds(249));
  EXPECT_EQ(bench.outlet.instruments[0].validity, Validity::kValid);
  bench.step_after(milliseconds(1));
  EXPECT_EQ(bench.outlet.instruments[0].validity, Validity::kNotAvailable);
  EXPECT_EQ(bench.outlet.instruments[0].estimate_age_ns, 250'000'000);
  EXPECT_NE(bench.outlet.systemctl_words.find("cath-1 NOT_AVAILABLE (DEADLINE_MISSED), estimate 250 ms old"),
            std::string::npos)
      << bench.outlet.systemctl_words;
  bench.estimate(Validity::kValid);
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.instruments[0].validity, Validity::kValid);
  EXPECT_EQ(bench.outlet.instruments[0].estimate_age_ns, 0);
}

TEST(PublisherStage, AnEstimateThatWasNotWrittenMakesNobodyYounger) {
  PublisherBench bench;
  bench.outlet.writes_succeed = false;
  bench.estimate(Validity::kValid);
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.instruments[0].validity, Validity::kNotAvailable);
  EXPECT_EQ(bench.outlet.instruments[0].estimate_age_ns, -1);
  StageReport report;
  bench.stage.describe(report);
  EXPECT_EQ(report.outputs, 0U);
  EXPECT_EQ(report.dropped, 1U);
}

TEST(PublisherStage, ASilentStageHasFailedAndSaysSinceWhenUntilItSpeaksAgain) {
  PublisherBench bench;
  bench.say(StageState::kRunning, "");
  bench.em_report.reported_ns = to_ns(bench.clock.now());
  bench.stage.step(bench.clock);
  bench.step_after(milliseconds(249));
  EXPECT_EQ(bench.outlet.stages[0].state, StageState::kRunning);
  bench.step_after(milliseconds(1));
  EXPECT_EQ(bench.outlet.stages[0].state, StageState::kFailed);
  EXPECT_EQ(bench.outlet.words, "no sign of life for 0.25 s");
  bench.step_after(milliseconds(800));
  EXPECT_EQ(bench.outlet.words, "no sign of life for 1 s");
  EXPECT_NE(bench.outlet.systemctl_words.find("em is failed: no sign of life for 1 s"), std::string::npos)
      << bench.outlet.systemctl_words;
  bench.em_report.reported_ns = to_ns(bench.clock.now());
  bench.stage.step(bench.clock);
  EXPECT_EQ(bench.outlet.stages[0].state, StageState::kRunning);
}

TEST(PublisherStage, AStageThatHasNotYetGivenASignOfLifeIsStarting) {
  PublisherBench bench;
  bench.step_after(milliseconds(5000));
  EXPECT_EQ(bench.outlet.stages[0].state, StageState::kStarting);
}

TEST(PublisherStage, AStageThatHangsForAnHourDoesNotFillTheLog) {
  PublisherBench bench;
  bench.em_report.reported_ns = to_ns(bench.clock.now());
  for (int i = 0; i < 36000; ++i) {
    bench.step_after(milliseconds(100));
  }
  EXPECT_LE(bench.outlet.lines.size(), 14U);
}

}  // namespace
}  // namespace tubed
