// What the lines of one image say of the tube around which they were searched.
#pragma once

#include <optional>

#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/projected_lines.hpp"

namespace tubed {

/// Takes lines that begin less than `from_mm` from the tip out of view. Returns how many of them were in
/// view.
int leave_out_before(double from_mm, const LineLayout& layout, CorrespondenceLines& lines);

/// Do most lines of the tube's last 16 mm disagree? Nothing: fewer than 4 of them are in view.
std::optional<bool> misses_tip(const CorrespondenceLines& lines, const LineLayout& layout);

/// How many lines of the last 32 mm were asked and show no tube.
int unseen_at_tip(const CorrespondenceLines& lines, const LineLayout& layout);

/// A stretch of the tube that lies beside where it was predicted.
struct Surprise {
  double chi2 = 0;  ///< mean square of its lines' offsets over what prediction and lines expect of them
  double s_mm = 0;  ///< its middle, from the tip
};
/// The greatest one of all stretches of 20 mm that the image shows. `sigma_px`: what an offset is wrong by,
/// beside the line's own variance.
Surprise greatest_surprise(const CorrespondenceLines& lines, const LineLayout& layout, double sigma_px);

}  // namespace tubed
