// How far a tracker's start-up has come, read from the trace of its line: a tool takes 2.6 s, so that how
// long to wait depends on how many there are.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "drivers/aurora/wire_trace.hpp"

namespace tubed {

struct TrackerStartup {
  std::string doing;               ///< what was said last: "PINIT of handle 0B, 2 of 4"; empty: nothing yet
  std::set<std::uint8_t> handles;  ///< that were listed to be initialised
  int blocks_written = 0;          ///< of tools' memories
  std::optional<MonotonicTime> answered_at;  ///< the tracker's first answer
  /// How often a command was answered with an ERROR.
  std::map<std::pair<std::string, std::uint8_t>, int> errors;

  /// When to give up waiting for a measurement; `began`: when the conversation did.
  [[nodiscard]] MonotonicTime deadline(MonotonicTime began) const;
  /// "ERROR13 to PINIT (2 times), ERROR01 to BX"; empty when there were none.
  [[nodiscard]] std::string error_text() const;
};

/// From all that `trace` holds.
TrackerStartup read_startup(const aurora::WireTrace& trace);

}  // namespace tubed
