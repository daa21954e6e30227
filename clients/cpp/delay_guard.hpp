// Tells shapes that waited somewhere on the way, in the queues of a process that was stopped or of a network
// that stood still, and those whose time runs ahead of now, from those that come as quickly as usual. Pure;
// one object an instrument.
#pragma once

#include <algorithm>
#include <cstdint>

namespace tubed {

enum class Delay { kUsual, kLate, kEarly };

/// The clocks of two hosts differ by an unknown amount, so that no single sample says how old it is. The
/// quickest of the last minute or two does: whatever takes longer than that by more than `max_difference_ns`
/// waited, and what is quicker by more than that states a time that has not come yet. One clock that stood
/// still while a host slept would make everything look late, or early, for ever: when nothing else comes for
/// a second, it is the new measure.
class DelayGuard {
 public:
  explicit DelayGuard(std::int64_t max_difference_ns) : max_difference_ns_(max_difference_ns) {}

  /// How long a sample took. `daemon_start` says whose clock `published_ns` is of; `received_ns` is of this
  /// host; both monotonic.
  Delay judge(std::uint64_t daemon_start, std::int64_t published_ns, std::int64_t received_ns) {
    // Whatever a forger states: no difference of two delays overflows.
    const std::int64_t delay_ns =
        received_ns - std::clamp(published_ns, received_ns - kMax_ns, received_ns + kMax_ns);
    if (daemon_start != daemon_start_) {
      daemon_start_ = daemon_start;
      lowest_ns_ = delay_ns;
      begin_again(delay_ns, received_ns);
      return Delay::kUsual;
    }
    const Delay delay = delay_ns - quickest_ns() > max_difference_ns_                         ? Delay::kLate
                        : std::min(quickest_ns(), lowest_ns_) - delay_ns > max_difference_ns_ ? Delay::kEarly
                                                                                              : Delay::kUsual;
    if (delay == Delay::kUsual) {
      unusual_ = Delay::kUsual;
      take(delay_ns, received_ns);
      return Delay::kUsual;
    }
    if (delay != unusual_) {
      unusual_ = delay;
      first_unusual_ns_ = received_ns;
    }
    const std::int64_t timeout_ns = delay == Delay::kLate ? kLateTimeout_ns : kEarlyTimeout_ns;
    if (received_ns - first_unusual_ns_ < timeout_ns) return delay;
    // After late ones the usual ones may come again at once: what is quick is still known.
    lowest_ns_ = delay == Delay::kEarly ? delay_ns : std::min(lowest_ns_, quickest_ns());
    begin_again(delay_ns, received_ns);
    return Delay::kUsual;
  }

 private:
  static constexpr std::int64_t kLateTimeout_ns = 1'000'000'000;
  static constexpr std::int64_t kEarlyTimeout_ns = 150'000'000;
  static constexpr std::int64_t kPeriod_ns = 60'000'000'000;
  static constexpr std::int64_t kMax_ns = std::int64_t{1} << 61;  ///< 73 years

  [[nodiscard]] std::int64_t quickest_ns() const { return std::min(quickest_now_ns_, quickest_before_ns_); }

  void begin_again(std::int64_t delay_ns, std::int64_t received_ns) {
    quickest_now_ns_ = quickest_before_ns_ = delay_ns;
    period_began_ns_ = received_ns;
    unusual_ = Delay::kUsual;
  }

  void take(std::int64_t delay_ns, std::int64_t received_ns) {
    if (received_ns - period_began_ns_ >= kPeriod_ns) {
      lowest_ns_ = quickest_now_ns_;
      quickest_before_ns_ = quickest_now_ns_;
      quickest_now_ns_ = delay_ns;
      period_began_ns_ = received_ns;
    }
    quickest_now_ns_ = std::min(quickest_now_ns_, delay_ns);
  }

  std::int64_t max_difference_ns_;
  std::uint64_t daemon_start_ = 0;
  std::int64_t quickest_now_ns_ = 0;
  std::int64_t quickest_before_ns_ = 0;
  std::int64_t period_began_ns_ = 0;
  std::int64_t lowest_ns_ = 0;     ///< of the last minutes, also from before all were late
  Delay unusual_ = Delay::kUsual;  ///< what the last ones were
  std::int64_t first_unusual_ns_ = 0;
};

}  // namespace tubed
