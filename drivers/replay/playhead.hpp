// Which row of a replayed list is next, and when it is due.
#pragma once

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// Seconds of a sequence, to the nearest ns.
inline std::chrono::nanoseconds to_nanoseconds(double seconds) {
  return std::chrono::nanoseconds(std::llround(seconds * 1e9));
}

enum class ReplayEnd { kStops, kLoops };

/// Walks through rows ordered by time; looping, row times grow by one lap a round. Reads no clock. Only the
/// constructor allocates.
class Playhead {
 public:
  Playhead() = default;
  /// `times` of the rows since the start of the sequence, not falling; `lap` > 0.
  Playhead(std::vector<std::chrono::nanoseconds> times, std::chrono::nanoseconds lap, ReplayEnd end);

  /// Puts time 0 of the sequence at `start`. Looping, laps that are wholly over at `now` are left out.
  void begin(MonotonicTime start, MonotonicTime now);

  /// No row is left; never when looping over at least one.
  [[nodiscard]] bool ended() const { return at_.row == times_.size(); }
  /// The next row, its lap (from 0) and the instant it stands for. Precondition: not ended().
  [[nodiscard]] std::size_t row() const { return at_.row; }
  [[nodiscard]] std::uint32_t lap() const { return static_cast<std::uint32_t>(at_.lap); }
  [[nodiscard]] MonotonicTime due() const { return due_at(at_); }

  void advance();
  /// Passes over rows that have been overtaken: the row left is the newest one due at `now`, or the next one.
  void skip_overtaken(MonotonicTime now);

 private:
  struct Place {
    std::size_t row = 0;
    std::int64_t lap = 0;
  };

  [[nodiscard]] Place after(Place place) const;
  [[nodiscard]] MonotonicTime due_at(Place place) const {
    return start_ + place.lap * lap_ + times_[place.row];
  }

  std::vector<std::chrono::nanoseconds> times_;
  std::chrono::nanoseconds lap_{1};
  ReplayEnd end_ = ReplayEnd::kStops;
  MonotonicTime start_{};
  Place at_;
};

}  // namespace tubed
