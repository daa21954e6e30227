#include "drivers/aurora/frame_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tubed::aurora {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

constexpr double as_ns(std::chrono::nanoseconds duration) noexcept {
  return static_cast<double>(duration.count());
}

}  // namespace

void FrameClock::observe(std::uint64_t measurement, std::optional<MonotonicTime> asked,
                         MonotonicTime answered) noexcept {
  if (count_ == 0) {
    base_measurement_ = measurement;
    base_time_ = answered;
  }
  rebase(measurement, answered);
  if (count_ == 0 || in_segment_ >= segment_length_) {
    open_segment();
  }
  ++in_segment_;
  Segment& segment = segments_[count_ - 1];
  tighten(segment, {.earliest = {}, .latest = {0, 0, true}});
  if (!find_periods()) {
    ++contradictions_;
    disbelieved_ = 0;
    forget_earliest();
    find_periods();
  }
  if (asked) {
    not_there(measurement + 1, *asked);
  }
  narrow_period();
}

// A lower bound that is wrong is off by a period at most, over 20 s: 0.12 %. Four times that is safe.
void FrameClock::narrow_period() noexcept {
  constexpr double kMargin = 0.005;
  if (segment_length_ == kMaxSegment && max_period_ns_ - min_period_ns_ < kMargin * min_period_ns_) {
    min_allowed_ns_ = std::max(kMinPeriodNs, (1 - kMargin) * min_period_ns_);
    max_allowed_ns_ = std::min(kMaxPeriodNs, (1 + kMargin) * max_period_ns_);
  }
}

void FrameClock::not_there(std::uint64_t measurement, MonotonicTime asked) noexcept {
  Segment& segment = segments_[count_ - 1];
  const Bound before = segment.earliest;
  const auto n = static_cast<double>(static_cast<std::int64_t>(measurement - base_measurement_));
  tighten(segment, {.earliest = {n, static_cast<double>((asked - base_time_).count()), true}, .latest = {}});
  if (find_periods()) {
    disbelieved_ = 0;
    return;
  }
  segment.earliest = before;
  ++contradictions_;
  ++disbelieved_;
  if (disbelieved_ % kDisbelievedUntilForgotten == 0) {
    // What is said again and again is newer than what it contradicts.
    forget_earliest();
    tighten(segment,
            {.earliest = {n, static_cast<double>((asked - base_time_).count()), true}, .latest = {}});
    if (find_periods()) {
      disbelieved_ = 0;
      return;
    }
    segment.earliest.known = false;
  }
  if (disbelieved_ >= kMaxDisbelieved) {
    min_allowed_ns_ = kMinPeriodNs;
    max_allowed_ns_ = kMaxPeriodNs;
    disbelieved_ = 0;
  }
  find_periods();
}

// The newest measurement is number 0 and its reply's time 0: numbers stay small and exact.
void FrameClock::rebase(std::uint64_t measurement, MonotonicTime time) noexcept {
  const auto n = static_cast<double>(measurement - base_measurement_);
  const auto ns = static_cast<double>((time - base_time_).count());
  base_measurement_ = measurement;
  base_time_ = time;
  for (std::size_t i = 0; i < count_; ++i) {
    for (Bound* bound : {&segments_[i].earliest, &segments_[i].latest}) {
      bound->n -= n;
      bound->time_ns -= ns;
    }
  }
}

// Which of two bounds is the tighter one depends on the period, a little: of neighbours, hardly.
void FrameClock::tighten(Segment& segment, const Segment& by) const noexcept {
  const auto offset = [this](const Bound& bound) { return bound.time_ns - period_ns() * bound.n; };
  if (by.earliest.known && (!segment.earliest.known || offset(by.earliest) > offset(segment.earliest))) {
    segment.earliest = by.earliest;
  }
  if (by.latest.known && (!segment.latest.known || offset(by.latest) < offset(segment.latest))) {
    segment.latest = by.latest;
  }
}

// Short segments learn the rate soon; they grow until the window is as long as it should be, then it moves.
void FrameClock::open_segment() noexcept {
  if (count_ == kSegments) {
    if (segment_length_ < kMaxSegment) {
      merge_pairs();
    } else {
      std::move(segments_.begin() + 1, segments_.end(), segments_.begin());
      --count_;
    }
  }
  segments_[count_++] = Segment{};
  in_segment_ = 0;
}

void FrameClock::merge_pairs() noexcept {
  for (std::size_t i = 0; i < kSegments / 2; ++i) {
    Segment merged = segments_[2 * i];
    tighten(merged, segments_[2 * i + 1]);
    segments_[i] = merged;
  }
  count_ = kSegments / 2;
  segment_length_ *= 2;
}

// The line is above one bound and below another: that says how steep it can be. There is a line that keeps
// all bounds if and only if every such pair leaves a slope.
bool FrameClock::find_periods() noexcept {
  double least = min_allowed_ns_;
  double most = max_allowed_ns_;
  for (std::size_t i = 0; i < count_; ++i) {
    const Bound& above = segments_[i].earliest;
    for (std::size_t j = 0; above.known && j < count_; ++j) {
      const Bound& below = segments_[j].latest;
      const double run = below.n - above.n;
      const double rise_ns = below.time_ns - above.time_ns;
      if (!below.known || (run == 0 && rise_ns >= 0)) {
        continue;
      }
      if (run >= 0) {
        most = std::min(most, run > 0 ? rise_ns / run : -kUnbounded);
      } else {
        least = std::max(least, rise_ns / run);
      }
    }
  }
  if (least > most) {
    return false;
  }
  min_period_ns_ = least;
  max_period_ns_ = most;
  return true;
}

// That a measurement has arrived cannot be wrong; that the next one was not there can be, when the reply
// belonged to an earlier question or was an old one. So a lower bound that contradicts the others is not
// taken; when the upper bounds contradict what was taken, or some new ones in a row do, the lower bounds
// begin anew.
void FrameClock::forget_earliest() noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    segments_[i].earliest.known = false;
  }
}

// Before a measurement's own number the line is latest when it is steepest and earliest when it is flattest;
// the one bound behind the newest measurement, that of its successor, counts the other way round.
FrameClock::Range FrameClock::range(std::uint64_t measurement) const noexcept {
  const auto n = static_cast<double>(static_cast<std::int64_t>(measurement - base_measurement_));
  double earliest = -kUnbounded;
  double latest = kUnbounded;
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& [above, below] = segments_[i];
    if (above.known) {
      const double period_ns = above.n <= n ? min_period_ns_ : max_period_ns_;
      earliest = std::max(earliest, above.time_ns + period_ns * (n - above.n));
    }
    if (below.known) {
      latest = std::min(latest, below.time_ns + max_period_ns_ * (n - below.n));
    }
  }
  earliest = std::min(std::max(earliest, latest - as_ns(kUnknown)), latest);
  return {base_time_ + std::chrono::nanoseconds(std::llround(earliest)),
          base_time_ + std::chrono::nanoseconds(std::llround(latest))};
}

}  // namespace tubed::aurora
