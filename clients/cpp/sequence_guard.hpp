// Decides whether a sample is news, or was seen before and is being replayed. Pure; one object an instrument.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace tubed {

/// What a sample says about itself.
struct SampleOrigin {
  std::uint64_t daemon_start = 0;
  std::uint64_t sequence_number = 0;
  std::int64_t publish_monotonic_ns = 0;  ///< of the daemon's host: never steps, comparable within one start
  std::int64_t publish_time_ns = 0;       ///< CLOCK_REALTIME: comparable between starts
  std::uint64_t writer = 0;               ///< DDS's handle of the matched writer it came from
};

enum class Verdict { kFirst, kNext, kRestart, kBackward };

/// Accepts sequence numbers and times that go forward within one start of the daemon, and a start that was
/// never seen before if it is later than what was accepted last or comes from a writer that DDS matched anew:
/// a wall clock that was set back between two starts must not lock the new daemon out, while recorded packets
/// carry the name of a writer that is gone. Everything else goes backward: a replay.
class SequenceGuard {
 public:
  /// The verdict; anything but kBackward becomes the newest accepted sample.
  Verdict judge(const SampleOrigin& sample) {
    const Verdict verdict = verdict_of(sample);
    if (verdict == Verdict::kBackward) {
      return verdict;
    }
    lost_before_ = verdict == Verdict::kNext ? sample.sequence_number - newest_.sequence_number - 1 : 0;
    if (verdict == Verdict::kRestart) {
      remember(newest_.daemon_start);
    }
    newest_ = sample;
    return verdict;
  }

  /// The verdict that judge() would give; nothing is remembered.
  [[nodiscard]] Verdict verdict_of(const SampleOrigin& sample) const {
    if (newest_.daemon_start == 0) {
      return Verdict::kFirst;
    }
    if (sample.daemon_start == newest_.daemon_start) {
      const bool forward = sample.sequence_number > newest_.sequence_number &&
                           sample.publish_monotonic_ns >= newest_.publish_monotonic_ns;
      return forward ? Verdict::kNext : Verdict::kBackward;
    }
    const bool seen = std::find(ended_.begin(), ended_.end(), sample.daemon_start) != ended_.end();
    const bool is_later = sample.publish_time_ns > newest_.publish_time_ns;
    const bool is_new_writer = sample.writer != newest_.writer;
    return !seen && (is_later || is_new_writer) ? Verdict::kRestart : Verdict::kBackward;
  }

  /// Sequence numbers that are missing between the newest accepted sample and the one before it.
  [[nodiscard]] std::uint64_t lost_before() const { return lost_before_; }

 private:
  static constexpr std::size_t kRememberedStarts = 64;

  void remember(std::uint64_t daemon_start) {
    if (ended_.size() == kRememberedStarts) {
      ended_.erase(ended_.begin());
    }
    ended_.push_back(daemon_start);
  }

  SampleOrigin newest_;
  std::uint64_t lost_before_ = 0;
  std::vector<std::uint64_t> ended_;
};

}  // namespace tubed
