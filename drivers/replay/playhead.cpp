#include "drivers/replay/playhead.hpp"

#include <algorithm>
#include <utility>

namespace tubed {

Playhead::Playhead(std::vector<std::chrono::nanoseconds> times, std::chrono::nanoseconds lap, ReplayEnd end)
    : times_(std::move(times)), lap_(lap), end_(end) {}

void Playhead::begin(MonotonicTime start, MonotonicTime now) {
  start_ = start;
  if (end_ == ReplayEnd::kLoops && !times_.empty() && now > start + times_.front()) {
    at_ = {0, (now - start - times_.front()) / lap_};
  }
}

void Playhead::advance() { at_ = after(at_); }

void Playhead::skip_overtaken(MonotonicTime now) {
  while (!ended()) {
    const Place next = after(at_);
    if (next.row == times_.size() || due_at(next) > now) {
      return;
    }
    at_ = next;
  }
}

Playhead::Place Playhead::after(Place place) const {
  if (place.row + 1 < times_.size() || end_ == ReplayEnd::kStops) {
    return {std::min(place.row + 1, times_.size()), place.lap};
  }
  return {0, place.lap + 1};
}

}  // namespace tubed
