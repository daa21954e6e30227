// What is wrong and what to do: each once, for whoever runs a session, and for as long as it lasts.
#pragma once

#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/words.hpp"

namespace tubed::aurora {

/// One thread; no allocation.
class Complaints {
 public:
  /// The next take() is true; also a line of the wire trace.
  void say(Exchange& exchange, const Problem& problem) noexcept;
  /// Whether something was said since the last take(): see last().
  bool take() noexcept;
  /// take() would be true.
  [[nodiscard]] bool waiting() const noexcept { return waiting_; }
  [[nodiscard]] const Problem& last() const noexcept { return last_; }
  /// What keeps it from measuring, until it measures; empty: nothing does.
  [[nodiscard]] const Problem& lasting() const noexcept { return lasting_; }
  /// It measures.
  void over() noexcept { lasting_.clear(); }

 private:
  Problem last_;
  Problem lasting_;
  bool waiting_ = false;
};

}  // namespace tubed::aurora
