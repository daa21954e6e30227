// Keeps a source open: reconnects with back-off for ever and says in words what is wrong.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <memory>
#include <string_view>
#include <utility>

#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/pipeline_settings.hpp"
#include "daemon/pipeline/stage.hpp"
#include "drivers/interface/condition.hpp"
#include "drivers/interface/source.hpp"

namespace tubed {

/// Source is EmSource or ImageSource, Frame what it reads. Called by the acquisition thread that owns it;
/// interrupt() by anybody. While the source is open nothing here allocates; opening may.
template <typename Source, typename Frame>
class SourceSession {
 public:
  SourceSession(std::unique_ptr<Source> source, const PipelineSettings& settings)
      : source_(std::move(source)),
        conditions_(dynamic_cast<HasCondition*>(source_.get())),
        first_back_off_(to_duration(settings.reconnect_first_ms)),
        last_back_off_(to_duration(settings.reconnect_last_ms)),
        back_off_(first_back_off_) {}

  ~SourceSession() { source_->close(); }
  SourceSession(const SourceSession&) = delete;
  SourceSession& operator=(const SourceSession&) = delete;

  /// Reads into `frame`, opening or reopening the source first where that is due. True when a frame came.
  /// Returns within about a tenth of a second, whatever the source does short of hanging in open().
  bool read(Frame& frame, const Clock& clock) noexcept {
    if (ended_) {
      bell_.wait_until(clock.now() + kPatience);
      return false;
    }
    if (!open_ && !try_open(clock)) {
      return false;
    }
    const ReadOutcome outcome = source_->read(frame, clock.now() + kPatience);
    take_condition();
    switch (outcome) {
      case ReadOutcome::kFrame:
        back_off_ = first_back_off_;
        if (conditions_ == nullptr) {
          state_ = StageState::kRunning;
          say("");
        }
        return true;
      case ReadOutcome::kTimeout:
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
    return false;
  }

  void interrupt() noexcept { bell_.ring(); }

  void describe(StageReport& report) const noexcept {
    report.state = state_;
    report.why = why_;
    report.refused += refused_;
    report.reconnects = reconnects_;
  }

 private:
  static constexpr std::chrono::milliseconds kPatience{50};

  static std::chrono::nanoseconds to_duration(double ms) {
    return std::chrono::nanoseconds{static_cast<std::int64_t>(ms * 1e6)};
  }

  bool try_open(const Clock& clock) noexcept {
    if (clock.now() < next_try_) {
      bell_.wait_until(std::min(next_try_, clock.now() + kPatience));
      return false;
    }
    OpenResult result = open_source();
    if (!result.ok) {
      lose(clock, result.why.c_str());
      return false;
    }
    reconnects_ += opened_before_ ? 1 : 0;
    open_ = opened_before_ = true;
    return true;
  }

  OpenResult open_source() noexcept {
    try {
      return source_->open();
    } catch (const std::exception& error) {
      return {false, error.what()};
    }
  }

  void lose(const Clock& clock, const char* why) noexcept {
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
    const std::string_view words = condition.words.text();
    std::snprintf(why_.data(), why_.size(), "%.*s", static_cast<int>(words.size()), words.data());
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

  void say(const char* why) noexcept { std::snprintf(why_.data(), why_.size(), "%s", why); }

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
  bool open_ = false;
  bool opened_before_ = false;
  bool ended_ = false;
};

}  // namespace tubed
