// Judgements about the frame counter and about time.
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "clients/tubectl/check/aurora_tracking_judgements.hpp"
#include "drivers/aurora/frame_counter.hpp"

namespace tubed::judging {

namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

constexpr double kUsualRateHz = 40;
constexpr double kCountsPerSecond = kUsualRateHz * aurora::kCountsPerMeasurement;

/// A frame number and when its reply began.
struct CountedReply {
  const WireTurn* turn = nullptr;
  std::uint32_t frame = 0;
  nanoseconds time{};
};

/// One time of tracking, from TSTART to TSTOP.
struct TrackingPeriod {
  const WireTurn* start = nullptr;  ///< TSTART; nothing when the log begins later
  std::vector<CountedReply> replies;
};

/// Replies whose frame is 0 are from before the first measurement and left out.
std::vector<TrackingPeriod> periods_of(const WireConversation& conversation) {
  std::vector<TrackingPeriod> periods(1);
  for (const WireTurn& turn : conversation.turns) {
    const bool ends = turn.okay() && (turn.name == "TSTART" || turn.name == "TSTOP" || turn.name == "INIT");
    if (ends) {
      periods.push_back({turn.name == "TSTART" ? &turn : nullptr, {}});
    }
    const auto frame = turn.measurement ? turn.measurement->frame() : std::nullopt;
    if (frame && *frame != 0) {
      periods.back().replies.push_back({&turn, *frame, turn.reply->first_byte});
    }
  }
  return periods;
}

/// The counter before and after a pause of tracking.
struct CounterPause {
  CountedReply before;
  CountedReply after;
  const WireTurn* start = nullptr;

  [[nodiscard]] std::int64_t counts() const { return static_cast<std::int32_t>(after.frame - before.frame); }
  [[nodiscard]] double pause_s() const { return seconds_of(after.time - before.time); }
  [[nodiscard]] std::string words() const {
    return "before " + hex(before.frame, 8) + ", " + with_unit(pause_s(), 2, "s later ") +
           hex(after.frame, 8);
  }
};

/// A tracker that started anew in between (a break, RESET, INIT) has counted from 0: that is no pause.
std::vector<CounterPause> pauses_of(const WireConversation& conversation, std::string_view options) {
  std::vector<CounterPause> pauses;
  const CountedReply* last = nullptr;
  const std::vector<TrackingPeriod> periods = periods_of(conversation);
  const auto restarted_between = [&](nanoseconds from, nanoseconds to) {
    const auto between = [&](nanoseconds time) { return time > from && time < to; };
    return std::any_of(conversation.breaks.begin(), conversation.breaks.end(),
                       [&](const WireBreak& one) { return between(one.sent); }) ||
           std::any_of(conversation.strays.begin(), conversation.strays.end(),
                       [&](const StrayReply& one) { return one.is_reset && between(one.time); }) ||
           std::any_of(conversation.turns.begin(), conversation.turns.end(), [&](const WireTurn& turn) {
             return turn.name == "INIT" && turn.okay() && between(turn.sent);
           });
  };
  for (const TrackingPeriod& period : periods) {
    if (period.replies.empty()) {
      continue;
    }
    const CountedReply& first = period.replies.front();
    if (last != nullptr && period.start != nullptr && period.start->parameters == options &&
        !restarted_between(last->time, first.time)) {
      pauses.push_back({*last, first, period.start});
    }
    last = &period.replies.back();
  }
  return pauses;
}

}  // namespace

Judgement counts_by_8(const WireConversation& conversation) {
  std::map<std::uint32_t, int> steps;
  const CountedReply* first = nullptr;
  const std::vector<TrackingPeriod> periods = periods_of(conversation);
  for (const TrackingPeriod& period : periods) {
    for (std::size_t i = 1; i < period.replies.size(); ++i) {
      const std::uint32_t step = period.replies[i].frame - period.replies[i - 1].frame;
      if (step % aurora::kCountsPerMeasurement != 0) {
        return judged(AssumptionVerdict::kDoesNotHold, period.replies[i].turn->sent,
                      "a step of " + std::to_string(static_cast<std::int32_t>(step)) + ": " +
                          hex(period.replies[i - 1].frame, 8) + ", then " + hex(period.replies[i].frame, 8));
      }
      first = first == nullptr ? &period.replies[i] : first;
      ++steps[step];
    }
  }
  steps.erase(0);
  if (steps.empty()) {
    return not_tried("fewer than two measurements");
  }
  std::string words = "steps of";
  int shown = 0;
  for (const auto& [step, count] : steps) {
    words += ++shown <= 4 ? " " + std::to_string(step) + " (" + std::to_string(count) + ")" : "";
  }
  return judged(AssumptionVerdict::kHolds, first->turn->sent, words);
}

Judgement forty_a_second(const WireConversation& conversation) {
  const std::vector<TrackingPeriod> periods = periods_of(conversation);
  const auto length = [](const TrackingPeriod& period) {
    return period.replies.empty() ? nanoseconds{} : period.replies.back().time - period.replies.front().time;
  };
  const auto longest = std::max_element(
      periods.begin(), periods.end(),
      [&](const TrackingPeriod& a, const TrackingPeriod& b) { return length(a) < length(b); });
  if (length(*longest) < seconds(1)) {
    return not_tried("tracking for less than a second");
  }
  const std::uint32_t counts = longest->replies.back().frame - longest->replies.front().frame;
  const double hz = counts / seconds_of(length(*longest)) / aurora::kCountsPerMeasurement;
  constexpr double kTolerance = 0.05;  // recorded: 40.4
  return judged(verdict_if(std::abs(hz / kUsualRateHz - 1) <= kTolerance), longest->replies.front().time,
                with_unit(hz, 2, "a second: ") + std::to_string(counts) + " counts in " +
                    with_unit(seconds_of(length(*longest)), 2, "s"));
}

Judgement repeats_measurements(const WireConversation& conversation) {
  std::size_t replies = 0;
  std::size_t repeated = 0;
  const WireTurn* first = nullptr;
  for (const TrackingPeriod& period : periods_of(conversation)) {
    for (std::size_t i = 1; i < period.replies.size(); ++i) {
      constexpr milliseconds kFasterThanTracker{20};
      if (period.replies[i].time - period.replies[i - 1].time < kFasterThanTracker) {
        ++replies;
        const bool is_repeated = period.replies[i].frame == period.replies[i - 1].frame;
        repeated += is_repeated ? 1 : 0;
        first = is_repeated && first == nullptr ? period.replies[i].turn : first;
      }
    }
  }
  constexpr std::size_t kEnough = 50;
  if (first == nullptr && replies < kEnough) {
    return not_tried("not polled faster than 50 times a second (8 coils need 230400 baud)");
  }
  const nanoseconds time = first != nullptr ? first->sent : nanoseconds{};
  return judged(verdict_if(first != nullptr), time,
                std::to_string(repeated) + " of " + std::to_string(replies) +
                    " replies within 20 ms of the last repeat its frame number");
}

Judgement begins_soon(const WireConversation& conversation) {
  std::vector<nanoseconds> latencies;
  nanoseconds time{};
  for (const WireTurn& turn : conversation.turns) {
    if (turn.measurement && turn.name == "BX" && !turn.during_reply) {
      time = latencies.empty() ? turn.sent : time;
      latencies.push_back(std::max(turn.reply->first_byte - turn.sent_whole, nanoseconds{}));
    }
  }
  if (latencies.empty()) {
    return not_tried("BX was not answered");
  }
  std::sort(latencies.begin(), latencies.end());
  const auto at = [&](double part) {
    return 1000 *
           seconds_of(latencies[static_cast<std::size_t>(part * static_cast<double>(latencies.size() - 1))]);
  };
  constexpr double kSoon_ms = 5;
  return judged(verdict_if(at(0.5) <= kSoon_ms), time,
                "median " + with_unit(at(0.5), 1, "ms, ") + "1 in 10 above " + with_unit(at(0.9), 1, "ms"));
}

Judgement counter_goes_on(const WireConversation& conversation) {
  Judgement found = not_tried("no TSTOP and TSTART with measurements before and after");
  for (const CounterPause& pause : pauses_of(conversation, "")) {
    if (pause.counts() <= 0) {
      return judged(AssumptionVerdict::kDoesNotHold, pause.after.turn->sent, pause.words());
    }
    found = judged(AssumptionVerdict::kHolds, pause.after.turn->sent, pause.words());
  }
  return found;
}

Judgement counter_goes_by_time(const WireConversation& conversation) {
  Judgement found = not_tried("no TSTOP and TSTART over which the counter went on");
  for (const CounterPause& pause : pauses_of(conversation, "")) {
    const double expected = pause.pause_s() * kCountsPerSecond;
    if (pause.counts() <= 0) {
      continue;
    }
    const double part = static_cast<double>(pause.counts()) / expected;
    const bool by_time = std::abs(part - 1) < 0.2;
    found = judged(verdict_if(by_time), pause.after.turn->sent,
                   pause.words() + ": " + std::to_string(pause.counts()) + " counts, by time " +
                       std::to_string(std::lround(expected)));
    if (!by_time) {
      return found;
    }
  }
  return found;
}

Judgement option_80_counts_anew(const WireConversation& conversation) {
  for (const WireTurn& turn : conversation.turns) {
    if (turn.name == "TSTART" && turn.parameters == "80" && turn.is_error()) {
      return judged(AssumptionVerdict::kDoesNotHold, turn.sent, quoted(turn));
    }
  }
  const std::vector<CounterPause> pauses = pauses_of(conversation, "80");
  if (pauses.empty()) {
    return not_tried("no TSTART:80 with measurements before and after");
  }
  const CounterPause& pause = pauses.front();
  return judged(verdict_if(pause.after.frame < pause.before.frame), pause.start->sent, pause.words());
}

}  // namespace tubed::judging
