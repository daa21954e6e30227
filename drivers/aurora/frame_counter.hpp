// Makes a count of measurements out of an Aurora's frame numbers.
#pragma once

#include <cstdint>

namespace tubed::aurora {

/// The counter goes up by this much from one measurement to the next (40 a second).
inline constexpr std::uint32_t kCountsPerMeasurement = 8;

/// What a frame number is, seen after those before it.
enum class FrameKind {
  kFirst,      ///< there was none before
  kNew,        ///< a later measurement
  kDuplicate,  ///< the measurement that was seen last, again
  kOld,        ///< one from before the last: a late reply. Not to be used
  kRestarted,  ///< the second in a row that goes on from an old one: the tracker counts anew
};

struct FrameStep {
  FrameKind kind = FrameKind::kFirst;
  std::uint64_t measurement = 0;  ///< counts from 0 at the first; goes on counting through wraps and restarts
  std::uint32_t missed = 0;       ///< measurements between this and the one before that nobody saw
};

/// One thread. Unwraps at 2^32 counts (155 days).
class FrameCounter {
 public:
  /// Takes in one frame number. Only kFirst, kNew and kRestarted are measurements not seen before.
  FrameStep observe(std::uint32_t frame) noexcept;
  /// Forgets everything: tracking has been started anew.
  void reset() noexcept { *this = FrameCounter(); }
  /// Steps that were no multiple of kCountsPerMeasurement, rounded to the nearest.
  [[nodiscard]] std::uint64_t odd_steps() const noexcept { return odd_steps_; }

 private:
  FrameStep advance(FrameKind kind, std::uint32_t frame, std::uint32_t counts) noexcept;

  bool started_ = false;
  bool old_seen_ = false;
  std::uint32_t last_ = 0;
  std::uint32_t old_ = 0;  // the old frame number seen since last_
  std::uint64_t measurement_ = 0;
  std::uint64_t odd_steps_ = 0;
};

}  // namespace tubed::aurora
