// Keeps a source open: reconnects with back-off for ever and says in words what is wrong.
#pragma once

#include <algorithm>
#include <array>
#include <exception>
#include <memory>
#include <string_view>
#include <utility>

#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/pipeline_settings.hpp"
#include "daemon/pipeline/stage.hpp"
#include "drivers/interface/condition.hpp"
#include "drivers/interface/fed_locally.hpp"
#include "drivers/interface/source.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

/// A read that a stage has worked for: a frame, or what cannot be used.
constexpr bool came_to_something(ReadOutcome outcome) {
  return outcome == ReadOutcome::kFrame || outcome == ReadOutcome::kRefused;
}

/// Source is EmSource or ImageSource, Frame what it reads. Called by the acquisition thread that owns it;
/// interrupt() by anybody. While the source is open nothing here allocates; opening may.
template <typename Source, typename Frame>
class SourceSession {
 public:
  SourceSession(std::unique_ptr<Source> source, const PipelineSettings& settings)
      : source_(std::move(source)),
        conditions_(dynamic_cast<HasCondition*>(source_.get())),
        // A program of this machine costs next to nothing to ask for, and is used again within 250 ms.
        first_back_off_(to_duration(settings.reconnect_first_ms) / (is_fed_locally() ? 2 : 1)),
        last_back_off_(is_fed_locally() ? first_back_off_ : to_duration(settings.reconnect_last_ms)),
        back_off_(first_back_off_) {}

  ~SourceSession() { source_->close(); }
  SourceSession(const SourceSession&) = delete;
  SourceSession& operator=(const SourceSession&) = delete;

  [[nodiscard]] bool is_open() const noexcept { return open_; }

  /// Sleeps until there may be something to read, or until the source may be opened again; 50 ms at most, so
  /// that a stop is noticed, whatever the source waits for.
  void wait(const Clock& clock) noexcept {
    const MonotonicTime until = clock.now() + kMaxWait;
    if (!open_ || ended_) {
      bell_.wait_until(ended_ ? until : std::min(next_try_, until));
    } else if (!may_have_more_) {
      source_->wait(until);
    }
  }

  /// Opens or reopens the source where it is not open and that is due. True: it is open. May take as long as
  /// the source's open().
  bool open(const Clock& clock) noexcept {
    if (open_ || clock.now() < next_try_) {
      return open_;
    }
    OpenResult result = open_source();
    if (!result.ok) {
      lose(clock, result.why);
      return false;
    }
    if (conditions_ == nullptr) {
      reconnects_ += opened_before_ ? 1 : 0;
    } else if (!opened_before_) {
      state_ = StageState::kStarting;  // it was not there yet; it is not found again
    }
    open_ = opened_before_ = true;
    return true;
  }

  /// Reads into `frame` what has come. Waits for nothing but a source's close(), when it gives kLost.
  /// Precondition: is_open().
  ReadOutcome read(Frame& frame, const Clock& clock) noexcept {
    if (ended_) {
      return ReadOutcome::kNothing;
    }
    const ReadOutcome outcome = source_->read(frame);
    may_have_more_ = came_to_something(outcome);
    take_condition();
    switch (outcome) {
      case ReadOutcome::kFrame:
        back_off_ = first_back_off_;
        if (conditions_ == nullptr) {
          state_ = StageState::kRunning;
          say("");
        }
        break;
      case ReadOutcome::kNothing:
        break;
      case ReadOutcome::kRefused:
        ++refused_;
        break;
      case ReadOutcome::kLost:
        lose(clock, "the device is gone; reconnecting");
        break;
      case ReadOutcome::kEnded:
        ended_ = true;
        state_ = StageState::kEnded;
        say("the recording is over");
        break;
    }
    return outcome;
  }

  void interrupt() noexcept { bell_.ring(); }

  void describe(StageReport& report) const noexcept {
    report.state = state_;
    report.why = why_;
    report.refused += refused_;
    report.reconnects = reconnects_;
  }

 private:
  static constexpr std::chrono::milliseconds kMaxWait{50};

  static std::chrono::nanoseconds to_duration(double ms) {
    return std::chrono::nanoseconds{static_cast<std::int64_t>(ms * 1e6)};
  }

  [[nodiscard]] bool is_fed_locally() const { return dynamic_cast<IsFedLocally*>(source_.get()) != nullptr; }

  OpenResult open_source() noexcept {
    try {
      return source_->open();
    } catch (const std::exception& error) {
      return {false, error.what()};
    }
  }

  void lose(const Clock& clock, std::string_view why) noexcept {
    source_->close();
    open_ = false;
    state_ = StageState::kReconnecting;
    say(why);
    next_try_ = clock.now() + back_off_;
    back_off_ = std::min(2 * back_off_, last_back_off_);
  }

  // A source that looks for its device by itself says where it is; a device that delivers again after it was
  // away has been found again.
  void take_condition() noexcept {
    if (conditions_ == nullptr) {
      return;
    }
    const SourceCondition condition = conditions_->condition();
    const StageState before = state_;
    state_ = stage_state(condition.state);
    reconnects_ += before == StageState::kReconnecting && state_ == StageState::kRunning ? 1 : 0;
    say(condition.words.text());
  }

  static StageState stage_state(DeviceState state) noexcept {
    switch (state) {
      case DeviceState::kStarting:
        return StageState::kStarting;
      case DeviceState::kRunning:
        return StageState::kRunning;
      case DeviceState::kReconnecting:
        break;
    }
    return StageState::kReconnecting;
  }

  // What a source says may be in the words of whoever is at its other end.
  void say(std::string_view why) noexcept { copy_printable(why, why_); }

  std::unique_ptr<Source> source_;
  HasCondition* conditions_;  ///< the same object, when it looks for its device by itself
  std::chrono::nanoseconds first_back_off_;
  std::chrono::nanoseconds last_back_off_;
  std::chrono::nanoseconds back_off_;
  MonotonicTime next_try_{};
  Doorbell bell_;
  StageState state_ = StageState::kStarting;
  std::array<char, 256> why_{};
  std::uint64_t refused_ = 0;
  std::uint64_t reconnects_ = 0;
  bool may_have_more_ = false;  ///< the last read gave something: the next one may, without any waiting
  bool open_ = false;
  bool opened_before_ = false;
  bool ended_ = false;
};

}  // namespace tubed
