#include "drivers/aurora/frame_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tubed::aurora {

namespace {

// Far beyond what any tracker's rate can be (20 to 80 measurements a second).
constexpr double kShortestPeriodNs = 12.5e6;
constexpr double kLongestPeriodNs = 50e6;
/// Range of periods, relative, from which on its middle is a better guess than what was thought before.
constexpr double kNarrow = 0.01;

}  // namespace

void FrameClock::observe(std::uint64_t measurement, MonotonicTime asked, MonotonicTime answered) noexcept {
  if (count_ == 0) {
    base_measurement_ = measurement;
    base_time_ = answered;
  }
  rebase(measurement, answered);
  if (count_ == 0 || in_segment_ >= segment_length_) {
    open_segment();
  }
  ++in_segment_;
  Segment seen;
  seen.latest = {0, 0, true};
  seen.earliest = {1, static_cast<double>((asked - answered).count()), true};
  tighten(segments_[count_ - 1], seen);
  solve();
}

// The newest measurement is number 0 and its reply's time 0: numbers stay small and exact.
void FrameClock::rebase(std::uint64_t measurement, MonotonicTime time) noexcept {
  const double n = static_cast<double>(measurement - base_measurement_);
  const double ns = static_cast<double>((time - base_time_).count());
  base_measurement_ = measurement;
  base_time_ = time;
  offset_ns_ += period_ns_ * n - ns;
  for (std::size_t i = 0; i < count_; ++i) {
    for (Bound* bound : {&segments_[i].earliest, &segments_[i].latest}) {
      bound->n -= n;
      bound->time_ns -= ns;
    }
  }
}

void FrameClock::tighten(Segment& segment, const Segment& by) const noexcept {
  const auto offset = [this](const Bound& bound) { return bound.time_ns - period_ns_ * bound.n; };
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
    if (segment_length_ < kLongestSegment) {
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

// Of an earlier and a later bound: the line is above the first and below the second, or the other way round.
FrameClock::Slopes FrameClock::possible_slopes() const noexcept {
  Slopes slopes{kShortestPeriodNs, kLongestPeriodNs};
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
        slopes.most = std::min(slopes.most, run > 0 ? rise_ns / run : -kLongestPeriodNs);
      } else {
        slopes.least = std::max(slopes.least, rise_ns / run);
      }
    }
  }
  return slopes;
}

void FrameClock::solve() noexcept {
  Slopes slopes = possible_slopes();
  if (slopes.least > slopes.most) {
    resolve_contradiction();
    slopes = possible_slopes();
  }
  if (slopes.least <= slopes.most) {
    const bool narrow = slopes.most - slopes.least < kNarrow * period_ns_;
    period_ns_ =
        narrow ? (slopes.least + slopes.most) / 2 : std::clamp(period_ns_, slopes.least, slopes.most);
  }
  double above = -std::numeric_limits<double>::infinity();
  double below = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count_; ++i) {
    const Segment& segment = segments_[i];
    if (segment.earliest.known) {
      above = std::max(above, segment.earliest.time_ns - period_ns_ * segment.earliest.n);
    }
    if (segment.latest.known) {
      below = std::min(below, segment.latest.time_ns - period_ns_ * segment.latest.n);
    }
  }
  // Every measurement is younger than the one before it, which is a bound as well.
  above = std::max(above, below - period_ns_);
  width_ns_ = std::max(below - above, 0.0);
  offset_ns_ = above <= below ? (above + below) / 2 : below;
}

// That a measurement has arrived cannot be wrong; that the next one was not there can be, when the reply
// belonged to an earlier question. So the lower bounds go, and those that come now count.
void FrameClock::resolve_contradiction() noexcept {
  ++contradictions_;
  for (std::size_t i = 0; i < count_; ++i) {
    segments_[i].earliest.known = false;
  }
}

MonotonicTime FrameClock::available(std::uint64_t measurement) const noexcept {
  const auto n = static_cast<double>(static_cast<std::int64_t>(measurement - base_measurement_));
  return base_time_ + std::chrono::nanoseconds(std::llround(offset_ns_ + period_ns_ * n));
}

std::chrono::nanoseconds FrameClock::uncertainty() const noexcept {
  return std::chrono::nanoseconds(std::llround(width_ns_));
}

}  // namespace tubed::aurora
