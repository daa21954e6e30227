// The only place where threads are created and the pipeline's clock is read.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/pipeline_settings.hpp"
#include "daemon/pipeline/stage.hpp"
#include "daemon/pipeline/triple_buffer.hpp"

namespace tubed {

/// CLOCK_MONOTONIC of this host.
class MonotonicClock final : public Clock {
 public:
  [[nodiscard]] MonotonicTime now() const noexcept override;
};

/// How a thread got on with its scheduling.
struct SchedulingOutcome {
  bool refused = false;
  std::string why;  ///< what was refused and what to do about it
};

/// One turn of a stage's thread: waits, steps, and counts the step and how long it took in `report` when
/// there was something to do; never the waiting. When the step had ended.
MonotonicTime turn(Stage& stage, const Clock& clock, StageReport& report) noexcept;

/// Runs one stage: wait, step, wait, step ... until stopped. The thread's name is the stage's (15 letters at
/// most).
class StageThread {
 public:
  /// Does not start yet. `stage` outlives this object.
  StageThread(std::string name, Stage& stage, ThreadSettings settings);
  /// Stops and joins.
  ~StageThread();
  StageThread(const StageThread&) = delete;
  StageThread& operator=(const StageThread&) = delete;

  /// Starts the thread and waits until its scheduling is set. Called once.
  SchedulingOutcome start();
  /// Asks the thread to end; the destructor waits for it.
  void request_stop() noexcept;
  /// Waits until the thread has ended after request_stop(); harmless when it was never started.
  void join();

  /// Newest report of the stage; called by one other thread only (the publisher).
  const StageReport& newest_report();

  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  void run();
  void publish_report(MonotonicTime now);

  std::string name_;
  Stage& stage_;
  ThreadSettings settings_;
  StopFlag stop_;
  Doorbell scheduled_;
  SchedulingOutcome scheduling_;
  MonotonicClock clock_;
  StageReport report_;           ///< of the stage's thread
  MonotonicTime next_report_{};  ///< of the stage's thread
  TripleBuffer<StageReport> reports_;
  std::unique_ptr<std::thread> thread_;
};

/// How many of `count` threads can be alive at the same time beside those that are: starts them, and ends
/// them again.
int startable_threads(int count);

/// Of address space, that a thread's stack and its guard take.
std::size_t stack_bytes_of_a_thread();

}  // namespace tubed
