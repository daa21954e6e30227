#include "daemon/pipeline/em_acquisition_stage.hpp"

#include <gtest/gtest.h>

#include "tests/daemon/pipeline/fakes.hpp"

namespace tubed {
namespace {

/// Delivers nothing, but says which tracker it is.
class NamedEmSource final : public EmSource, public HasIdentity {
 public:
  explicit NamedEmSource(const TrackerIdentity& identity) : identity_(identity) {}
  OpenResult open() override { return {true, {}}; }
  ReadOutcome read(EmFrame& /*frame*/, MonotonicTime /*deadline*/) noexcept override {
    return ReadOutcome::kTimeout;
  }
  void close() noexcept override {}
  [[nodiscard]] const TrackerIdentity& identity() noexcept override { return identity_; }

 private:
  const TrackerIdentity& identity_;
};

struct AcquisitionBench {
  explicit AcquisitionBench(std::unique_ptr<EmSource> source)
      : stage(std::move(source), settings, to_optimizer, to_publisher, tracker, publisher_bell) {}
  void run_once() {
    stage.wait(clock);
    stage.step(clock);
  }
  FakeClock clock;
  PipelineSettings settings;
  EmRing to_optimizer;
  EmRing to_publisher;
  TripleBuffer<TrackerIdentity> tracker;
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

}  // namespace
}  // namespace tubed
