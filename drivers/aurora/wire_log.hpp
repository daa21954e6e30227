// Wire logs: a conversation with an Aurora as a text file that a person can read and a test can play. The
// README of this folder describes the format. Any thread; no state.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "drivers/aurora/wire_trace.hpp"

namespace tubed::aurora {

/// First line of every wire log.
inline constexpr std::string_view kWireLogTitle = "tubed wire log 1";

/// One line of a log. Owns its bytes.
struct WireLogEntry {
  std::chrono::nanoseconds time{};  ///< since the log's beginning
  WireEvent event = WireEvent::kNote;
  std::vector<std::uint8_t> bytes;  ///< of kSent and kReceived
  int bits_per_second = 0;          ///< of kBaudRate
  std::string note;                 ///< of kNote

  friend bool operator==(const WireLogEntry&, const WireLogEntry&) = default;
};

struct WireLog {
  std::vector<std::string> header;  ///< what stands behind "# " between the title and the first entry
  std::vector<WireLogEntry> entries;
};

/// Where and why a text is no wire log.
struct WireLogFault {
  int line = 0;  ///< counts from 1
  std::string why;
};

/// Reads a whole log.
[[nodiscard]] std::variant<WireLog, WireLogFault> parse_wire_log(std::string_view text);

/// A whole log as text: title, header (a line each), entries.
[[nodiscard]] std::string format_wire_log(const WireLog& log);

/// One record as it stands in a log, with the line feed; times count from `began`. Writes into `room` without
/// allocating and returns what was written, which always fits kMaxWireLogLine bytes.
[[nodiscard]] std::string_view format_wire_record(const WireRecord& record, MonotonicTime began,
                                                  std::span<char> room) noexcept;
inline constexpr std::size_t kMaxWireLogLine = 64 + 4 * WireTrace::kMaxRecord;

/// Everything that `trace` holds, as a log. `about` goes into the header: which program recorded it, and of
/// which device.
[[nodiscard]] std::string format_wire_trace(const WireTrace& trace, std::string_view about);

}  // namespace tubed::aurora
