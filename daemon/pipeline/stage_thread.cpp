#include "daemon/pipeline/stage_thread.hpp"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <mutex>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

#include "daemon/pipeline/allocation_counter.hpp"
#include "daemon/pipeline/latency_histogram.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kReportPeriod{
    50};  // half of the longest wait: a report is never 250 ms old

std::string apply_scheduling(const std::string& name, const ThreadSettings& settings) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
  std::string refused;
  if (!settings.cpus.empty()) {
    cpu_set_t cpus;
    CPU_ZERO(&cpus);
    for (const int cpu : settings.cpus) {
      CPU_SET(static_cast<std::size_t>(cpu), &cpus);
    }
    if (const int error = pthread_setaffinity_np(pthread_self(), sizeof cpus, &cpus); error != 0) {
      refused = name + ": CPU set refused (" + std::strerror(error) + "); does this machine have these CPUs?";
    }
  }
  if (settings.fifo_priority > 0) {
    sched_param parameter{};
    parameter.sched_priority = settings.fifo_priority;
    if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter); error != 0) {
      refused +=
          (refused.empty() ? "" : "; ") + name + ": SCHED_FIFO priority " +
          std::to_string(settings.fifo_priority) + " refused (" + std::strerror(error) +
          "); raise RLIMIT_RTPRIO (LimitRTPRIO= in the unit, or ulimit -r), or set scheduling = \"optional\"";
    }
  }
  return refused;
}

// Three times what the deepest stack was seen to hold (148 kB).
constexpr std::size_t kStackBytes = std::size_t{512} * 1024;
constexpr std::size_t kPageBytes = 4096;

/// So that a real-time thread does not wait for a page of its stack later.
[[gnu::noinline]] void use_stack() {
  std::array<char, kStackBytes> pages;
  for (std::size_t at = 0; at < kStackBytes; at += kPageBytes) {
    static_cast<volatile char&>(pages[at]) = 0;
  }
}

/// Threads that wait to be ended.
class WaitingThreads {
 public:
  /// False when the system has no further one.
  bool add() {
    try {
      threads_.emplace_back([this] { const std::scoped_lock wait(gate_); });
      return true;
    } catch (const std::system_error&) {
      return false;
    } catch (const std::bad_alloc&) {
      return false;
    }
  }
  WaitingThreads() = default;
  ~WaitingThreads() {
    closed_.unlock();
    for (std::thread& thread : threads_) thread.join();
  }
  WaitingThreads(const WaitingThreads&) = delete;
  WaitingThreads& operator=(const WaitingThreads&) = delete;

 private:
  std::mutex gate_;
  std::unique_lock<std::mutex> closed_{gate_};
  std::vector<std::thread> threads_;
};

bool same_condition(const StageReport& a, const StageReport& b) {
  return a.state == b.state && a.why == b.why;
}

}  // namespace

int startable_threads(int count) {
  WaitingThreads threads;
  int started = 0;
  while (started < count && threads.add()) ++started;
  return started;
}

std::size_t stack_bytes_of_a_thread() {
  pthread_attr_t attributes;
  std::size_t stack = 0;
  std::size_t guard = 0;
  pthread_getattr_default_np(&attributes);
  pthread_attr_getstacksize(&attributes, &stack);
  pthread_attr_getguardsize(&attributes, &guard);
  pthread_attr_destroy(&attributes);
  return stack + guard;
}

MonotonicTime turn(Stage& stage, const Clock& clock, StageReport& report) noexcept {
  stage.wait(clock);
  const MonotonicTime started = clock.now();
  const bool worked = stage.step(clock);
  const MonotonicTime finished = clock.now();
  if (worked) {
    ++report.steps;
    count_latency(report.busy, finished - started);
  }
  return finished;
}

MonotonicTime MonotonicClock::now() const noexcept { return std::chrono::steady_clock::now(); }

StageThread::StageThread(std::string name, Stage& stage, ThreadSettings settings)
    : name_(std::move(name)), stage_(stage), settings_(std::move(settings)) {}

StageThread::~StageThread() {
  request_stop();
  join();
}

void StageThread::join() {
  if (thread_ && thread_->joinable()) {
    thread_->join();
  }
}

SchedulingOutcome StageThread::start() {
  thread_ = std::make_unique<std::thread>([this] { run(); });
  while (!scheduled_.wait_until(clock_.now() + std::chrono::seconds(1))) {
  }
  return scheduling_;
}

void StageThread::request_stop() noexcept {
  stop_.set();
  stage_.wake();
}

const StageReport& StageThread::newest_report() {
  reports_.fetch();
  return reports_.front();
}

void StageThread::run() {
  scheduling_.why = apply_scheduling(name_, settings_);
  scheduling_.refused = !scheduling_.why.empty();
  if (settings_.fifo_priority > 0) {
    use_stack();
  }
  scheduled_.ring();
  report_.since_ns = to_ns(clock_.now());
  while (!stop_.is_set()) {
    publish_report(turn(stage_, clock_, report_));
  }
}

// At most twenty times a second, and at once when the stage's condition changes.
void StageThread::publish_report(MonotonicTime now) {
  StageReport described = report_;
  stage_.describe(described);
  const bool changed = !same_condition(described, report_);
  if (!changed && now < next_report_) {
    return;
  }
  const ThreadCosts costs = costs_of_this_thread();
  described.reported_ns = to_ns(now);
  described.since_ns = changed ? to_ns(now) : report_.since_ns;
  described.allocations = costs.allocations;
  described.locks = costs.locks;
  described.exceptions = costs.exceptions;
  described.costs_counted = costs_are_counted();
  report_ = described;
  next_report_ = now + kReportPeriod;
  reports_.back() = report_;
  reports_.publish();
}

}  // namespace tubed
