// The image likelihood behind one interface: where along its correspondence lines the tube is, and how sure.
#pragma once

#include <memory>

#include "daemon/image/correspondence_lines.hpp"
#include "daemon/image/image_likelihood_form.hpp"
#include "daemon/image/image_measurement.hpp"
#include "daemon/image/projected_lines.hpp"

namespace tubed {

/// One a camera and instrument; called by the optimizer thread only. What a form has to know of how tube and
/// background look, it learns from the image itself where the tube was found, and keeps only what trust() has
/// confirmed.
class ImageLikelihood {
 public:
  virtual ~ImageLikelihood() = default;

  /// Fills offset_px, variance_px2 and agrees of the first `count` lines that are in view, from `reach_px` (1
  /// .. LineSearch::kMaxReach) to either side. Forms that know nothing of ridges pass over `among`.
  virtual LineSearch::Outcome find(const ImageMeasurement& image, CorrespondenceLines& lines, int count,
                                   int reach_px, LineSearch::Among among) = 0;

  /// The tube was where the newest find() of this image found it.
  virtual void trust(const ImageMeasurement& /*image*/) {}

  /// It was not: what only that image told is forgotten.
  virtual void distrust() {}

  /// Begins afresh.
  virtual void forget() {}
};

/// Takes all memory but that of kBand, which grows with the first image.
std::unique_ptr<ImageLikelihood> make_image_likelihood(ImageLikelihoodForm form);

}  // namespace tubed
