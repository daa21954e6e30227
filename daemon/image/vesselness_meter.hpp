// Vesselness where it is asked for.
#pragma once

#include <vector>

#include "daemon/image/frangi.hpp"
#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// What a meter is used for.
enum class MeterUse {
  kFirst,     ///< takes images as they come and decides on c
  kComplete,  ///< measures what is missing of images that another meter has taken
};

/// Measures the vesselness of one camera's images, in areas. Called by one thread; memory is taken in the
/// constructor, nothing else allocates. A pixel comes out the same whatever else is measured with it and by
/// which meter: with structureness 0, c is decided once an image and travels with it.
class VesselnessMeter {
 public:
  /// Throws as FrangiFilter.
  VesselnessMeter(int width, int height, const FrangiSettings& settings, MeterUse use = MeterUse::kFirst);

  /// Takes an image with grey and brightest filled, and measures `area` of it (the whole image where
  /// the settings say so). Sets vesselness, measured, structureness and what is said of its polarity. With
  /// structureness 0, c depends on this camera's images alone, never on `area`: see
  /// FrangiFilter::renew_structureness().
  void take(ImageMeasurement& image, const ImageArea& area);

  /// With polarity kAuto, the ridges that count from the next image on; does nothing otherwise.
  void read_as(RidgePolarity polarity) { polarity_ = finds_polarity_ ? polarity : polarity_; }

  /// Does it count other ridges than it began with?
  [[nodiscard]] bool reads_otherwise() const {
    return finds_polarity_ && polarity_ == RidgePolarity::kBright;
  }

  /// Measures what is missing of `area`, of the ridges that count in that image; does nothing when there is
  /// nothing missing.
  void complete(ImageMeasurement& image, const ImageArea& area);

 private:
  void measure(ImageMeasurement& image, const ImageArea& area);

  FrangiFilter filter_;
  FrangiArea kind_;
  bool finds_polarity_;
  RidgePolarity polarity_;
  ImageArea missing_;
  std::vector<PixelRectangle> rectangles_;
};

/// The second Frangi of an image: of what its reader needs and the first has not measured. Remembers what was
/// needed. Of one camera, called by the optimizer thread only; never allocates.
class ImageOnDemand {
 public:
  /// Throws as FrangiFilter.
  ImageOnDemand(int width, int height, const FrangiSettings& settings)
      : meter_(width, height, settings, MeterUse::kComplete), asked_(width, height), whole_(width, height) {
    whole_.add_whole();
  }

  /// Another image comes, of which nothing has been asked yet.
  void begin();

  /// Filters what is missing of `area` in `image`, the one that begin() announced: its vesselness and
  /// measured change, nothing else. Does nothing when there is nothing missing, or the image has no pixels.
  void filter_missing(ImageMeasurement& image, const ImageArea& area);

  /// Filters what is missing of another picture of that size; nothing is remembered of it.
  void filter_all(ImageMeasurement& picture) { meter_.complete(picture, whole_); }

  /// All that was asked of the newest image.
  [[nodiscard]] const ImageArea& asked() const { return asked_; }

  /// Images of which something had to be measured here, since it was not where it was expected.
  [[nodiscard]] std::uint64_t completed_images() const { return completed_images_; }

 private:
  VesselnessMeter meter_;
  ImageArea asked_;
  ImageArea whole_;
  bool counted_ = false;  ///< in completed_images_
  std::uint64_t completed_images_ = 0;
};

}  // namespace tubed
