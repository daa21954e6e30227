// Which of several writers of one instrument is heard. Pure: time comes as a value; one object an instrument.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "clients/cpp/sequence_guard.hpp"

namespace tubed {

/// What is to be done with a sample. The first three are delivered, the others are not.
enum class Ruling {
  kFirst,        ///< the first of this instrument
  kNext,         ///< the next one of the writer that is followed
  kOtherWriter,  ///< another writer is followed from this sample on: a restart, or a rival's end
  kBackward,     ///< seen before: a replay
  kImplausible,  ///< its number outruns rate times time
  kRival         ///< of a writer that is not followed
};

inline bool is_delivered(Ruling ruling) {
  return ruling == Ruling::kFirst || ruling == Ruling::kNext || ruling == Ruling::kOtherWriter;
}

/// A writer is DDS's handle together with the daemon's start, not the numbers in its samples. The writer that
/// is followed stays so while it is alive. Another one takes over when it has proved itself (three samples in
/// order within 100 ms of each other) and the followed one ended: DDS unmatched it, the caller found it
/// silent, or the other one was heard for 150 ms without a gap while the followed one said nothing. With the
/// period of 33 ms that is within 200 ms of the last sample, so that the real daemon is heard within 250 ms
/// of a rival's end. Silence counts only while the other is heard: a client that was stopped itself changes
/// nobody.
///
/// Known limit: packets forged under the handle and start of the real writer can only be told apart by order,
/// rate and time; more needs DDS Security.
class WriterChoice {
 public:
  explicit WriterChoice(double max_rate_hz) : max_rate_hz_(max_rate_hz) { others_.reserve(kMaxOthers); }

  /// `now_ns`: CLOCK_BOOTTIME of this host. Samples of others are remembered; one that may be delivered only
  /// by accept().
  Ruling judge(const SampleOrigin& sample, std::int64_t now_ns);
  /// Delivers what judge() just ruled to be delivered, which then is the newest.
  void accept(const SampleOrigin& sample, Ruling ruling, std::int64_t now_ns);

  /// DDS matches these writers now; those that are missing have ended.
  void match(std::span<const std::uint64_t> writers);
  /// The followed writer was silent for the liveliness period, and nothing of it waits in a queue.
  void find_silent() { is_silent_ = true; }

  /// The writer that is followed; none before the first sample.
  [[nodiscard]] std::optional<std::uint64_t> followed() const {
    return followed_ ? std::optional(followed_->handle) : std::nullopt;
  }
  /// The followed writer is not matched any more.
  [[nodiscard]] bool is_followed_gone() const { return followed_ && followed_->is_gone; }
  /// DDS's handle of another writer that published in the last second while the followed one did.
  [[nodiscard]] std::optional<std::uint64_t> rival(std::int64_t now_ns) const;
  /// Numbers missing between the newest accepted sample and the one before it; 0 after a change of writer.
  [[nodiscard]] std::uint64_t lost_before() const { return lost_before_; }

 private:
  static constexpr std::size_t kMaxOthers = 8;
  static constexpr std::size_t kMaxEnded = 64;

  struct Writer {
    std::uint64_t handle;
    std::uint64_t daemon_start;
    SequenceGuard guard;
    bool is_gone = false;
    bool was_followed = false;
    bool overlaps = false;  ///< the followed writer was heard after it
    int run = 0;            ///< samples without a long gap, while not followed
    std::int64_t run_began_ns = 0;
    std::int64_t heard_ns = 0;
    std::optional<std::int64_t> alone_since_ns{};  ///< heard since then, and the followed writer was not
  };

  /// The end of a start that was followed: what goes back behind it is a replay.
  struct Ended {
    std::uint64_t daemon_start;
    std::uint64_t newest_number;
  };

  static bool is_of(const Writer& writer, const SampleOrigin& sample) {
    return writer.handle == sample.writer && writer.daemon_start == sample.daemon_start;
  }

  Ruling judge_followed(const SampleOrigin& sample, std::int64_t now_ns);
  Ruling judge_other(const SampleOrigin& sample, std::int64_t now_ns);
  Writer* other(const SampleOrigin& sample, std::int64_t now_ns);
  void forget_silent(std::int64_t now_ns);
  void hear(Writer& writer, std::int64_t now_ns);
  [[nodiscard]] bool takes_over(const Writer& writer, std::int64_t now_ns) const;
  [[nodiscard]] bool is_replay_of_ended(const SampleOrigin& sample) const;
  void follow(const SampleOrigin& sample);
  void retire(const Writer& writer);

  double max_rate_hz_;
  std::optional<Writer> followed_;
  bool is_silent_ = false;  ///< the followed one, by find_silent()
  std::vector<Writer> others_;
  std::vector<Ended> ended_;
  std::uint64_t lost_before_ = 0;
};

}  // namespace tubed
