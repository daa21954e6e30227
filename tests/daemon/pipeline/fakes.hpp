// Sources, clock, estimator and outlet of a test's making.
#pragma once

#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/estimator/estimator.hpp"
#include "daemon/pipeline/publisher_stage.hpp"
#include "daemon/pipeline/stage.hpp"
#include "daemon/pipeline/status_words.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/image_source.hpp"

namespace tubed {

/// A clock that stands still until it is moved.
class FakeClock final : public Clock {
 public:
  [[nodiscard]] MonotonicTime now() const noexcept override { return now_; }
  void advance(std::chrono::nanoseconds step) { now_ += step; }
  void set(MonotonicTime now) { now_ = now; }

 private:
  MonotonicTime now_ = from_ns(1'000'000'000'000);
};

/// A frame each time, with time that passes: so long while it is waited for, so long while it is read.
template <typename Source, typename Frame>
class WorkingSource final : public Source {
 public:
  WorkingSource(FakeClock& clock, std::chrono::nanoseconds waiting, std::chrono::nanoseconds work)
      : clock_(clock), waiting_(waiting), work_(work) {}
  OpenResult open() override {
    clock_.advance(std::chrono::seconds(3));
    return {true, {}};
  }
  void wait(MonotonicTime /*deadline*/) noexcept override {
    clock_.advance(waiting_);
    has_come_ = true;
  }
  ReadOutcome read(Frame& /*frame*/) noexcept override {
    const bool has_come = std::exchange(has_come_, false);
    clock_.advance(has_come ? work_ : std::chrono::nanoseconds(0));
    return has_come ? outcome : ReadOutcome::kNothing;
  }
  void close() noexcept override {}

  ReadOutcome outcome = ReadOutcome::kFrame;  ///< of what has come

 private:
  FakeClock& clock_;
  std::chrono::nanoseconds waiting_;
  std::chrono::nanoseconds work_;
  bool has_come_ = false;
};

/// Plays a list of outcomes; a frame carries its number and the time it is read at.
class FakeEmSource final : public EmSource {
 public:
  struct Log {
    int opened = 0;
    int waited = 0;
    int read = 0;
    int closed = 0;
  };
  FakeEmSource(std::deque<ReadOutcome> reads, std::deque<bool> opens, Log& log)
      : reads_(std::move(reads)), opens_(std::move(opens)), log_(log) {}

  OpenResult open() override {
    ++log_.opened;
    const bool ok = opens_.empty() || opens_.front();
    if (!opens_.empty()) {
      opens_.pop_front();
    }
    return {ok, ok ? "" : "no tracker on the line; is it plugged in?"};
  }
  void wait(MonotonicTime /*deadline*/) noexcept override { ++log_.waited; }
  ReadOutcome read(EmFrame& frame) noexcept override {
    ++log_.read;
    if (reads_.empty()) {
      return ReadOutcome::kNothing;
    }
    const ReadOutcome outcome = reads_.front();
    reads_.pop_front();
    if (outcome == ReadOutcome::kFrame) {
      frame.tracker_frame = ++number_;
    }
    return outcome;
  }
  void close() noexcept override { ++log_.closed; }

 private:
  std::deque<ReadOutcome> reads_;
  std::deque<bool> opens_;
  Log& log_;
  std::uint32_t number_ = 0;
};

/// Remembers what it was asked; answers VALID.
class FakeEstimator final : public Estimator {
 public:
  explicit FakeEstimator(std::vector<Observation>& asked) : asked_(asked) { asked_.reserve(1000); }
  void update(const Observation& observation, TubeEstimate& estimate) noexcept override {
    asked_.push_back(observation);
    estimate.validity = validity;
    estimate.in_view_ratio = in_view_ratio;
    estimate.reasons = Reasons{};
    estimate.valid_time_ns = to_ns(observation.instant);
  }
  void look_further(const Observation& observation) noexcept override {
    if (looks_further) looks_further(observation);
  }
  void reset() noexcept override {}
  [[nodiscard]] ImageNeed image_need() const noexcept override { return need; }
  [[nodiscard]] bool describe_disagreement(std::span<char> words) const noexcept override {
    return say(disagreement, words);
  }
  [[nodiscard]] bool describe_jump(std::span<char> words) const noexcept override { return say(jump, words); }

  [[nodiscard]] std::optional<RidgePolarity> polarity_of(std::size_t /*camera*/) const noexcept override {
    return polarity;
  }

  ImageNeed need;
  std::optional<RidgePolarity> polarity;  ///< what it has found
  std::function<void(const Observation&)> looks_further;
  std::string disagreement;  ///< what coils and images contradict each other about
  std::string jump;          ///< of all coils
  Validity validity = Validity::kValid;
  float in_view_ratio = 1;

 private:
  static bool say(const std::string& what, std::span<char> words) {
    if (what.empty()) return false;
    words[what.copy(words.data(), words.size() - 1)] = '\0';
    return true;
  }

  std::vector<Observation>& asked_;
};

/// Remembers what left.
class FakeOutlet final : public Outlet {
 public:
  bool publish(const TubeEstimate& estimate) override {
    estimates.push_back(estimate);
    return writes_succeed;
  }
  void publish_em(const EmFrame& frame) override { em_frames.push_back(frame.tracker_frame); }
  void publish_tracker(const TrackerIdentity& tracker) override { trackers.push_back(tracker); }
  void publish_status(const PipelineStatus& status) override {
    ++statuses;
    stage_count = status.stages.size();
    words = status.stages.empty() ? "" : status.stages[0].report->why.data();
    instruments.assign(status.instruments.begin(), status.instruments.end());
    stages.clear();
    for (const NamedReport& stage : status.stages) {
      stages.push_back(*stage.report);
    }
    systemctl_words = status_words(ids, status);
  }
  void publish_health(std::span<const NamedReport> /*reports*/) override { ++healths; }
  void log_stage(const NamedReport& report) override {
    lines.push_back(std::to_string(static_cast<int>(report.report->state)) + " " + report.report->why.data());
  }
  void log_validity(std::uint32_t /*instrument*/, const InstrumentStatus& status) override {
    lines.push_back(std::string(name_of(status.validity)) + " " + names_of(status.reasons));
  }

  bool writes_succeed = true;
  std::vector<std::string> ids{"cath-1"};
  std::vector<TubeEstimate> estimates;
  std::vector<std::uint32_t> em_frames;
  std::vector<TrackerIdentity> trackers;
  std::vector<std::string>
      lines;          ///< of the log: number of the stage's state or validity, then words or reasons
  std::string words;  ///< of the first stage in the newest status
  std::vector<InstrumentStatus> instruments;  ///< in the newest status
  std::vector<StageReport> stages;            ///< likewise
  std::string systemctl_words;                ///< likewise
  int statuses = 0;
  int healths = 0;
  std::size_t stage_count = 0;
};

}  // namespace tubed
