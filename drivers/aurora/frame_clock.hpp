// When an Aurora measured, by the host's clock: learned from what each reply proves.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

/// Fits a line, instant of measurement n = a + b n, to bounds instead of to arrival times. A reply whose
/// newest measurement is n proves two things, whatever delays host, adapter and line add: n was there when
/// the reply began (a + b n <= answered), and n + 1 was not when the tracker had the question (a + b (n + 1)
/// > asked). A late reply only makes its bound loose, never wrong; a question that comes just after or just
/// before a new measurement makes it tight. All lines that keep every bound of the last 20 s are possible;
/// crystals drift by less than 1e-7 in that time, so that lines are enough. A question in the middle of the
/// interval that is possible for the next measurement halves that interval, so that few questions keep the
/// fit tight.
///
/// One thread; no clock, no allocation.
class FrameClock {
 public:
  /// When a measurement became available: between these two.
  struct Range {
    MonotonicTime earliest;
    MonotonicTime latest;

    [[nodiscard]] MonotonicTime middle() const noexcept { return earliest + (latest - earliest) / 2; }
    [[nodiscard]] std::chrono::nanoseconds width() const noexcept { return latest - earliest; }
  };

  /// Forgets everything: the tracker counts anew.
  void reset() noexcept { *this = FrameClock(); }

  /// A reply's newest measurement was `measurement` (counts up, see FrameCounter). The tracker had the
  /// question not before `asked` and began the answer not after `answered`. Without `asked`: nobody knows
  /// which question it answers, so that only its arrival proves something.
  void observe(std::uint64_t measurement, std::optional<MonotonicTime> asked,
               MonotonicTime answered) noexcept;

  /// `measurement` was not there when the tracker had a question, not before `asked`: what a repetition
  /// proves, also when later measurements have been seen meanwhile. Only after observe().
  void not_there(std::uint64_t measurement, MonotonicTime asked) noexcept;

  /// Width of a range that nothing bounds below.
  static constexpr std::chrono::seconds kUnknown{1};

  /// What is possible for `measurement`: the newest one or a later one. Only after observe(). Its width is
  /// the honest uncertainty: up to kUnknown when no question bounds it.
  [[nodiscard]] Range range(std::uint64_t measurement) const noexcept;
  /// Whether observe() was called.
  [[nodiscard]] bool started() const noexcept { return count_ > 0; }
  /// Time between two measurements: the middle of what is possible.
  [[nodiscard]] double period_ns() const noexcept { return (min_period_ns_ + max_period_ns_) / 2; }
  /// Whether the period is known to 1 %.
  [[nodiscard]] bool knows_period() const noexcept {
    return max_period_ns_ - min_period_ns_ < 0.02 * min_period_ns_;
  }
  /// Times that the bounds contradicted each other: a reply was older than it seemed.
  [[nodiscard]] std::uint64_t contradictions() const noexcept { return contradictions_; }

 private:
  /// One bound of the line; n and time count from a base that moves along.
  struct Bound {
    double n = 0;
    double time_ns = 0;
    bool known = false;
  };
  /// The tightest bounds of some measurements in a row.
  struct Segment {
    Bound earliest;  ///< the line is above
    Bound latest;    ///< the line is below
  };
  static constexpr std::size_t kSegments = 48;
  static constexpr int kMaxSegment = 16;  ///< measurements

  void rebase(std::uint64_t measurement, MonotonicTime time) noexcept;
  void tighten(Segment& segment, const Segment& by) const noexcept;
  void open_segment() noexcept;
  void merge_pairs() noexcept;
  bool find_periods() noexcept;
  void narrow_period() noexcept;
  void forget_earliest() noexcept;

  std::array<Segment, kSegments> segments_{};  ///< oldest first
  std::size_t count_ = 0;
  int segment_length_ = 1;
  int in_segment_ = 0;
  std::uint64_t base_measurement_ = 0;
  MonotonicTime base_time_{};
  // 40 measurements a second are said to be made, 40.4 have been recorded; some trackers make 66.
  static constexpr double kMinPeriodNs = 14e6;
  static constexpr double kMaxPeriodNs = 31e6;
  // What the period can be at all: narrowed once it is known, so that it outlives a lower bound that was
  // wrong.
  double min_allowed_ns_ = kMinPeriodNs;
  double max_allowed_ns_ = kMaxPeriodNs;
  double min_period_ns_ = kMinPeriodNs;
  double max_period_ns_ = kMaxPeriodNs;
  static constexpr int kDisbelievedUntilForgotten = 4;
  static constexpr int kMaxDisbelieved =
      40;                ///< then the period that was learnt is no longer believed either
  int disbelieved_ = 0;  ///< lower bounds not taken, in a row
  std::uint64_t contradictions_ = 0;
};

}  // namespace tubed::aurora
