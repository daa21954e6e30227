// How one assumption about the Aurora is judged by a conversation.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "clients/tubectl/check/wire_conversation.hpp"

namespace tubed {

/// What a conversation says about an assumption.
enum class AssumptionVerdict { kHolds, kDoesNotHold, kNotTried };

/// "holds", "does not hold", "not tried".
[[nodiscard]] std::string_view name_of(AssumptionVerdict verdict);

struct Judgement {
  AssumptionVerdict verdict = AssumptionVerdict::kNotTried;
  std::optional<std::chrono::nanoseconds> time;  ///< in the log; nothing when nothing was tried
  std::string evidence;                          ///< what was seen, with bytes; or what would try it
};

/// What one turn says for or against an assumption.
enum class Sign { kFor, kAgainst, kNothing };

/// `bytes` as they stand in a wire log, at most `max_size` characters of it.
[[nodiscard]] std::string quoted(std::string_view bytes, std::size_t max_size = 44);
/// Handles with report and frame number, and the system status: "0A pose 00000008, status 0000".
[[nodiscard]] std::string quoted(const WireMeasurement& measurement);
/// Command and reply of a turn, as "> PHSR:01E03E < 00"; a measurement is taken apart.
[[nodiscard]] std::string quoted(const WireTurn& turn);
/// `digits` upper-case hexadecimal digits.
[[nodiscard]] std::string hex(std::uint32_t value, int digits);
/// A time or a number with a unit, as "1.30 s".
[[nodiscard]] std::string with_unit(double value, int digits, std::string_view unit);
[[nodiscard]] double seconds_of(std::chrono::nanoseconds time);

[[nodiscard]] Judgement not_tried(std::string_view what_would_try_it);
/// `verdict` kHolds or kDoesNotHold.
[[nodiscard]] Judgement judged(AssumptionVerdict verdict, std::chrono::nanoseconds time,
                               std::string evidence);
[[nodiscard]] inline AssumptionVerdict verdict_if(bool holds) {
  return holds ? AssumptionVerdict::kHolds : AssumptionVerdict::kDoesNotHold;
}

/// Holds when some turn is for it and none against it; the evidence is the first turn against it, else the
/// first for it.
template <typename Look>
[[nodiscard]] Judgement judge_each(const WireConversation& conversation, std::string_view what_would_try_it,
                                   Look look) {
  const WireTurn* first_for = nullptr;
  int count = 0;
  for (const WireTurn& turn : conversation.turns) {
    const Sign sign = look(turn);
    if (sign == Sign::kAgainst) {
      return judged(AssumptionVerdict::kDoesNotHold, turn.sent, quoted(turn));
    }
    if (sign == Sign::kFor) {
      first_for = first_for == nullptr ? &turn : first_for;
      ++count;
    }
  }
  if (first_for == nullptr) {
    return not_tried(what_would_try_it);
  }
  const std::string times = count > 1 ? " (" + std::to_string(count) + " times)" : "";
  return judged(AssumptionVerdict::kHolds, first_for->sent, quoted(*first_for) + times);
}

/// Holds when more turns are for it than against it: for what a disturbed line spoils now and then.
template <typename Look>
[[nodiscard]] Judgement judge_most(const WireConversation& conversation, std::string_view what_would_try_it,
                                   Look look) {
  const WireTurn* first[2] = {nullptr, nullptr};
  int count[2] = {0, 0};
  for (const WireTurn& turn : conversation.turns) {
    const Sign sign = look(turn);
    if (sign != Sign::kNothing) {
      const int side = sign == Sign::kFor ? 1 : 0;
      first[side] = first[side] == nullptr ? &turn : first[side];
      ++count[side];
    }
  }
  if (count[0] + count[1] == 0) {
    return not_tried(what_would_try_it);
  }
  const bool holds = count[1] > count[0];
  return judged(verdict_if(holds), first[holds ? 1 : 0]->sent,
                std::to_string(count[1]) + " of " + std::to_string(count[0] + count[1]) + ": " +
                    quoted(*first[holds ? 1 : 0]));
}

}  // namespace tubed
