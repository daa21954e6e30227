// A catheterisation as motion: where the catheter is at any time.
#pragma once

#include <memory>
#include <vector>

#include "drivers/laboratory/instrument/catheterisation.hpp"

namespace tubed {

/// Plays the steps of a run at a constant rate: to the end and, being pulled the same way back, to the
/// beginning, and again. Between two steps positions are interpolated at equal arc length (0.02 % short at
/// most where tangents differ by 0.08 rad); a step that snaps is a jump half way. Immutable, callable from
/// any thread, at() never allocates.
class PlayedRun {
 public:
  PlayedRun(std::shared_ptr<const Catheterisation> run, double steps_per_s);

  /// Number of the step at `t_s`, with what has passed of the next one.
  [[nodiscard]] double step_at(double t_s) const;
  /// The catheter `s_mm` from its tip at `t_s`.
  [[nodiscard]] ShapePoint at(double t_s, double s_mm) const;
  [[nodiscard]] double insertion_mm(double t_s) const;
  /// From the first step to the last.
  [[nodiscard]] double duration_s() const;

 private:
  struct Between {
    std::size_t before;
    std::size_t after;
    double share;  ///< of after
  };
  [[nodiscard]] Between between(double t_s) const;

  std::shared_ptr<const Catheterisation> run_;
  double steps_per_s_;
  std::vector<bool> jumps_;  ///< from step i to i + 1
};

}  // namespace tubed
