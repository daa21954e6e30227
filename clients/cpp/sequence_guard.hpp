// Decides whether a sample of one writer is its next one, was seen before, or cannot be: a number cannot
// outrun rate times time. Pure; one object a writer and start.
#pragma once

#include <cstdint>
#include <optional>

namespace tubed {

/// What a sample says about itself, and DDS of it.
struct SampleOrigin {
  std::uint64_t daemon_start = 0;
  std::uint64_t sequence_number = 0;
  std::int64_t publish_monotonic_ns = 0;  ///< of the daemon's host: never steps, comparable within one start
  std::uint64_t writer = 0;               ///< DDS's handle of the matched writer it came from
};

enum class Order { kFirst, kNext, kBackward, kImplausible };

/// Accepts sequence numbers and times that go forward, and no faster than `max_rate_hz` allows. A refused
/// jump changes nothing, so that one forged sample does not make the client deaf. When for a second nothing
/// but samples beyond the jump came, in order among themselves, the clock of this host stood still (a paused
/// virtual machine) and they are accepted.
class SequenceGuard {
 public:
  explicit SequenceGuard(double max_rate_hz) : max_rate_hz_(max_rate_hz) {}

  /// Where the sample stands, if accepted now. `now_ns` is of this host and goes on while it sleeps.
  [[nodiscard]] Order order_of(const SampleOrigin& sample, std::int64_t now_ns) const {
    if (!newest_) {
      // A daemon has not published for longer than its host is up.
      const bool possible = is_within_rate(sample.sequence_number, sample.publish_monotonic_ns);
      return possible ? Order::kFirst : Order::kImplausible;
    }
    if (!is_forward(*newest_, sample)) return Order::kBackward;
    if (follows(*newest_, newest_ns_, sample, now_ns)) return Order::kNext;
    const bool is_proved = now_ns - newest_ns_ >= kJumpTimeout_ns && jumps_ >= kJumpSamples &&
                           is_forward(jump_, sample) && follows(jump_, jump_ns_, sample, now_ns);
    return is_proved ? Order::kNext : Order::kImplausible;
  }

  /// Remembers a sample that order_of() called kFirst or kNext.
  void accept(const SampleOrigin& sample, std::int64_t now_ns) {
    newest_ = sample;
    newest_ns_ = now_ns;
    jumps_ = 0;
  }

  /// Remembers a sample that order_of() called kImplausible.
  void refuse_jump(const SampleOrigin& sample, std::int64_t now_ns) {
    const bool goes_on = jumps_ > 0 && is_forward(jump_, sample) && follows(jump_, jump_ns_, sample, now_ns);
    jumps_ = goes_on ? jumps_ + 1 : 1;
    jump_ = sample;
    jump_ns_ = now_ns;
  }

  /// Of the newest accepted sample; 0 before the first.
  [[nodiscard]] std::uint64_t newest_number() const { return newest_ ? newest_->sequence_number : 0; }

 private:
  static constexpr std::int64_t kJumpTimeout_ns = 1'000'000'000;
  static constexpr int kJumpSamples = 8;
  static constexpr double kMarginSamples = 60;  // two seconds at 30 Hz that waited in a queue

  static bool is_forward(const SampleOrigin& before, const SampleOrigin& after) {
    return after.sequence_number > before.sequence_number &&
           after.publish_monotonic_ns >= before.publish_monotonic_ns;
  }

  [[nodiscard]] bool is_within_rate(std::uint64_t numbers, std::int64_t elapsed_ns) const {
    const double seconds = elapsed_ns > 0 ? static_cast<double>(elapsed_ns) * 1e-9 : 0;
    return static_cast<double>(numbers) <= max_rate_hz_ * seconds + kMarginSamples;
  }

  [[nodiscard]] bool follows(const SampleOrigin& before, std::int64_t before_ns, const SampleOrigin& after,
                             std::int64_t now_ns) const {
    return is_within_rate(after.sequence_number - before.sequence_number, now_ns - before_ns);
  }

  double max_rate_hz_;
  std::optional<SampleOrigin> newest_;
  std::int64_t newest_ns_ = 0;
  SampleOrigin jump_;  ///< newest of those beyond the jump
  std::int64_t jump_ns_ = 0;
  int jumps_ = 0;
};

}  // namespace tubed
