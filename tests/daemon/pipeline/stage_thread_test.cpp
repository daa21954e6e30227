#include "daemon/pipeline/stage_thread.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <array>
#include <stdexcept>
#include <vector>

#include "daemon/pipeline/allocation_counter.hpp"

namespace tubed {
namespace {

/// Rings `stepped` after each step; allocates as many times as it was told in each.
class CountingStage final : public Stage {
 public:
  explicit CountingStage(int allocations) : allocations_(allocations) {}
  void wait(const Clock& clock) noexcept override {
    bell_.wait_until(clock.now() + std::chrono::milliseconds(1));
  }
  bool step(const Clock& /*clock*/) noexcept override {
    pthread_getname_np(pthread_self(), name.data(), name.size());
    for (int i = 0; i < allocations_; ++i) {
      kept_ = std::vector<int>(16);
    }
    ++steps;
    stepped.ring();
    return true;
  }
  void wake() noexcept override { bell_.ring(); }
  void describe(StageReport& report) const noexcept override {
    report.state = StageState::kRunning;
    report.outputs = steps;
  }
  Doorbell stepped;
  std::array<char, 16> name{};
  std::uint64_t steps = 0;

 private:
  int allocations_;
  std::vector<int> kept_;
  Doorbell bell_;
};

const StageReport& wait_for_report(StageThread& thread, CountingStage& stage) {
  const MonotonicClock clock;
  const MonotonicTime deadline = clock.now() + std::chrono::seconds(10);
  while (thread.newest_report().steps < 20 && clock.now() < deadline) {
    stage.stepped.wait_until(clock.now() + std::chrono::milliseconds(100));
  }
  return thread.newest_report();
}

TEST(StageThread, StepsItsStageUnderItsNameAndReports) {
  CountingStage stage(0);
  StageReport report;
  {
    StageThread thread("frangi-A", stage, {});
    EXPECT_FALSE(thread.start().refused);
    report = wait_for_report(thread, stage);
  }
  EXPECT_STREQ(stage.name.data(), "frangi-A");
  EXPECT_GE(report.steps, 20U);
  EXPECT_EQ(report.busy.count, report.steps);
  EXPECT_EQ(report.state, StageState::kRunning);
  EXPECT_EQ(stage.steps > 0, true);
}

TEST(StageThread, CountsTheAllocationsOfItsOwnThread) {
  if (!costs_are_counted()) {
    GTEST_SKIP() << "a sanitizer owns malloc in this build";
  }
  CountingStage frugal(0);
  CountingStage wasteful(3);
  StageThread frugal_thread("frugal", frugal, {});
  StageThread wasteful_thread("wasteful", wasteful, {});
  frugal_thread.start();
  wasteful_thread.start();
  const StageReport wasteful_report = wait_for_report(wasteful_thread, wasteful);
  const StageReport frugal_report = wait_for_report(frugal_thread, frugal);
  EXPECT_GE(wasteful_report.allocations, 3 * (wasteful_report.steps - 1));
  EXPECT_LT(frugal_report.allocations, 3U) << "only what starting a thread costs";
}

TEST(ThreadCosts, LocksAndExceptionsAreCountedToo) {
  if (!costs_are_counted()) {
    GTEST_SKIP() << "a sanitizer owns these functions in this build";
  }
  const ThreadCosts before = costs_of_this_thread();
  pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
  pthread_mutex_lock(&mutex);
  pthread_mutex_unlock(&mutex);
  try {
    throw std::runtime_error("counted");
  } catch (const std::runtime_error&) {
  }
  const ThreadCosts after = costs_of_this_thread();
  EXPECT_GE(after.locks, before.locks + 1);
  EXPECT_EQ(after.exceptions, before.exceptions + 1);
}

TEST(StageThread, RefusedRealTimeSchedulingSaysWhatToDo) {
  rlimit none{0, 0};
  setrlimit(RLIMIT_RTPRIO, &none);
  CountingStage stage(0);
  ThreadSettings settings;
  settings.cpus = {1000};  // no machine of this project has so many: refused for root as well
  StageThread thread("optimizer", stage, settings);
  const SchedulingOutcome outcome = thread.start();
  EXPECT_TRUE(outcome.refused);
  EXPECT_NE(outcome.why.find("optimizer: CPU set refused"), std::string::npos) << outcome.why;
}

}  // namespace
}  // namespace tubed
