// What Cyclone DDS says of itself. By default it writes to standard error from its own threads, a line for
// every packet it cannot read: a fault, or anybody, on the network fills the journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tubed {

/// Lets through a few messages a period, and says with the first of the next how many there were besides.
class MessageLimit {
 public:
  MessageLimit(int messages_a_period, std::int64_t period_ns)
      : messages_a_period_(messages_a_period), period_ns_(period_ns) {}

  /// The text to be logged at the time `now_ns`, monotonic; none when there have been enough. Line breaks
  /// become spaces, what cannot be shown is replaced (printable_text.hpp); what is longer than 300 bytes is
  /// cut.
  std::optional<std::string> admit(std::string_view message, std::int64_t now_ns);

 private:
  int messages_a_period_;
  std::int64_t period_ns_;
  std::optional<std::int64_t> period_began_ns_;
  int admitted_ = 0;
  std::uint64_t withheld_ = 0;
};

/// Receives Cyclone's messages. Both are called on threads of Cyclone's, one at a time.
struct CycloneListener {
  void (*say)(std::string_view words) = nullptr;
  std::int64_t (*monotonic_ns)() = nullptr;
};

/// From here on until the process ends Cyclone's warnings and errors are given to the listener, five in ten
/// seconds at most. Called once, before the first entity of Cyclone. Cyclone has one such sink a process.
void route_cyclone_log(CycloneListener listener);

/// Counted since route_cyclone_log(), also what was withheld. Any thread.
struct CycloneLogCounters {
  std::uint64_t messages = 0;
  std::uint64_t malformed_packets = 0;  ///< of them: packets that Cyclone could not read
};
[[nodiscard]] CycloneLogCounters cyclone_log_counters();

/// Collects what Cyclone writes to its log while the object lives, from any thread; its error codes alone say
/// little. One at a time. Afterwards the listener is listened to again, or standard error when there is none.
class CapturedCycloneLog {
 public:
  CapturedCycloneLog();
  ~CapturedCycloneLog();
  CapturedCycloneLog(const CapturedCycloneLog&) = delete;
  CapturedCycloneLog& operator=(const CapturedCycloneLog&) = delete;
  /// In one line, as it may be shown.
  [[nodiscard]] std::string words() const;

 private:
  std::string words_;
};

}  // namespace tubed
