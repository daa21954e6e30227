// When measurements were made, from the questions and answers of polling.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/aurora/frame_clock.hpp"

namespace tubed::aurora {

/// A FrameClock, fed with what can be relied upon. A question that was answered with a measurement already
/// seen proves that the next one was not there yet, unless the answer was a copy: then the true answer
/// follows behind the one to the next question. So such evidence waits until the line has been quiet. One
/// thread; no allocation.
class MeasurementTimes {
 public:
  /// An answer, and the question before it.
  struct Answer {
    MonotonicTime asked{};
    MonotonicTime answered{};
    bool in_step = false;  ///< it is the answer to that question, and to no earlier one
  };

  /// The tracker counts anew, or too long was nothing heard: everything but the period and the mean
  /// turnaround is forgotten.
  void restart() noexcept {
    clock_.reset();
    forget_unverified();
  }

  /// A reply with a new measurement. True: the line has to be quiet next, so that what is unverified can be
  /// relied upon.
  bool observe(std::uint64_t measurement, const Answer& answer) noexcept;

  /// A reply with `measurement` again: the one after it was not there yet at that question.
  void repeated(std::uint64_t measurement, const Answer& answer) noexcept;

  /// The line is kept quiet before the next question: no other answer is on its way then.
  void quiet_follows() noexcept { verified_by_quiet_ = true; }
  /// The next question is sent.
  void asked() noexcept;

  /// What came before was no answer to the question that it was taken for.
  void forget_unverified() noexcept { unverified_count_ = 0; }

  [[nodiscard]] const FrameClock& clock() const noexcept { return clock_; }
  /// Between measurements, as learnt.
  [[nodiscard]] double period_ns() const noexcept { return period_ns_; }
  /// From a question to its answer, mean.
  [[nodiscard]] std::chrono::nanoseconds turnaround() const noexcept { return turnaround_; }

 private:
  /// Measurement `measurement` was not there when the tracker was asked.
  struct Evidence {
    std::uint64_t measurement = 0;
    MonotonicTime asked;
  };

  void remember(std::uint64_t measurement, MonotonicTime asked) noexcept;

  FrameClock clock_;
  std::array<Evidence, 4> unverified_{};
  std::size_t unverified_count_ = 0;
  bool verified_by_quiet_ = false;
  std::chrono::nanoseconds turnaround_{0};
  double period_ns_ = 25e6;
};

}  // namespace tubed::aurora
