// Questions to an Aurora one after the other, for a bring-up: whatever is answered is an answer.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/aurora/exchange.hpp"
#include "drivers/aurora/tracking_reply.hpp"

namespace tubed {

/// How a bring-up ended.
enum class BringupEnd { kDone, kInterrupted, kNoTracker, kPortGone };

/// Thrown through the steps of a bring-up; AuroraBringup::run() catches it.
struct BringupStopped {
  BringupEnd why = BringupEnd::kInterrupted;
};

/// What a command was answered. Owns its text.
struct Answer {
  bool came = false;  ///< a reply with a right check sum
  aurora::ReplyKind kind = aurora::ReplyKind::kText;
  std::uint8_t error_code = 0;
  std::string payload;

  [[nodiscard]] bool okay() const {
    return came && (kind == aurora::ReplyKind::kOkay || kind == aurora::ReplyKind::kWarning);
  }
  [[nodiscard]] bool is_text() const { return came && kind == aurora::ReplyKind::kText; }
};

/// One thread. Everything that is said goes into the trace.
class AuroraTalk {
 public:
  /// `channel` and what `interrupted` looks at have to outlive it.
  AuroraTalk(aurora::ByteChannel& channel, std::size_t trace_capacity, std::function<bool()> interrupted);

  /// Sends and waits for the reply. Throws BringupStopped before sending when interrupted, when the port is
  /// gone, and after kMaxUnanswered commands in a row without an answer: nothing is left half said.
  Answer ask(const aurora::CommandLine& command, std::chrono::nanoseconds timeout = std::chrono::seconds(5));
  static constexpr int kMaxUnanswered = 5;
  /// Sends `second` as soon as the first bytes of the reply to `first` have come, and waits for both. False:
  /// the reply to `first` came in one piece.
  bool ask_during_reply(const aurora::CommandLine& first, const aurora::CommandLine& second);
  /// The measurement that TX or BX was answered with.
  static bool read_measurement(const Answer& answer, aurora::TrackingReply& measurement);

  /// Listens at 9600 and 115200 baud, after a break, at every rate. A tracker that tracks is stopped. False:
  /// no answer. Afterwards INIT has been answered.
  bool find_rate();
  /// At 9600 baud; whether RESET came within 2.5 s. Without it the line is back at the rate it had.
  bool send_break();
  /// Both ends go to `rate`. False: this port or the tracker does not have it, and the line is as before, or,
  /// when nothing was heard at the new rate, as find_rate() left it.
  bool change_rate(aurora::BaudRate rate);
  void rest(std::chrono::nanoseconds duration);
  void note(std::string_view text) { exchange_.trace().note(exchange_.now(), text); }
  /// From now on an interruption is not looked at: the link is being put back.
  void ignore_interruption() {
    interrupted_ = [] { return false; };
  }

  [[nodiscard]] int baud() const { return exchange_.baud(); }
  bool set_baud(int bits_per_second) { return exchange_.set_baud(bits_per_second); }
  [[nodiscard]] MonotonicTime now() { return exchange_.now(); }
  [[nodiscard]] const aurora::WireTrace& trace() const { return exchange_.trace(); }

 private:
  bool answers_at(int bits_per_second);
  /// ask(), whatever was not answered before.
  Answer try_ask(const aurora::CommandLine& command, std::chrono::nanoseconds timeout);

  aurora::Exchange exchange_;
  std::function<bool()> interrupted_;
  int unanswered_ = 0;  ///< commands in a row
};

}  // namespace tubed
