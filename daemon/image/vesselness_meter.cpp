#include "daemon/image/vesselness_meter.hpp"

#include <algorithm>

namespace tubed {

namespace {

FrangiMemory memory_for(const FrangiSettings& settings, MeterUse use) {
  return use == MeterUse::kFirst && settings.area == FrangiArea::kFrame ? FrangiMemory::kWholeImage
                                                                        : FrangiMemory::kRows;
}

GreyPixels grey_of(const ImageMeasurement& image) {
  return GreyPixels::WholeNumbers{image.grey, image.brightest};
}

}  // namespace

VesselnessMeter::VesselnessMeter(int width, int height, const FrangiSettings& settings, MeterUse use)
    : filter_(width, height, settings, memory_for(settings, use)),
      kind_(settings.area),
      finds_polarity_(settings.polarity == PolaritySetting::kAuto),
      polarity_(first_polarity(settings.polarity)),
      missing_(width, height) {
  rectangles_.reserve(static_cast<std::size_t>(missing_.cell_count()));
}

void VesselnessMeter::take(ImageMeasurement& image, const ImageArea& area) {
  image.polarity = polarity_;
  image.finds_polarity = finds_polarity_;
  filter_.set_polarity(polarity_);
  if (kind_ == FrangiArea::kFrame) {
    filter_.filter(grey_of(image), image.vesselness);
    image.measured.add_whole();
  } else {
    filter_.renew_structureness(grey_of(image));
    image.measured.clear();
    measure(image, area);
  }
  for (std::size_t i = 0; i < filter_.scale_count(); ++i) {
    image.structureness[i] = filter_.structureness(i);
  }
}

void VesselnessMeter::complete(ImageMeasurement& image, const ImageArea& area) {
  if (image.measured.covers(area)) {
    return;
  }
  filter_.set_structureness(image.structureness);
  filter_.set_polarity(image.polarity);
  missing_ = area;
  missing_.remove(image.measured);
  measure(image, missing_);
}

void VesselnessMeter::measure(ImageMeasurement& image, const ImageArea& area) {
  area.to_rectangles(rectangles_);
  filter_.filter_tiles(grey_of(image), rectangles_, RidgeMaps{image.vesselness});
  image.measured.add(area);
}

void ImageOnDemand::begin() {
  asked_.clear();
  counted_ = false;
}

void ImageOnDemand::filter_missing(ImageMeasurement& image, const ImageArea& area) {
  asked_.add(area);
  if (image.state != ImageState::kMeasured || image.measured.covers(area)) {
    return;
  }
  meter_.complete(image, area);
  completed_images_ += counted_ ? 0 : 1;
  counted_ = true;
}

}  // namespace tubed
