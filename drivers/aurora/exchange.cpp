#include "drivers/aurora/exchange.hpp"

#include <algorithm>
#include <array>

namespace tubed::aurora {

namespace {

/// A pause this long ends a damaged reply. USB adapters hold bytes back for up to 16 ms.
constexpr std::chrono::milliseconds kQuietLine{20};
constexpr int kBitsPerByte = 10;

}  // namespace

void Exchange::attach(ByteChannel& channel) noexcept {
  channel_ = &channel;
  reader_.clear();
  pending_ = gone_ = false;
  rests_until_ = now();
}

std::chrono::nanoseconds Exchange::byte_time() const noexcept {
  return std::chrono::nanoseconds(1'000'000'000LL * kBitsPerByte / baud_);
}

bool Exchange::set_baud(int bits_per_second) noexcept {
  trace_.baud_rate(now(), bits_per_second);
  reader_.clear();
  pending_ = false;
  if (!channel_->set_baud(bits_per_second)) {
    return false;
  }
  baud_ = bits_per_second;
  return true;
}

bool Exchange::send_break() noexcept {
  trace_.serial_break(now());
  reader_.clear();
  pending_ = false;
  return channel_->send_break();
}

void Exchange::send(const CommandLine& command, std::chrono::nanoseconds timeout, ReplyWait wait) noexcept {
  const MonotonicTime start = now();
  trace_.sent(start, command.bytes());
  if (start >= last_byte_ + kQuietLine) {
    reader_.clear();  // what a cut reply has left would spoil one in characters
  }
  gone_ = !channel_->write(command.bytes()) || gone_;
  pending_ = true;
  answer_begun_ = answer_begun_ && start < last_byte_ + kQuietLine;
  reply_wait_ = wait;
  damaged_before_ = damaged();
  sent_ = start;
  asked_ = start + static_cast<std::int64_t>(command.bytes().size()) * byte_time();
  deadline_ = asked_ + timeout;
}

Exchange::Event Exchange::listen(MonotonicTime until, Reply& reply) noexcept {
  std::array<std::uint8_t, 2048> room;
  while (!gone_) {
    if (take_reply(reply)) {
      return Event::kReply;
    }
    const MonotonicTime limit = pending_ ? std::min(until, give_up_at()) : until;
    const ByteChannel::Arrival arrival = channel_->read(room, limit);
    const MonotonicTime after = now();
    gone_ = arrival.gone;
    if (arrival.size > 0) {
      take(Bytes(room).first(arrival.size), after);
      if (take_reply(reply)) {
        return Event::kReply;
      }
    }
    if (pending_ && after >= give_up_at()) {
      reader_.give_up_waiting();
      if (take_reply(reply)) {
        return Event::kReply;
      }
      pending_ = false;
      return Event::kNoReply;
    }
    if (!gone_ && after >= until) {
      return Event::kQuiet;
    }
  }
  pending_ = false;
  return Event::kGone;
}

bool Exchange::take_reply(Reply& reply) noexcept {
  const std::optional<Reply> found = reader_.next();
  if (!found) {
    return false;
  }
  reply = *found;
  // What began before the question was written answers an earlier one: the answer is still to come.
  answers_ = pending_ && began_ >= sent_;
  pending_ = pending_ && !answers_;
  // With noise before it, or when it began before the command went out, nobody knows when it began.
  const bool clean = discarded_ == reader_.counts().discarded_bytes && (!answers_ || began_ >= asked_);
  answered_ = clean ? began_ : last_byte_;
  discarded_ = reader_.counts().discarded_bytes;
  answer_begun_ = reader_.waiting() > 0;
  began_ = last_byte_ - line_time(reader_.waiting());
  return true;
}

void Exchange::take(Bytes bytes, MonotonicTime now) noexcept {
  trace_.received(now, bytes);
  last_byte_ = now;
  if (!answer_begun_) {
    answer_begun_ = true;
    began_ = now - line_time(bytes.size());
  }
  reader_.feed(bytes);
}

// The tracker's rate may be a little faster than ours.
std::chrono::nanoseconds Exchange::line_time(std::size_t bytes) const noexcept {
  return static_cast<std::int64_t>(bytes) * byte_time() * 49 / 50;
}

std::uint64_t Exchange::damaged() const noexcept {
  const ReplyReader::Counts& counts = reader_.counts();
  return counts.bad_text + counts.bad_headers + counts.bad_bodies + counts.overlong;
}

MonotonicTime Exchange::give_up_at() const noexcept {
  const bool damaged_reply = reply_wait_ == ReplyWait::kWhileTalking && damaged() > damaged_before_;
  return damaged_reply ? std::min(deadline_, last_byte_ + kQuietLine) : deadline_;
}

}  // namespace tubed::aurora
