// How well one image holds a tube across itself, place by place.
#pragma once

#include <vector>

#include "daemon/estimator/agreement/coil_image_model.hpp"

namespace tubed {

/// Where an image shows a tube it holds it to a fraction of a millimetre, whatever coils say; where it is too
/// dark to show it the shape goes with its coils, and further from a place that is shown the more. Called by
/// the optimizer thread; memory is taken in the constructor.
class HeldAcross {
 public:
  explicit HeldAcross(double length_mm);

  /// `view`: the newest lines of one image at that shape, in the order of arc length, marks and the end after
  /// them.
  void record(const ViewConstraints& view, const ConfirmedShape& shape);

  /// Standard deviation across the tube in the image's plane, mm, at s_mm from the tip; infinity before the
  /// first image.
  [[nodiscard]] double sigma_mm(double s_mm) const;

 private:
  std::vector<double> information_;  ///< px^-2, of the lines of one step; scratch
  std::vector<double> sigma_mm_;     ///< one a step
};

}  // namespace tubed
