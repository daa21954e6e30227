#include "clients/tubectl/check/aurora_tracking_judgements.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_replies.hpp"

namespace tubed::judging {

namespace {

using aurora::Report;
using std::chrono::seconds;

constexpr std::uint8_t kNotInThisMode = 0x0C;

/// What a command that the tracker should refuse while it tracks was answered.
Sign refused_while_tracking(const WireTurn& turn, const std::set<std::string>& names) {
  if (!turn.while_tracking || !names.contains(turn.name) || !turn.reply) {
    return Sign::kNothing;
  }
  return turn.is_error(kNotInThisMode) ? Sign::kFor : Sign::kAgainst;
}

/// Other errors than that of the mode say nothing: the command was looked at.
Sign answered_while_tracking(const WireTurn& turn, const std::set<std::string>& names) {
  if (!turn.while_tracking || !names.contains(turn.name)) {
    return Sign::kNothing;
  }
  if (!turn.reply || turn.is_error(kNotInThisMode)) {
    return Sign::kAgainst;
  }
  return turn.is_error() ? Sign::kNothing : Sign::kFor;
}

bool is_untracked(const aurora::HandleReading& reading) {
  return reading.report == Report::kDisabled || reading.report == Report::kUnoccupied;
}

/// Which handles there are, and which are enabled, as far as the conversation says.
class Handles {
 public:
  void follow(const WireTurn& turn) {
    const auto handle = static_cast<std::uint8_t>(
        aurora::parse_hex(std::string_view(turn.parameters).substr(0, 2)).value_or(0));
    if (turn.name == "INIT" && turn.okay()) {
      allocated_.clear();
      enabled_.clear();
    } else if (turn.name == "PENA" && turn.okay()) {
      enabled_.insert(handle);
    } else if (turn.name == "PDIS" && turn.okay()) {
      enabled_.erase(handle);
    } else if (turn.name == "PHF" && turn.okay()) {
      allocated_.erase(handle);
      enabled_.erase(handle);
    } else if (turn.name == "PHSR" && turn.reply) {
      take_list(turn.reply->payload);
    }
  }
  [[nodiscard]] std::vector<std::uint8_t> not_enabled() const {
    std::vector<std::uint8_t> found;
    std::set_difference(allocated_.begin(), allocated_.end(), enabled_.begin(), enabled_.end(),
                        std::back_inserter(found));
    return found;
  }

 private:
  void take_list(std::string_view payload) {
    const auto list = aurora::parse_handle_list(payload);
    if (!list) {
      return;
    }
    for (const aurora::HandleStatus& entry : list->entries()) {
      allocated_.insert(entry.handle);
      if (entry.status.enabled()) {
        enabled_.insert(entry.handle);
      }
    }
  }

  std::set<std::uint8_t> allocated_;
  std::set<std::uint8_t> enabled_;
};

/// The first reply in which a bit of the system status is set that the one before, of the same time of
/// tracking, did not have; nullptr when there is none.
template <typename HasBit>
const WireTurn* first_with_bit(const WireConversation& conversation, HasBit has_bit) {
  const WireTurn* last = nullptr;
  for (const WireTurn& turn : conversation.turns) {
    if (turn.name == "TSTOP" || turn.name == "TSTART") {
      last = nullptr;
    }
    if (!turn.measurement) {
      continue;
    }
    if (last != nullptr && has_bit(turn.measurement->system_status) &&
        !has_bit(last->measurement->system_status)) {
      return &turn;
    }
    last = &turn;
  }
  return nullptr;
}

Sign layout(const WireTurn& turn, std::string_view name) {
  if (turn.name != name || turn.is_error() || (!turn.reply && !turn.damaged)) {
    return Sign::kNothing;
  }
  return turn.measurement ? Sign::kFor : Sign::kAgainst;
}

}  // namespace

// A measurement may be ready already when a slow host asks: most first replies decide.
Judgement first_reply_is_missing(const WireConversation& conversation) {
  bool has_started = false;
  return judge_most(conversation, "no TX or BX after a TSTART", [&](const WireTurn& turn) {
    has_started = has_started || (turn.name == "TSTART" && turn.okay());
    if (!has_started || !turn.measurement) {
      return Sign::kNothing;
    }
    has_started = false;
    const auto& readings = turn.measurement->readings;
    if (std::all_of(readings.begin(), readings.end(), is_untracked)) {
      return Sign::kNothing;
    }
    return std::all_of(readings.begin(), readings.end(),
                       [](const aurora::HandleReading& reading) {
                         return is_untracked(reading) ||
                                (reading.report == Report::kMissing && reading.frame == 0);
                       })
               ? Sign::kFor
               : Sign::kAgainst;
  });
}

Judgement bx_layout(const WireConversation& conversation) {
  return judge_most(conversation, "BX was not asked",
                    [](const WireTurn& turn) { return layout(turn, "BX"); });
}

Judgement tx_layout(const WireConversation& conversation) {
  return judge_most(conversation, "TX was not asked",
                    [](const WireTurn& turn) { return layout(turn, "TX"); });
}

Judgement lists_disabled_handles(const WireConversation& conversation) {
  Handles handles;
  Judgement found = not_tried("every handle was enabled while the tracker tracked");
  for (const WireTurn& turn : conversation.turns) {
    handles.follow(turn);
    if (!turn.measurement) {
      continue;
    }
    for (const std::uint8_t handle : handles.not_enabled()) {
      const auto& readings = turn.measurement->readings;
      const auto listed = std::find_if(readings.begin(), readings.end(),
                                       [&](const auto& reading) { return reading.handle == handle; });
      const bool holds = listed != readings.end() && is_untracked(*listed);
      if (!holds || found.verdict == AssumptionVerdict::kNotTried) {
        found = judged(verdict_if(holds), turn.sent,
                       "handle " + hex(handle, 2) + " is not enabled and " +
                           (listed == readings.end() ? "not listed: "
                            : holds                  ? "listed: "
                                                     : "listed as tracked: ") +
                           quoted(turn));
      }
      if (!holds) {
        return found;
      }
    }
  }
  return found;
}

Judgement min_turn(const WireConversation& conversation) {
  constexpr double kRounding = 0.00011;  // TX has four digits
  int samples = 0;
  const WireTurn* first = nullptr;
  for (const WireTurn& turn : conversation.turns) {
    if (!turn.measurement) {
      continue;
    }
    for (const aurora::HandleReading& reading : turn.measurement->readings) {
      if (reading.report != Report::kValid) {
        continue;
      }
      const aurora::Quaternion& q = reading.rotation;
      if (std::abs(q.qz) > kRounding || q.q0 < -kRounding) {
        return judged(AssumptionVerdict::kDoesNotHold, turn.sent,
                      "handle " + hex(reading.handle, 2) + ": q0 " + with_unit(q.q0, 4, "qz ") +
                          with_unit(q.qz, 4, "(so with a 6-DOF tool)"));
      }
      ++samples;
      first = first == nullptr ? &turn : first;
    }
  }
  return first == nullptr
             ? not_tried("no pose was measured: bring the tool into the volume")
             : judged(AssumptionVerdict::kHolds, first->sent, "all " + std::to_string(samples) + " poses");
}

Judgement one_frame_a_reply(const WireConversation& conversation) {
  return judge_each(conversation, "no reply with two poses", [](const WireTurn& turn) {
    if (!turn.measurement) {
      return Sign::kNothing;
    }
    std::set<std::uint32_t> frames;
    int poses = 0;
    for (const aurora::HandleReading& reading : turn.measurement->readings) {
      if (reading.report == Report::kValid) {
        ++poses;
        frames.insert(reading.frame);
      }
    }
    return poses < 2 ? Sign::kNothing : frames.size() == 1 ? Sign::kFor : Sign::kAgainst;
  });
}

Judgement phsr_while_tracking(const WireConversation& conversation) {
  return judge_each(conversation, "PHSR was not sent while the tracker tracked",
                    [](const WireTurn& turn) { return refused_while_tracking(turn, {"PHSR"}); });
}

Judgement phinf_while_tracking(const WireConversation& conversation) {
  return judge_each(conversation, "PHINF was not sent while the tracker tracked",
                    [](const WireTurn& turn) { return answered_while_tracking(turn, {"PHINF"}); });
}

Judgement ver_and_comm_while_tracking(const WireConversation& conversation) {
  return judge_each(conversation, "neither VER nor COMM was sent while the tracker tracked",
                    [](const WireTurn& turn) {
                      return answered_while_tracking(turn, {"VER", "COMM"});
                    });
}

Judgement pinit_and_pdis_while_tracking(const WireConversation& conversation) {
  return judge_each(conversation, "neither PINIT nor PDIS was sent while the tracker tracked",
                    [](const WireTurn& turn) {
                      return refused_while_tracking(turn, {"PINIT", "PDIS"});
                    });
}

Judgement init_while_tracking(const WireConversation& conversation) {
  return judge_each(conversation, "INIT was not sent while the tracker tracked",
                    [](const WireTurn& turn) { return refused_while_tracking(turn, {"INIT"}); });
}

Judgement command_during_reply(const WireConversation& conversation) {
  Judgement found = not_tried("no command was sent while a reply was arriving");
  const auto& turns = conversation.turns;
  for (std::size_t i = 1; i < turns.size(); ++i) {
    if (!turns[i].during_reply) {
      continue;
    }
    const bool holds = turns[i].reply && turns[i - 1].reply;
    if (!holds || found.verdict == AssumptionVerdict::kNotTried) {
      found = judged(verdict_if(holds), turns[i].sent, quoted(turns[i - 1]) + "; " + quoted(turns[i]));
    }
    if (!holds) {
      return found;
    }
  }
  return found;
}

Judgement pulled_plug(const WireConversation& conversation) {
  const WireTurn* const pulled = first_with_bit(
      conversation, [](aurora::SystemStatus status) { return status.port_became_unoccupied(); });
  if (pulled == nullptr) {
    return not_tried("no plug was pulled while the tracker tracked: --interactive asks for it");
  }
  std::set<std::uint8_t> tracked;
  for (const WireTurn& turn : conversation.turns) {
    if (!turn.measurement || turn.sent > pulled->sent + seconds(1)) {
      continue;
    }
    for (const aurora::HandleReading& reading : turn.measurement->readings) {
      if (turn.sent < pulled->sent && !is_untracked(reading)) {
        tracked.insert(reading.handle);
      } else if (turn.sent >= pulled->sent && is_untracked(reading) && tracked.contains(reading.handle)) {
        return judged(AssumptionVerdict::kHolds, turn.sent,
                      "handle " + hex(reading.handle, 2) + " is no longer tracked: " + quoted(turn));
      }
    }
  }
  return judged(AssumptionVerdict::kDoesNotHold, pulled->sent,
                "system status 0080, and no handle is DISABLED within a second: " + quoted(*pulled));
}

Judgement plug_put_in(const WireConversation& conversation) {
  const WireTurn* const put_in =
      first_with_bit(conversation, [](aurora::SystemStatus status) { return status.port_became_occupied(); });
  if (put_in == nullptr) {
    return not_tried("no plug was put in while the tracker tracked: --interactive asks for it");
  }
  for (const WireTurn& turn : conversation.turns) {
    if (turn.sent < put_in->sent || turn.name != "PHSR" || turn.parameters != "02" || !turn.reply) {
      continue;
    }
    const auto list = aurora::parse_handle_list(turn.reply->payload);
    if (list) {
      return judged(verdict_if(list->count > 0), turn.sent,
                    quoted(*put_in) + ", after TSTOP " + quoted(turn));
    }
  }
  return not_tried("a plug was put in, and PHSR:02 not asked after it");
}

}  // namespace tubed::judging
