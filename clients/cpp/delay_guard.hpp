// Tells shapes that waited somewhere on the way, in the queues of a process that was stopped or of a network
// that stood still, from those that come as quickly as usual. Pure; one object an instrument.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace tubed {

/// The clocks of two hosts differ by an unknown amount, so that no single sample says how old it is. The
/// quickest of the last minute or two does: whatever takes longer than that by more than `longest_wait_ns`
/// waited. One clock that stood still while a host slept would make everything look late for ever: when only
/// late ones come for a second, they are the new measure.
class DelayGuard {
 public:
  explicit DelayGuard(std::int64_t longest_wait_ns) : longest_wait_ns_(longest_wait_ns) {}

  /// Whether a sample waited too long. `daemon_start` says whose clock `published_ns` is of; `received_ns` is
  /// of this host; both monotonic.
  bool is_late(std::uint64_t daemon_start, std::int64_t published_ns, std::int64_t received_ns) {
    const std::int64_t delay_ns = received_ns - published_ns;
    if (daemon_start != daemon_start_) {
      daemon_start_ = daemon_start;
      begin_again(delay_ns, received_ns);
      return false;
    }
    if (delay_ns - quickest_ns() > longest_wait_ns_) {
      first_late_ns_ = first_late_ns_.value_or(received_ns);
      if (received_ns - *first_late_ns_ < kPatience_ns) return true;
      begin_again(delay_ns, received_ns);
      return false;
    }
    first_late_ns_.reset();
    take(delay_ns, received_ns);
    return false;
  }

 private:
  static constexpr std::int64_t kPatience_ns = 1'000'000'000;
  static constexpr std::int64_t kPeriod_ns = 60'000'000'000;

  [[nodiscard]] std::int64_t quickest_ns() const { return std::min(quickest_now_ns_, quickest_before_ns_); }

  void begin_again(std::int64_t delay_ns, std::int64_t received_ns) {
    quickest_now_ns_ = quickest_before_ns_ = delay_ns;
    period_began_ns_ = received_ns;
    first_late_ns_.reset();
  }

  void take(std::int64_t delay_ns, std::int64_t received_ns) {
    if (received_ns - period_began_ns_ >= kPeriod_ns) {
      quickest_before_ns_ = quickest_now_ns_;
      quickest_now_ns_ = delay_ns;
      period_began_ns_ = received_ns;
    }
    quickest_now_ns_ = std::min(quickest_now_ns_, delay_ns);
  }

  std::int64_t longest_wait_ns_;
  std::uint64_t daemon_start_ = 0;
  std::int64_t quickest_now_ns_ = 0;
  std::int64_t quickest_before_ns_ = 0;
  std::int64_t period_began_ns_ = 0;
  std::optional<std::int64_t> first_late_ns_;
};

}  // namespace tubed
