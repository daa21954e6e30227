#include "drivers/aurora/measurement_times.hpp"

#include <algorithm>
#include <optional>
#include <utility>

namespace tubed::aurora {

namespace {

/// A tracker that takes longer than this to begin its answer is late.
constexpr std::chrono::milliseconds kMaxTurnaround{10};

}  // namespace

// An answer to an earlier question says nothing about what was there when this one was sent.
bool MeasurementTimes::observe(std::uint64_t measurement, const Answer& answer) noexcept {
  if (!answer.in_step || unverified_count_ > 0) {
    clock_.observe(measurement, std::nullopt, answer.answered);
    if (answer.in_step) {
      remember(measurement, answer.asked);
    }
    return answer.in_step;
  }
  constexpr int kMemory = 16;
  const auto turnaround = std::clamp<std::chrono::nanoseconds>(answer.answered - answer.asked,
                                                               std::chrono::nanoseconds(0), kMaxTurnaround);
  turnaround_ += (turnaround - turnaround_) / kMemory;
  clock_.observe(measurement, answer.asked, answer.answered);
  period_ns_ = clock_.knows_period() ? clock_.period_ns() : period_ns_;
  return false;
}

void MeasurementTimes::repeated(std::uint64_t measurement, const Answer& answer) noexcept {
  if (answer.in_step) {
    remember(measurement, answer.asked);
    verified_by_quiet_ = false;
  }
}

void MeasurementTimes::remember(std::uint64_t measurement, MonotonicTime asked) noexcept {
  unverified_[unverified_count_] = {measurement + 1, asked};
  unverified_count_ = std::min(unverified_count_ + 1, unverified_.size() - 1);
}

void MeasurementTimes::asked() noexcept {
  if (!std::exchange(verified_by_quiet_, false)) {
    return;
  }
  for (std::size_t i = 0; i < unverified_count_ && clock_.started(); ++i) {
    clock_.not_there(unverified_[i].measurement, unverified_[i].asked);
  }
  forget_unverified();
}

}  // namespace tubed::aurora
