// What the lines of one image say of the tube around which they were searched.
#pragma once

#include <array>
#include <optional>

#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/projected_lines.hpp"

namespace tubed {

/// Takes lines that begin less than `from_mm` from the tip out of view. Returns how many of them were in
/// view.
int leave_out_before(double from_mm, const LineLayout& layout, CorrespondenceLines& lines);

/// The same of lines more than `to_mm` from the tip.
int leave_out_beyond(double to_mm, const LineLayout& layout, CorrespondenceLines& lines);

/// Do most lines of the tube's last 16 mm disagree? Nothing: fewer than 4 of them are in view.
std::optional<bool> misses_tip(const CorrespondenceLines& lines, const LineLayout& layout);

/// How many lines of the last 32 mm were asked and show no tube.
int unseen_at_tip(const CorrespondenceLines& lines, const LineLayout& layout);

/// How far the tube lies beside where it was predicted, in stretches of 20 mm that an image shows.
struct Surprise {
  double chi2 = 0;  ///< the greatest: mean square of offsets over what prediction and lines expect of them
  std::array<float, kMaxCorrespondenceLines> beyond_mm2{};  ///< of the stretch about each line, see below

  /// Mean square of the offsets about the place s_mm from the tip, mm^2 across the tube, less what was
  /// expected of them; 0 where they are as expected, and where the image does not show the tube.
  [[nodiscard]] double beyond_mm2_at(double s_mm, const LineLayout& layout) const;

  /// About this line it is so much; `known`: the one it was told of before, -1: none.
  void tell(int line, double variance_mm2, int known);

  /// Of two views the greater one at each place.
  void join(const Surprise& other);
};

/// `sigma_px`: what an offset is wrong by, beside the line's own variance. `radius_mm`: the tube's.
Surprise surprise_of(const CorrespondenceLines& lines, const LineLayout& layout, double sigma_px,
                     double radius_mm);

}  // namespace tubed
