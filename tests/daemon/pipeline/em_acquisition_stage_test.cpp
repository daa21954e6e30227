#include "daemon/pipeline/em_acquisition_stage.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "daemon/pipeline/stage_thread.hpp"
#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

/// Delivers nothing, but says which tracker it is.
class NamedEmSource final : public EmSource, public HasIdentity {
 public:
  explicit NamedEmSource(const TrackerIdentity& identity) : identity_(identity) {}
  OpenResult open() override { return {true, {}}; }
  void wait(MonotonicTime /*deadline*/) noexcept override {}
  ReadOutcome read(EmFrame& /*frame*/) noexcept override { return ReadOutcome::kNothing; }
  void close() noexcept override {}
  [[nodiscard]] const TrackerIdentity& identity() noexcept override { return identity_; }

 private:
  const TrackerIdentity& identity_;
};

/// The stage, its source opened.
struct AcquisitionBench {
  explicit AcquisitionBench(std::unique_ptr<EmSource> source)
      : stage(std::move(source), settings, {to_optimizer, optimizer_bell}, {to_publisher, publisher_bell},
              tracker) {
    stage.step(clock);
  }
  void run_once() {
    stage.wait(clock);
    stage.step(clock);
  }
  FakeClock clock;
  PipelineSettings settings;
  EmRing to_optimizer;
  EmRing to_publisher;
  TripleBuffer<TrackerIdentity> tracker;
  Doorbell optimizer_bell;
  Doorbell publisher_bell;
  EmAcquisitionStage stage;
};

TEST(EmAcquisitionStage, HandsOverWhichTrackerItIsOnceAChangeEvenWithoutMeasurements) {
  TrackerIdentity identity;
  AcquisitionBench bench(std::make_unique<NamedEmSource>(identity));
  bench.run_once();
  EXPECT_FALSE(bench.tracker.fetch()) << "a tracker that has said nothing is none";

  identity.firmware = BoundedText<47>("AURORA Rev 008");
  bench.run_once();
  ASSERT_TRUE(bench.tracker.fetch());
  EXPECT_EQ(bench.tracker.front(), identity);
  EXPECT_TRUE(bench.publisher_bell.wait_until(bench.clock.now())) << "the publisher is woken";

  bench.run_once();
  EXPECT_FALSE(bench.tracker.fetch()) << "nothing changed";

  identity.tool_count = 1;
  identity.tools[0].serial_number = 0x3C4B0001;
  bench.run_once();
  ASSERT_TRUE(bench.tracker.fetch());
  EXPECT_EQ(bench.tracker.front(), identity);
}

TEST(EmAcquisitionStage, ATrackerThatCannotSayWhichItIsIsReadAllTheSame) {
  FakeEmSource::Log log;
  AcquisitionBench bench(
      std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kFrame}, std::deque<bool>{}, log));
  bench.run_once();
  EXPECT_FALSE(bench.tracker.fetch());
  EmFrame frame;
  EXPECT_TRUE(bench.to_optimizer.pop(frame));
  EXPECT_TRUE(bench.to_publisher.pop(frame));
}

TEST(EmAcquisitionStage, AMeasurementRingsForTheOptimizerAndForThePublisher) {
  FakeEmSource::Log log;
  AcquisitionBench bench(
      std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kFrame}, std::deque<bool>{}, log));
  EXPECT_FALSE(bench.optimizer_bell.wait_until({})) << "nothing has come";
  bench.run_once();
  EXPECT_TRUE(bench.optimizer_bell.wait_until({}));
  EXPECT_TRUE(bench.publisher_bell.wait_until({}));
  bench.run_once();
  EXPECT_FALSE(bench.optimizer_bell.wait_until({})) << "nothing more has come";
}

TEST(EmAcquisitionStage, WaitingReadsNothing) {
  FakeEmSource::Log log;
  AcquisitionBench bench(
      std::make_unique<FakeEmSource>(std::deque{ReadOutcome::kFrame}, std::deque<bool>{}, log));
  for (int i = 0; i < 3; ++i) {
    bench.stage.wait(bench.clock);
  }
  EXPECT_EQ(log.waited, 3);
  EXPECT_EQ(log.read, 0);
  EXPECT_TRUE(bench.stage.step(bench.clock));
  EXPECT_EQ(log.read, 1);
}

TEST(EmAcquisitionStage, BusyIsTheTimeOfReadingNotOfWaitingOrOpening) {
  for (const ReadOutcome outcome : {ReadOutcome::kFrame, ReadOutcome::kRefused}) {
    for (const int work_ms : {1, 2, 8}) {
      FakeClock clock;
      EmRing ring;
      Doorbell bell;
      TripleBuffer<TrackerIdentity> tracker;
      auto source = std::make_unique<WorkingSource<EmSource, EmFrame>>(clock, std::chrono::milliseconds(20),
                                                                       std::chrono::milliseconds(work_ms));
      source->outcome = outcome;
      EmAcquisitionStage stage(std::move(source), {}, {ring, bell}, {ring, bell}, tracker);
      StageReport report;
      for (int i = 0; i < 41; ++i) {  // one to open; after each measurement a look whether there is another
        turn(stage, clock, report);
      }
      EXPECT_EQ(report.busy.count, 20U);
      EXPECT_EQ(report.busy.max_ns, work_ms * 1'000'000);
      EXPECT_EQ(*std::max_element(report.busy.buckets.begin(), report.busy.buckets.end()), 20U)
          << "all alike";
    }
  }
}

}  // namespace
}  // namespace tubed
