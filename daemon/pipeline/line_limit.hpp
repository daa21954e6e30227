// When a change is worth a line of the log, so that what flaps does not flood it.
#pragma once

#include <chrono>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Of one stage or one instrument: its state, and the words that go with it. Called by one thread; logs
/// nothing itself.
template <typename State, typename Words>
class LineLimit {
 public:
  /// True when a line is due that says `state` and `words`. A new state is due at once unless the last line
  /// of a new state is younger than a second; new words are due when the last line of any kind is a second
  /// old. What is not due yet is compared again with the next call, so that the newest is never lost.
  bool is_due(const State& state, const Words& words, MonotonicTime now) {
    const bool state_is_new = state != said_state_;
    if (!state_is_new && words == said_words_) {
      return false;
    }
    if (now < (state_is_new ? next_state_line_ : next_line_)) {
      return false;
    }
    said_state_ = state;
    said_words_ = words;
    next_line_ = now + kBetweenLines;
    next_state_line_ = state_is_new ? next_line_ : next_state_line_;
    return true;
  }

 private:
  static constexpr std::chrono::seconds kBetweenLines{1};

  State said_state_{};
  Words said_words_{};
  MonotonicTime next_line_{};
  MonotonicTime next_state_line_{};
};

}  // namespace tubed
