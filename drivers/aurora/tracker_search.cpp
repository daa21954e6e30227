#include "drivers/aurora/tracker_search.hpp"

namespace tubed::aurora {

namespace {

using std::chrono::milliseconds;

// PHINF with tool and plug: 64 bytes, and the tracker's and an adapter's time.
constexpr int kUnchangedReply = 64;
constexpr milliseconds kUnchangedTimeout{60};

}  // namespace

void TrackerSearch::begin(BaudRate likely) noexcept {
  step_begun_ = false;
  if (resumption_.possible()) {
    search_.begin_after_loss(tracking_rate_);
  } else {
    search_.begin(likely);
  }
}

void TrackerSearch::begin_after_loss(BaudRate rate) noexcept {
  step_begun_ = false;
  search_.begin_after_loss(rate);
}

void TrackerSearch::send(Exchange& exchange) noexcept {
  const SearchStep step = search_.step();
  if (!step_begun_) {
    step_begun_ = true;
    exchange.set_baud(bits_per_second(step.rate));
    if (step.serial_break) {
      exchange.send_break();
    }
    step_ends_ = exchange.now() + step.timeout;
    resumption_.begin();
  }
  asking_unchanged_ = resumption_.possible() && step.rate == tracking_rate_ && !step.serial_break;
  if (asking_unchanged_) {
    exchange.send(resumption_.command(), kUnchangedReply * exchange.byte_time() + kUnchangedTimeout);
  } else {
    exchange.send(init_command(), LinkSearch::kBetweenTries);
  }
}

// Any reply whose check sum is right says that the rate is right. Behind a line that was interrupted the
// tracker has gone on.
TrackerSearch::Result TrackerSearch::take(const Reply* reply, MonotonicTime now) noexcept {
  if (reply == nullptr) {
    return not_found(now);
  }
  if (!asking_unchanged_) {
    return carried_out(reply) ? Result::kFound : Result::kOtherState;
  }
  switch (resumption_.take(*reply)) {
    case Resumption::Answer::kGoOn:
      break;
    case Resumption::Answer::kAgain:
      return not_found(now);
    case Resumption::Answer::kSame:
      return Result::kUnchanged;
    case Resumption::Answer::kOther:
      return Result::kOtherState;
  }
  return Result::kGoOn;
}

TrackerSearch::Result TrackerSearch::not_found(MonotonicTime now) noexcept {
  if (now < step_ends_) {
    return Result::kGoOn;
  }
  step_begun_ = false;
  return search_.advance() ? Result::kGoOn : Result::kNowhere;
}

void TrackerSearch::remember(std::span<const FoundCoil> tracked, BaudRate rate) noexcept {
  tracking_rate_ = rate;
  resumption_.remember(tracked);
}

}  // namespace tubed::aurora
