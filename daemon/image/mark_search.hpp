// Dark bands across a tube (electrodes, marker bands), at known places along it: how far along they are seen
// elsewhere.
#pragma once

#include <optional>
#include <span>
#include <vector>

namespace tubed {

/// All marks are seen so much further from the tip than they were expected.
struct MarkShift {
  double shift_mm = 0;
  double sigma_mm = 0;  ///< of it
  int seen = 0;         ///< marks that stand out there
};

/// Finds the pattern of an instrument's marks in how dark a tube is along itself. Which band is which mark is
/// decided by trying all shifts: where another one explains nearly as much, as it may where marks are equally
/// far apart and one of them is not seen, nothing is found. Called by one thread; memory is taken in the
/// constructor.
class MarkSearch {
 public:
  static constexpr double kStep_mm = 0.25;  ///< of profiles
  static constexpr double kReach_mm = 10;   ///< the marks are looked for so far from where they are expected

  static constexpr double kShaft_mm =
      30;  ///< beyond them and the reach, where there is none: the noise is taken there

  /// So much of the tube has to follow the last mark, of bands of that length: the most that until_mm() may
  /// lie behind it, and 1 mm to see which way the tube goes.
  static constexpr double needed_behind_mm(double length_mm) {
    return kReach_mm + kShaft_mm + 2 * length_mm + kStep_mm + 1;
  }

  /// `marks_mm`: middles of the bands, arc length from the tip, ascending; each `length_mm` long.
  MarkSearch(std::vector<double> marks_mm, double length_mm);

  /// Fewer than two marks say nothing of which they are.
  [[nodiscard]] bool can_find() const { return marks_mm_.size() >= 2; }
  /// Arc lengths that a profile has to cover; `from` is beyond the tip.
  [[nodiscard]] double from_mm() const { return from_mm_; }
  [[nodiscard]] double until_mm() const { return until_mm_; }
  /// Samples of such a profile.
  [[nodiscard]] std::size_t samples() const { return responses_.size(); }
  [[nodiscard]] std::span<const double> marks_mm() const { return marks_mm_; }

  /// `darkness`: samples() of them, from from_mm() on, in any unit. Nothing where no shift stands out. Never
  /// allocates.
  std::optional<MarkShift> find(std::span<const float> darkness);

 private:
  void respond(std::span<const float> darkness);
  float sum_at(int shift);
  float noise();
  double middle_near(int shift);
  [[nodiscard]] double score_at(int shift, float noise) const;
  [[nodiscard]] int index_of(double s_mm) const;

  std::vector<double> marks_mm_;
  double length_mm_;
  double side_mm_ = 0;  ///< of what a band is compared with, to either side
  double from_mm_ = 0, until_mm_ = 0;
  std::vector<float> responses_;  ///< a band's darkness beyond that of its sides
  std::vector<float> sorted_;
  std::vector<double> scores_;  ///< of each shift
};

}  // namespace tubed
