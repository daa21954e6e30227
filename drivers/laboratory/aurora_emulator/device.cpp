#include "drivers/laboratory/aurora_emulator/device.hpp"

#include <algorithm>
#include <utility>

#include "drivers/aurora/reply.hpp"
#include "drivers/laboratory/aurora_emulator/reply_damage.hpp"

namespace tubed::aurora::emulator {

namespace {

constexpr std::string_view kReset = "RESET";
constexpr std::size_t kLongestLine = 4096;  // noise without an end is not kept for ever

}  // namespace

Device::Device(const DeviceSettings& settings, Motion motion, MonotonicTime power_on)
    : settings_(settings),
      faults_(settings.seed),
      measurements_(std::move(motion), settings.rate_hz, settings.first_frame, faults_),
      tracker_(settings_, measurements_, faults_.conditions),
      wire_(settings.seed) {
  restart(power_on);
}

void Device::receive(Bytes bytes, int host_bits_per_second, MonotonicTime now) {
  work_until(now);
  if (!connected(now)) {
    return;
  }
  for (const std::uint8_t sent : bytes) {
    heard_until_ = std::max(heard_until_, now) + byte_time(wire_.link);
    if (heard_until_ < deaf_until_) {
      continue;
    }
    const std::uint8_t byte = wire_.hear(sent, host_bits_per_second);
    if (byte != '\r') {
      typed_.push_back(static_cast<char>(byte));
    } else if (!typed_.empty()) {
      waiting_.push_back({heard_until_, std::exchange(typed_, {})});
    }
    if (typed_.size() > kLongestLine) {
      typed_.clear();
    }
  }
}

void Device::receive_break(MonotonicTime now) {
  work_until(now);
  if (now >= deaf_until_) {
    restart(now);
  }
}

void Device::transmit(MonotonicTime now, int host_bits_per_second, std::vector<std::uint8_t>& out) {
  work_until(now);
  if (connected(now)) {
    wire_.take(now, host_bits_per_second, out);
    return;
  }
  std::vector<std::uint8_t> lost;
  wire_.take(now, host_bits_per_second, lost);
}

MonotonicTime Device::next_event() const {
  const MonotonicTime next_command =
      waiting_.empty() ? MonotonicTime::max() : std::max(waiting_.front().complete, busy_until_);
  return std::min(next_command, wire_.next_byte());
}

void Device::hang_up(MonotonicTime now, std::chrono::nanoseconds duration) {
  work_until(now);
  hung_up_until_ = duration < MonotonicTime::max() - now ? now + duration : MonotonicTime::max();
}

void Device::power_cycle(MonotonicTime now, std::chrono::nanoseconds off) {
  work_until(now);
  restart(now + off);
}

void Device::restart(MonotonicTime now) {
  typed_.clear();
  waiting_.clear();
  wire_.clear();
  last_tracking_.clear();
  wire_.link = LinkParameters{};
  next_link_.reset();
  tracker_.start_anew(now);
  deaf_until_ = now + settings_.durations.reset;
  Answer word;
  word.reply.resize(kReset.size() + 5);
  word.reply.resize(encode_text_reply(kReset, word.reply));
  busy_until_ = wire_.send(std::move(word.reply), deaf_until_);
}

void Device::work_until(MonotonicTime now) {
  while (!waiting_.empty()) {
    const MonotonicTime begin = std::max(waiting_.front().complete, busy_until_);
    if (begin > now) {
      break;
    }
    switch_link(begin);
    const Line line = std::move(waiting_.front());
    waiting_.pop_front();
    execute(line, begin);
  }
  switch_link(now);
}

void Device::switch_link(MonotonicTime now) {
  if (next_link_ && now >= busy_until_) {
    wire_.link = *next_link_;
    next_link_.reset();
  }
}

void Device::execute(const Line& line, MonotonicTime now) {
  ++counts_.commands;
  const Answer answer = tracker_.execute(line.text, now);
  if (answer.starts_anew) {
    restart(now);
    return;
  }
  ++counts_.replies;
  counts_.tracking_replies += answer.has_tracking_data ? 1 : 0;
  send(answer, now);
}

void Device::send(const Answer& answer, MonotonicTime now) {
  const auto fault = faults_.strike_reply(answer.has_tracking_data ? Scope::kTracking : Scope::kAny);
  if (fault && strike_tracker(*fault, now)) {
    return;
  }
  std::vector<Piece> pieces = fault ? damage_reply(*fault, answer.reply, last_tracking_, faults_)
                                    : std::vector<Piece>{{{}, answer.reply}};
  MonotonicTime start = now + answer.thinking;
  busy_until_ = start;
  for (Piece& piece : pieces) {
    busy_until_ = wire_.send(std::move(piece.bytes), start + piece.pause);
    start = busy_until_;
  }
  if (answer.has_tracking_data && fault != Fault::kStale) {
    last_tracking_ = answer.reply;
  }
  next_link_ = answer.link;
}

bool Device::strike_tracker(Fault fault, MonotonicTime now) {
  switch (fault) {
    case Fault::kBreak:
      restart(now);
      return true;
    case Fault::kPowerCycle:
      restart(now + faults_.amounts.power_off);
      return true;
    case Fault::kHangUp:
      hung_up_until_ = now + faults_.amounts.hang_up;
      return true;
    default:
      return false;
  }
}

}  // namespace tubed::aurora::emulator
