#include "clients/tubectl/check/aurora_talk.hpp"

#include <utility>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/rate_choice.hpp"
#include "drivers/aurora/tx_reply.hpp"

namespace tubed {

namespace {

using aurora::Exchange;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr int kFirstRate = 9600;
constexpr int kLikelyRate = 115200;
constexpr milliseconds kInitTimeout{600};   // recorded: 50 ms
constexpr milliseconds kStopTimeout{2000};  // recorded: 360 ms
constexpr milliseconds kResetTimeout{2500};
constexpr milliseconds kAfterRateChange{100};

Answer answer_of(const aurora::Reply& reply) {
  return {true, reply.kind, reply.error_code, std::string(reply.text())};
}

}  // namespace

AuroraTalk::AuroraTalk(aurora::ByteChannel& channel, std::size_t trace_capacity,
                       std::function<bool()> interrupted)
    : exchange_(trace_capacity), interrupted_(std::move(interrupted)) {
  exchange_.attach(channel);
}

Answer AuroraTalk::ask(const aurora::CommandLine& command, nanoseconds timeout) {
  const Answer answer = try_ask(command, timeout);
  unanswered_ = answer.came ? 0 : unanswered_ + 1;
  if (unanswered_ >= kMaxUnanswered) {
    unanswered_ = 0;
    note("the tracker does not answer any more");
    throw BringupStopped{BringupEnd::kNoTracker};
  }
  return answer;
}

Answer AuroraTalk::try_ask(const aurora::CommandLine& command, nanoseconds timeout) {
  if (interrupted_()) {
    throw BringupStopped{BringupEnd::kInterrupted};
  }
  exchange_.send(command, timeout);
  for (;;) {
    aurora::Reply reply;
    switch (exchange_.listen(MonotonicTime::max(), reply)) {
      case Exchange::Event::kReply:
        if (exchange_.answers()) {
          return answer_of(reply);
        }
        break;
      case Exchange::Event::kNoReply:
      case Exchange::Event::kQuiet:
        return {};
      case Exchange::Event::kGone:
        throw BringupStopped{BringupEnd::kPortGone};
    }
  }
}

bool AuroraTalk::ask_during_reply(const aurora::CommandLine& first, const aurora::CommandLine& second) {
  constexpr milliseconds kTimeout{500};
  aurora::Reply reply;
  exchange_.send(first, kTimeout);
  while (!exchange_.inside_reply()) {
    const Exchange::Event event = exchange_.listen(exchange_.now() + std::chrono::microseconds(200), reply);
    if (event == Exchange::Event::kGone) {
      throw BringupStopped{BringupEnd::kPortGone};
    }
    if (event != Exchange::Event::kQuiet) {
      return false;
    }
  }
  exchange_.abandon();
  exchange_.send(second, kTimeout);
  rest(kTimeout);
  return true;
}

bool AuroraTalk::read_measurement(const Answer& answer, aurora::TrackingReply& measurement) {
  if (!answer.came) {
    return false;
  }
  return answer.kind == aurora::ReplyKind::kBinary
             ? aurora::decode_bx(aurora::as_bytes(answer.payload), measurement)
             : aurora::decode_tx(answer.payload, measurement);
}

void AuroraTalk::rest(nanoseconds duration) {
  const MonotonicTime until = exchange_.now() + duration;
  aurora::Reply reply;
  while (exchange_.now() < until) {
    if (exchange_.listen(until, reply) == Exchange::Event::kGone) {
      throw BringupStopped{BringupEnd::kPortGone};
    }
  }
  exchange_.abandon();
}

bool AuroraTalk::answers_at(int bits_per_second) {
  if (!exchange_.knows_baud(bits_per_second) || !exchange_.set_baud(bits_per_second)) {
    return false;
  }
  for (int attempt = 0; attempt < 2; ++attempt) {
    const Answer answer = try_ask(aurora::init_command(), kInitTimeout);
    if (answer.okay()) {
      return true;
    }
    if (answer.came) {
      try_ask(aurora::tstop_command(), kStopTimeout);
      return try_ask(aurora::init_command(), kInitTimeout).came;
    }
  }
  return false;
}

bool AuroraTalk::find_rate() {
  if (answers_at(kFirstRate) || answers_at(kLikelyRate)) {
    return true;
  }
  if (send_break() && answers_at(kFirstRate)) {
    return true;
  }
  for (const aurora::BaudRate rate : aurora::kRates) {
    if (answers_at(aurora::bits_per_second(rate))) {
      return true;
    }
  }
  return false;
}

bool AuroraTalk::send_break() {
  const int before = exchange_.baud();
  exchange_.set_baud(kFirstRate);
  exchange_.send_break();
  const MonotonicTime until = exchange_.now() + kResetTimeout;
  aurora::Reply reply;
  Exchange::Event event = Exchange::Event::kReply;
  while (event == Exchange::Event::kReply) {
    event = exchange_.listen(until, reply);
    if (event == Exchange::Event::kReply && reply.kind == aurora::ReplyKind::kReset) {
      rest(kAfterRateChange);
      return true;
    }
  }
  if (event == Exchange::Event::kGone) {
    throw BringupStopped{BringupEnd::kPortGone};
  }
  exchange_.set_baud(before);
  return false;
}

bool AuroraTalk::change_rate(aurora::BaudRate rate) {
  const int bits_per_second = aurora::bits_per_second(rate);
  if (!exchange_.knows_baud(bits_per_second)) {
    note("this port does not have " + std::to_string(bits_per_second) + " baud");
    return false;
  }
  aurora::LinkParameters link;
  link.rate = rate;
  if (!ask(aurora::comm_command(link)).okay()) {
    return false;
  }
  exchange_.set_baud(bits_per_second);
  rest(kAfterRateChange);
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (try_ask(aurora::apirev_command(), kInitTimeout).came) {
      return true;
    }
  }
  note("nothing is heard at " + std::to_string(bits_per_second) + " baud");
  if (!find_rate()) {
    throw BringupStopped{BringupEnd::kNoTracker};
  }
  return false;
}

}  // namespace tubed
