// A wire log as commands and what the tracker answered. Pure: from entries to values.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/aurora/reply.hpp"
#include "drivers/aurora/tracking_reply.hpp"
#include "drivers/aurora/wire_log.hpp"

namespace tubed {

/// A reply whose check sum was right.
struct WireReply {
  aurora::ReplyKind kind = aurora::ReplyKind::kText;
  std::uint8_t error_code = 0;            ///< of kError
  std::string payload;                    ///< without check sum and carriage return; of kBinary the body
  std::chrono::nanoseconds first_byte{};  ///< it began on the line at about this time of the log
  std::chrono::nanoseconds last_byte{};   ///< it was whole
};

/// What a TX or BX reply measured.
struct WireMeasurement {
  std::vector<aurora::HandleReading> readings;
  aurora::SystemStatus system_status;

  /// Frame number that all handles with a pose share or, without any, all that are missing; nothing when they
  /// differ or there are none.
  [[nodiscard]] std::optional<std::uint32_t> frame() const;
};

/// One command and its reply.
struct WireTurn {
  std::chrono::nanoseconds sent{};
  std::chrono::nanoseconds sent_whole{};  ///< its last byte has left the host, at the rate of the line
  std::string line;                       ///< as sent, without the carriage return
  std::string name;                       ///< upper case
  std::string parameters;
  bool has_check_sum = true;
  int bits_per_second = 9600;
  bool while_tracking = false;     ///< the tracker tracked when it was sent
  bool during_reply = false;       ///< it was sent while the reply to the one before was arriving
  bool damaged = false;            ///< what came back had a wrong check sum
  std::optional<WireReply> reply;  ///< nothing: none came, or a damaged one
  std::optional<WireMeasurement> measurement;

  [[nodiscard]] bool okay() const;
  [[nodiscard]] bool is_error(std::uint8_t code) const;
  [[nodiscard]] bool is_error() const;
};

/// A serial break and the RESET after it.
struct WireBreak {
  std::chrono::nanoseconds sent{};
  std::optional<std::chrono::nanoseconds> reset;
};

/// A reply that no command waited for.
struct StrayReply {
  std::chrono::nanoseconds time{};
  std::string payload;
  bool is_reset = false;
};

struct WireConversation {
  std::vector<WireTurn> turns;
  std::vector<WireBreak> breaks;
  std::vector<StrayReply> strays;
  std::uint64_t replies = 0;  ///< with right check sums
  std::uint64_t damaged = 0;  ///< with wrong ones
  std::optional<std::chrono::nanoseconds> first_damage;
  std::chrono::nanoseconds end{};  ///< time of the last entry
};

/// Reads what was said. Whatever the log holds, this ends: what is no reply is damage, a command without
/// reply is a turn without.
[[nodiscard]] WireConversation read_conversation(const aurora::WireLog& log);

}  // namespace tubed
