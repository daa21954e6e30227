#include "clients/tubectl/check/wire_conversation.hpp"

#include <algorithm>
#include <cctype>
#include <deque>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/command.hpp"
#include "drivers/aurora/reply_reader.hpp"
#include "drivers/aurora/tx_reply.hpp"

namespace tubed {

namespace {

using aurora::ReplyKind;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// After a pause this long nothing more of the earlier reply comes; as in aurora::Exchange.
constexpr milliseconds kQuietLine{20};
constexpr std::int64_t kBitsPerByte = 10;

std::string upper_case(std::string_view text) {
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return upper;
}

WireTurn turn_of(aurora::Bytes bytes) {
  WireTurn turn;
  turn.line = aurora::as_text(bytes);
  while (!turn.line.empty() && turn.line.back() == '\r') {
    turn.line.pop_back();
  }
  if (const auto command = aurora::parse_command(turn.line)) {
    turn.name = upper_case(command->name);
    turn.parameters = command->parameters;
    turn.has_check_sum = turn.line[command->name.size()] == ':';
  }
  return turn;
}

std::optional<WireMeasurement> measurement_of(const WireTurn& turn, const WireReply& reply) {
  aurora::TrackingReply tracking;
  const bool read =
      reply.kind == ReplyKind::kBinary
          ? aurora::decode_bx(aurora::as_bytes(reply.payload), tracking)
          : turn.name == "TX" && reply.kind == ReplyKind::kText && aurora::decode_tx(reply.payload, tracking);
  if (!read) {
    return std::nullopt;
  }
  const auto readings = tracking.readings();
  return WireMeasurement{{readings.begin(), readings.end()}, tracking.system_status};
}

/// Goes through a log, entry by entry.
class Listener {
 public:
  void hear(const aurora::WireLogEntry& entry) {
    heard_.end = std::max(heard_.end, entry.time);
    switch (entry.event) {
      case aurora::WireEvent::kSent:
        take_command(entry);
        break;
      case aurora::WireEvent::kReceived:
        take_bytes(entry);
        break;
      case aurora::WireEvent::kBaudRate:
        settle();
        bits_per_second_ = std::max(entry.bits_per_second, 1);
        break;
      case aurora::WireEvent::kBreak:
        settle();
        heard_.breaks.push_back({entry.time, std::nullopt});
        break;
      case aurora::WireEvent::kNote:
        break;
    }
  }

  WireConversation end() {
    settle();
    return std::move(heard_);
  }

 private:
  [[nodiscard]] nanoseconds line_time(std::size_t bytes) const {
    return nanoseconds(static_cast<std::int64_t>(bytes) * kBitsPerByte * 1'000'000'000 / bits_per_second_);
  }

  void take_command(const aurora::WireLogEntry& entry) {
    const bool reply_is_arriving = reader_.waiting() > 0 && entry.time < last_byte_ + kQuietLine;
    if (!reply_is_arriving) {
      settle();
    }
    WireTurn turn = turn_of(entry.bytes);
    turn.sent = entry.time;
    turn.sent_whole = entry.time + line_time(entry.bytes.size());
    turn.bits_per_second = bits_per_second_;
    turn.while_tracking = tracking_;
    turn.during_reply = reply_is_arriving && !waiting_.empty();
    waiting_.push_back(heard_.turns.size());
    heard_.turns.push_back(std::move(turn));
  }

  void take_bytes(const aurora::WireLogEntry& entry) {
    if (reader_.waiting() == 0) {
      began_ = entry.time - line_time(entry.bytes.size());
    }
    last_byte_ = entry.time;
    aurora::Bytes left(entry.bytes);
    while (!left.empty()) {
      left = left.subspan(reader_.feed(left));
      drain();
    }
  }

  /// What is unfinished will not be finished: the line was quiet, or changed its rate.
  void settle() {
    while (reader_.waiting() > 0) {
      reader_.give_up_waiting();
      drain();
    }
    waiting_.clear();
  }

  void drain() {
    while (const auto reply = reader_.next()) {
      take_reply(*reply);
      began_ = last_byte_ - line_time(reader_.waiting());
    }
    note_damage();
  }

  void note_damage() {
    const aurora::ReplyReader::Counts& counts = reader_.counts();
    const std::uint64_t damaged = counts.bad_text + counts.bad_headers + counts.bad_bodies + counts.overlong;
    if (damaged > heard_.damaged) {
      heard_.first_damage = heard_.first_damage.value_or(last_byte_);
      if (!heard_.turns.empty()) {
        heard_.turns.back().damaged = true;
      }
    }
    heard_.damaged = damaged;
  }

  void take_reply(const aurora::Reply& read) {
    ++heard_.replies;
    WireReply reply{read.kind, read.error_code, std::string(read.text()), began_, last_byte_};
    if (reply.kind == ReplyKind::kReset) {
      tracking_ = false;
      if (!heard_.breaks.empty() && !heard_.breaks.back().reset) {
        heard_.breaks.back().reset = reply.last_byte;
        return;
      }
    }
    const bool answers = !waiting_.empty() &&
                         (reply.kind != ReplyKind::kBinary || heard_.turns[waiting_.front()].name == "BX");
    if (!answers) {
      heard_.strays.push_back({reply.first_byte, reply.payload, reply.kind == ReplyKind::kReset});
      return;
    }
    WireTurn& turn = heard_.turns[waiting_.front()];
    waiting_.pop_front();
    turn.measurement = measurement_of(turn, reply);
    turn.reply = std::move(reply);
    follow_state(turn);
  }

  void follow_state(const WireTurn& turn) {
    if (turn.measurement || (turn.name == "TSTART" && turn.okay())) {
      tracking_ = true;
    } else if ((turn.name == "TSTOP" || turn.name == "INIT") && turn.okay()) {
      tracking_ = false;
    }
  }

  WireConversation heard_;
  aurora::ReplyReader reader_;
  std::deque<std::size_t> waiting_;  ///< turns without their reply, the oldest first
  int bits_per_second_ = 9600;
  bool tracking_ = false;
  nanoseconds began_{};  ///< of what is arriving
  nanoseconds last_byte_{};
};

}  // namespace

std::optional<std::uint32_t> WireMeasurement::frame() const {
  aurora::TrackingReply reply;
  reply.handle_count = static_cast<int>(std::min(readings.size(), reply.handles.size()));
  std::copy_n(readings.begin(), reply.handle_count, reply.handles.begin());
  return aurora::common_frame(reply);
}

bool WireTurn::okay() const {
  return reply && (reply->kind == ReplyKind::kOkay || reply->kind == ReplyKind::kWarning);
}
bool WireTurn::is_error(std::uint8_t code) const { return is_error() && reply->error_code == code; }
bool WireTurn::is_error() const { return reply && reply->kind == ReplyKind::kError; }

WireConversation read_conversation(const aurora::WireLog& log) {
  Listener listener;
  for (const aurora::WireLogEntry& entry : log.entries) {
    listener.hear(entry);
  }
  return listener.end();
}

}  // namespace tubed
