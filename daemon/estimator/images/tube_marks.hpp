// Marks along the tube, read in the image where the lines have found it.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "daemon/estimator/images/line_constraint.hpp"
#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/image/mark_search.hpp"
#include "daemon/image/projected_lines.hpp"

namespace tubed {

/// Where the lines of an image have found the tube.
struct FoundPath {
  const CorrespondenceLines& lines;
  const LineLayout& layout;

  /// Place in the image, px, `s_mm` from the tip; before the tip straight on.
  [[nodiscard]] Eigen::Vector2d at(double s_mm) const;
};

/// Looks for the pattern of one instrument's marks. Called by the optimizer thread; memory is taken in the
/// constructor.
class TubeMarks {
 public:
  /// Middles of the marks from the tip, ascending, and the length of each, mm; none: nothing is looked for.
  TubeMarks(const std::vector<double>& marks_mm, double mark_length_mm);

  /// Each mark that lies where the pattern is says how far along itself the tube lies: one constraint a mark,
  /// written into `room`. Returns how many, 0 or all.
  int measure(const ImageMeasurement& image, const FoundPath& path, std::span<LineConstraint> room);

  /// Hardly any of the last images in which they would have to lie shows their pattern.
  [[nodiscard]] bool are_missing() const;

  void forget() { asked_ = found_ = 0; }

 private:
  bool read_darkness(const ImageMeasurement& image, const FoundPath& path);

  MarkSearch search_;
  std::vector<float> darkness_;  ///< along the tube
  double asked_ = 0;             ///< images in which they would have to lie; older ones count less
  double found_ = 0;             ///< of these
};

}  // namespace tubed
