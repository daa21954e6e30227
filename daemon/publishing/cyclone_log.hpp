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
  /// become spaces; what is longer than 300 characters is cut.
  std::optional<std::string> admit(std::string_view message, std::int64_t now_ns);

 private:
  int messages_a_period_;
  std::int64_t period_ns_;
  std::optional<std::int64_t> period_began_ns_;
  int admitted_ = 0;
  std::uint64_t withheld_ = 0;
};

/// From here on Cyclone's warnings and errors are given to `say`, on threads of Cyclone's, one at a time and
/// five in ten seconds at most. Called once, before the first entity of Cyclone.
void route_cyclone_log(void (*say)(std::string_view words));

}  // namespace tubed
