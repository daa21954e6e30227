// Whether the frame number of a reply is one that the tracker can have reached by now: no old pose under a
// new time.
#pragma once

#include <cstdint>

#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

/// Compares the advance of the tracker's frame counter with the time that has passed. The last number that
/// was admitted and its time are kept for as long as the object lives: over TSTOP and TSTART the counter goes
/// on (recorded), so that a counter that stands still is recognised behind every restart. A number that does
/// not fit, and every first number, is held back as a candidate; it is confirmed when a later reply has a
/// greater number, by about as much as time has passed between the two. Only the later one is then a
/// measurement.
///
/// One thread; no clock, no allocation.
class FrameAdmission {
 public:
  enum class Verdict {
    kExpected,   ///< within kTolerance of where the counter has to be; may be a repetition or a late reply
    kConfirmed,  ///< the counter is elsewhere than it has to be, and moves: the times begin anew
    kHeldBack    ///< not to be used: whether the counter moves is not known yet
  };

  /// A late reply, or a reply that the host was late to read, is off by this much.
  static constexpr std::chrono::milliseconds kTolerance{500};
  /// Between a candidate and the number that confirms it.
  static constexpr std::chrono::milliseconds kConfirmationTolerance{200};
  /// A counter's rate is known to 1 %: after so long a restarted one has to prove that it moves.
  static constexpr std::chrono::seconds kMaxExtrapolation{20};

  /// TSTART was carried out: the next number is believed only when it has moved as time has.
  void tracking_started() noexcept {
    proving_ = true;
    has_candidate_ = false;
  }

  /// Judges `number` of a reply that came at `now`; `period_ns` is the time between two measurements.
  Verdict judge(std::uint32_t number, MonotonicTime now, double period_ns) noexcept;

  /// A number has been admitted since tracking_started().
  [[nodiscard]] bool proven() const noexcept { return !proving_; }
  /// The number that was admitted last.
  [[nodiscard]] std::uint32_t last() const noexcept { return last_; }

 private:
  [[nodiscard]] bool expected(std::uint32_t number, MonotonicTime now, double period_ns) const noexcept;
  [[nodiscard]] bool confirms(std::uint32_t number, MonotonicTime now, double period_ns) const noexcept;
  void admit(std::uint32_t number, MonotonicTime now) noexcept;

  bool proving_ = true;
  bool has_last_ = false;
  std::uint32_t last_ = 0;  ///< newest that was admitted
  MonotonicTime last_came_{};
  bool has_candidate_ = false;
  std::uint32_t candidate_ = 0;
  MonotonicTime candidate_came_{};
};

}  // namespace tubed::aurora
