#include "clients/tubectl/check/aurora_start_judgements.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_replies.hpp"

namespace tubed::judging {

namespace {

using aurora::ReplyKind;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr milliseconds kResetTimeout{2500};
constexpr seconds kSlowestReply{5};

bool is_text(const WireTurn& turn) { return turn.reply && turn.reply->kind == ReplyKind::kText; }

std::optional<aurora::HandleList> handles_of(const WireTurn& turn) {
  return turn.name == "PHSR" && is_text(turn) ? aurora::parse_handle_list(turn.reply->payload) : std::nullopt;
}

struct ToolQuestion {
  std::uint8_t handle = 0;
  std::uint16_t fields = aurora::kToolField;
};

/// What a PHINF asked for; nothing when it asked for fields whose width nobody knows.
std::optional<ToolQuestion> tool_question(const WireTurn& turn) {
  constexpr std::uint32_t kKnown = aurora::kToolField | aurora::kPartNumberField | aurora::kLocationField;
  const std::string& asked = turn.parameters;
  const auto handle = aurora::parse_hex(asked.substr(0, 2));
  const auto fields = asked.size() == 2   ? std::optional<std::uint32_t>(aurora::kToolField)
                      : asked.size() == 6 ? aurora::parse_hex(asked.substr(2))
                                          : std::nullopt;
  if (turn.name != "PHINF" || asked.size() < 2 || !handle || !fields || *fields == 0 ||
      (*fields & ~kKnown) != 0) {
    return std::nullopt;
  }
  return ToolQuestion{static_cast<std::uint8_t>(*handle), static_cast<std::uint16_t>(*fields)};
}

std::optional<aurora::ToolReply> tool_of(const WireTurn& turn) {
  const auto question = tool_question(turn);
  return question && is_text(turn) ? aurora::parse_tool(turn.reply->payload, question->fields) : std::nullopt;
}

/// Whether the tracker has the rate that COMM names by `letter`, and is heard at it.
Judgement has_rate(const WireConversation& conversation, char letter, std::string_view hint) {
  const int rate = aurora::bits_per_second(static_cast<aurora::BaudRate>(letter));
  const auto& turns = conversation.turns;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (turns[i].name != "COMM" || turns[i].parameters.substr(0, 1) != std::string(1, letter)) {
      continue;
    }
    if (turns[i].is_error() || !turns[i].reply) {
      return judged(AssumptionVerdict::kDoesNotHold, turns[i].sent, quoted(turns[i]));
    }
    bool was_tried = false;
    for (std::size_t next = i + 1; next < turns.size() && turns[next].bits_per_second == rate; ++next) {
      was_tried = true;
      if (turns[next].reply) {
        return judged(AssumptionVerdict::kHolds, turns[next].sent, quoted(turns[next]));
      }
    }
    if (was_tried) {
      return judged(AssumptionVerdict::kDoesNotHold, turns[i].sent,
                    quoted(turns[i]) + ", then nothing was heard at " + std::to_string(rate) + " baud");
    }
  }
  return not_tried(hint);
}

/// All turns with one of `names` were answered in time; the slowest is the evidence.
Judgement answered_in_time(const WireConversation& conversation, const std::set<std::string>& names,
                           std::string_view hint) {
  const WireTurn* slowest = nullptr;
  for (const WireTurn& turn : conversation.turns) {
    if (!names.contains(turn.name)) {
      continue;
    }
    if (!turn.reply || turn.reply->last_byte - turn.sent > kSlowestReply) {
      return judged(AssumptionVerdict::kDoesNotHold, turn.sent, quoted(turn));
    }
    const bool is_slower =
        slowest == nullptr || turn.reply->last_byte - turn.sent > slowest->reply->last_byte - slowest->sent;
    slowest = is_slower ? &turn : slowest;
  }
  if (slowest == nullptr) {
    return not_tried(hint);
  }
  return judged(AssumptionVerdict::kHolds, slowest->sent,
                "slowest " + with_unit(seconds_of(slowest->reply->last_byte - slowest->sent), 2, "s: ") +
                    quoted(*slowest));
}

}  // namespace

Judgement check_sums(const WireConversation& conversation) {
  if (conversation.replies + conversation.damaged == 0) {
    return not_tried("nothing was received");
  }
  const bool holds = conversation.replies > conversation.damaged;
  return judged(verdict_if(holds), conversation.first_damage.value_or(nanoseconds{}),
                std::to_string(conversation.replies) + " replies with a right check sum, " +
                    std::to_string(conversation.damaged) + " with a wrong one" +
                    (conversation.damaged > 0 ? ", the first at this time" : ""));
}

Judgement form_without_check_sum(const WireConversation& conversation) {
  return judge_each(conversation, "no command was sent without check sum", [](const WireTurn& turn) {
    if (turn.name.empty() || turn.has_check_sum || !turn.reply) {
      return Sign::kNothing;
    }
    constexpr std::uint8_t kInvalidCommand = 0x01;
    constexpr std::uint8_t kBadCheckSum = 0x04;
    const bool is_refused = turn.is_error(kInvalidCommand) || turn.is_error(kBadCheckSum);
    return is_refused ? Sign::kAgainst : Sign::kFor;
  });
}

Judgement one_reply_a_command(const WireConversation& conversation) {
  for (const StrayReply& stray : conversation.strays) {
    if (!stray.is_reset) {
      return judged(AssumptionVerdict::kDoesNotHold, stray.time,
                    "nobody waited for < " + tubed::quoted(stray.payload));
    }
  }
  const auto answered = std::count_if(conversation.turns.begin(), conversation.turns.end(),
                                      [](const WireTurn& turn) { return turn.reply.has_value(); });
  return answered == 0
             ? not_tried("no command was answered")
             : judged(AssumptionVerdict::kHolds, conversation.turns.front().sent,
                      std::to_string(answered) + " of " + std::to_string(conversation.turns.size()) +
                          " commands answered, none twice");
}

Judgement reset_after_break(const WireConversation& conversation) {
  Judgement found = not_tried("no break was sent");
  for (const WireBreak& one : conversation.breaks) {
    if (one.reset && *one.reset - one.sent <= kResetTimeout) {
      return judged(AssumptionVerdict::kHolds, one.sent,
                    "RESET " + with_unit(seconds_of(*one.reset - one.sent), 2, "s") + " after the break");
    }
    if (one.reset || conversation.end - one.sent > kResetTimeout) {
      found = judged(AssumptionVerdict::kDoesNotHold, one.sent,
                     "break, no RESET within 2.5 s (some adapters swallow a break; a pseudo-terminal does)");
    }
  }
  return found;
}

Judgement comm_at_old_rate(const WireConversation& conversation) {
  const auto& turns = conversation.turns;
  Judgement found = not_tried("no COMM to another rate was answered by OKAY");
  for (std::size_t i = 0; i + 1 < turns.size(); ++i) {
    const bool changes = turns[i].name == "COMM" && turns[i].okay() &&
                         turns[i + 1].bits_per_second != turns[i].bits_per_second;
    if (!changes) {
      continue;
    }
    if (turns[i + 1].reply) {
      return judged(AssumptionVerdict::kHolds, turns[i].sent,
                    quoted(turns[i]) + ", then " + quoted(turns[i + 1]));
    }
    found = judged(AssumptionVerdict::kDoesNotHold, turns[i].sent,
                   quoted(turns[i]) + ", then " + quoted(turns[i + 1]));
  }
  return found;
}

Judgement has_230400(const WireConversation& conversation) {
  return has_rate(conversation, 'A', "COMM:A0000 was not sent; a serial port without this rate cannot");
}
Judgement has_921600(const WireConversation& conversation) {
  return has_rate(conversation, '6', "COMM:60000 was not sent; a serial port without this rate cannot");
}

Judgement family_d(const WireConversation& conversation) {
  return judge_each(conversation, "APIREV was not asked", [](const WireTurn& turn) {
    if (turn.name != "APIREV" || !turn.reply) {
      return Sign::kNothing;
    }
    const auto revision = aurora::parse_api_revision(turn.reply->payload);
    return revision && revision->family == 'D' ? Sign::kFor : Sign::kAgainst;
  });
}

Judgement freeze_tag(const WireConversation& conversation) {
  Judgement found = not_tried("neither VER:0 nor VER:4 was asked");
  for (const WireTurn& turn : conversation.turns) {
    if (turn.name != "VER" || (turn.parameters != "0" && turn.parameters != "4") || !turn.reply) {
      continue;
    }
    if (const auto firmware = aurora::find_firmware(turn.reply->payload)) {
      return judged(AssumptionVerdict::kHolds, turn.sent,
                    "> " + tubed::quoted(turn.line) + " < ...Freeze Tag: " + tubed::quoted(*firmware));
    }
    found = judged(AssumptionVerdict::kDoesNotHold, turn.sent, quoted(turn));
  }
  return found;
}

Judgement own_timeouts(const WireConversation& conversation) {
  constexpr std::string_view kParameter = "Info.Timeout.PINIT";
  return judge_each(conversation, "GET:Info.Timeout.PINIT was not asked", [&](const WireTurn& turn) {
    if (turn.name != "GET" || turn.parameters != kParameter || !turn.reply) {
      return Sign::kNothing;
    }
    const bool is_given = aurora::find_user_parameter(turn.reply->payload, kParameter).has_value();
    return is_given ? Sign::kFor : Sign::kAgainst;
  });
}

Judgement handle_lists(const WireConversation& conversation) {
  return judge_each(conversation, "PHSR was not asked", [](const WireTurn& turn) {
    if (turn.name != "PHSR" || !is_text(turn)) {
      return Sign::kNothing;
    }
    return handles_of(turn) ? Sign::kFor : Sign::kAgainst;
  });
}

Judgement status_before_pinit(const WireConversation& conversation) {
  const std::string_view hint = "PHSR:02 listed no handle";
  return judge_each(conversation, hint, [](const WireTurn& turn) {
    const auto handles = handles_of(turn);
    if (turn.parameters != "02" || !handles || handles->count == 0) {
      return Sign::kNothing;
    }
    const auto entries = handles->entries();
    return std::all_of(entries.begin(), entries.end(),
                       [](const aurora::HandleStatus& entry) {
                         return entry.status.occupied() && !entry.status.initialised() &&
                                !entry.status.enabled();
                       })
               ? Sign::kFor
               : Sign::kAgainst;
  });
}

Judgement pinit_time(const WireConversation& conversation) {
  return answered_in_time(conversation, {"PINIT"}, "PINIT was not sent");
}

Judgement start_and_stop_time(const WireConversation& conversation) {
  return answered_in_time(conversation, {"TSTART", "TSTOP"}, "neither TSTART nor TSTOP was sent");
}

// Handles change their meaning when they are freed or the tracker starts anew: what was known is forgotten
// then.
Judgement second_coil_of_plug(const WireConversation& conversation) {
  std::set<std::uint8_t> initialised_by_list;
  std::set<std::uint8_t> initialised_by_command;
  std::set<std::uint8_t> second_channel;
  for (const WireTurn& turn : conversation.turns) {
    if ((turn.name == "INIT" || turn.name == "PHF") && turn.okay()) {
      initialised_by_list.clear();
      initialised_by_command.clear();
      second_channel.clear();
    } else if (turn.name == "PINIT" && turn.okay()) {
      const auto handle = aurora::parse_hex(turn.parameters);
      initialised_by_command.insert(static_cast<std::uint8_t>(handle.value_or(0)));
    } else if (const auto handles = handles_of(turn)) {
      for (const aurora::HandleStatus& entry : handles->entries()) {
        if (entry.status.initialised()) {
          initialised_by_list.insert(entry.handle);
        }
      }
    } else if (const auto tool = tool_of(turn); tool && tool->location && tool->location->channel > 0) {
      second_channel.insert(tool_question(turn)->handle);
    }
    for (const std::uint8_t handle : second_channel) {
      if (initialised_by_command.contains(handle)) {
        return judged(AssumptionVerdict::kDoesNotHold, turn.sent,
                      "a coil on channel 1 needed its own PINIT: " + quoted(turn));
      }
      if (initialised_by_list.contains(handle)) {
        return judged(AssumptionVerdict::kHolds, turn.sent,
                      "a coil on channel 1 was initialised without PINIT: " + quoted(turn));
      }
    }
  }
  return not_tried("no tool with two coils is plugged in");
}

Judgement serials_of_plug(const WireConversation& conversation) {
  std::map<int, std::map<int, std::uint32_t>> serials;  // by port and channel
  std::map<std::uint8_t, std::uint32_t> serial_of_handle;
  Judgement found = not_tried("no tool with two coils is plugged in, or PHINF was not asked for both");
  for (const WireTurn& turn : conversation.turns) {
    if (turn.name == "PHF" || turn.name == "TSTART" || turn.name == "INIT") {
      serials.clear();
      serial_of_handle.clear();
    }
    const auto tool = tool_of(turn);
    if (!tool) {
      continue;
    }
    const std::uint8_t handle = tool_question(turn)->handle;
    if (tool->tool) {
      serial_of_handle[handle] = tool->tool->serial_number;
    }
    if (!tool->location || !serial_of_handle.contains(handle)) {
      continue;
    }
    auto& of_port = serials[tool->location->port];
    of_port[tool->location->channel] = serial_of_handle[handle];
    if (of_port.size() < 2) {
      continue;
    }
    const bool same = of_port.begin()->second == of_port.rbegin()->second;
    const std::string words = "port " + std::to_string(tool->location->port) +
                              (same ? ", both channels: the same serial: " : ": two serials: ");
    if (!same || found.verdict == AssumptionVerdict::kNotTried) {
      found = judged(verdict_if(same), turn.sent, words + quoted(turn));
    }
    if (!same) {
      return found;
    }
  }
  return found;
}

Judgement tool_fields(const WireConversation& conversation) {
  return judge_each(conversation, "PHINF was not asked for these fields", [](const WireTurn& turn) {
    const auto tool = tool_of(turn);
    if (!tool_question(turn) || !is_text(turn) || (tool && tool->unoccupied)) {
      return Sign::kNothing;
    }
    return tool ? Sign::kFor : Sign::kAgainst;
  });
}

}  // namespace tubed::judging
