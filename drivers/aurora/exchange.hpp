// One command, one reply, with a deadline, over a byte channel; everything goes into the wire trace.
#pragma once

#include <chrono>

#include "drivers/aurora/byte_channel.hpp"
#include "drivers/aurora/command.hpp"
#include "drivers/aurora/reply_reader.hpp"
#include "drivers/aurora/wire_trace.hpp"

namespace tubed::aurora {

/// One thread; allocates only its trace, when it is made.
class Exchange {
 public:
  enum class Event {
    kQuiet,    ///< nothing until the instant that was given
    kReply,    ///< a whole reply; see answers()
    kNoReply,  ///< the deadline has come, or the reply was damaged
    kGone      ///< the channel has no other end any more
  };
  /// How a damaged reply is treated.
  enum class ReplyWait {
    kUntilDeadline,  ///< noise before a slow reply must not end the waiting
    kWhileTalking    ///< over as soon as the line has been quiet for a moment
  };

  explicit Exchange(std::size_t trace_capacity) : trace_(trace_capacity) {}

  /// `channel` has to outlive the exchange or the next attach().
  void attach(ByteChannel& channel) noexcept;
  [[nodiscard]] MonotonicTime now() noexcept { return channel_->now(); }
  [[nodiscard]] bool attached() const noexcept { return channel_ != nullptr; }
  void detach() noexcept { channel_ = nullptr; }

  /// Sets the host's rate and forgets what came at the other. False: the host has no such rate, or is gone.
  bool set_baud(int bits_per_second) noexcept;
  [[nodiscard]] bool knows_baud(int bits_per_second) noexcept {
    return channel_->knows_baud(bits_per_second);
  }
  [[nodiscard]] int baud() const noexcept { return baud_; }
  /// Time of one byte on the line (start bit, 8 data bits, stop bit).
  [[nodiscard]] std::chrono::nanoseconds byte_time() const noexcept;
  bool send_break() noexcept;

  /// Sends; from now on a reply is pending. Not while one is.
  void send(const CommandLine& command, std::chrono::nanoseconds timeout,
            ReplyWait wait = ReplyWait::kUntilDeadline) noexcept;
  [[nodiscard]] bool pending() const noexcept { return pending_; }
  /// When a pending reply is no longer waited for, should nothing more come.
  [[nodiscard]] MonotonicTime give_up_at() const noexcept;
  /// Stops waiting for the reply.
  void abandon() noexcept { pending_ = false; }

  /// Nothing should be sent for as long: the tracker needs the time, or an answer may only be late.
  void rest(std::chrono::nanoseconds time) noexcept { rests_until_ = now() + time; }
  [[nodiscard]] MonotonicTime rests_until() const noexcept { return rests_until_; }

  /// Waits for what comes next, until `until` at most. The reply's payload is good until the next call.
  /// Replies that nobody waits for are given out as well.
  Event listen(MonotonicTime until, Reply& reply) noexcept;
  /// Of the kReply just given out: whether a command was waiting for it.
  [[nodiscard]] bool answers() const noexcept { return answers_; }

  /// The command was on the line, last byte and all, not before this.
  [[nodiscard]] MonotonicTime asked() const noexcept { return asked_; }
  /// Of the reply just given out: its first byte began on the line not after this.
  [[nodiscard]] MonotonicTime answered() const noexcept { return answered_; }
  [[nodiscard]] MonotonicTime last_byte() const noexcept { return last_byte_; }
  /// Something has come that is not whole yet.
  [[nodiscard]] bool inside_reply() const noexcept { return reader_.waiting() > 0; }

  [[nodiscard]] const ReplyReader::Counts& counts() const noexcept { return reader_.counts(); }
  [[nodiscard]] WireTrace& trace() noexcept { return trace_; }
  [[nodiscard]] const WireTrace& trace() const noexcept { return trace_; }

 private:
  [[nodiscard]] std::uint64_t damaged() const noexcept;
  bool take_reply(Reply& reply) noexcept;
  void take(Bytes bytes, MonotonicTime now) noexcept;
  [[nodiscard]] std::chrono::nanoseconds line_time(std::size_t bytes) const noexcept;

  ByteChannel* channel_ = nullptr;
  ReplyReader reader_;
  WireTrace trace_;
  int baud_ = 9600;
  bool pending_ = false;
  bool answers_ = false;
  bool gone_ = false;
  bool answer_begun_ = false;
  ReplyWait reply_wait_ = ReplyWait::kUntilDeadline;
  std::uint64_t damaged_before_ = 0;
  MonotonicTime deadline_{};
  MonotonicTime sent_{};
  MonotonicTime asked_{};
  MonotonicTime began_{};  ///< of what is coming in now: not after this
  MonotonicTime answered_{};
  std::uint64_t discarded_ = 0;
  MonotonicTime rests_until_{};
  MonotonicTime last_byte_{};
};

}  // namespace tubed::aurora
