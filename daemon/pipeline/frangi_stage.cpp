#include "daemon/pipeline/frangi_stage.hpp"

#include <cstdio>

namespace tubed {

const char* words_of(ImageRejection rejection) {
  switch (rejection) {
    case ImageRejection::kNone:
      return "";
    case ImageRejection::kWrongSize:
      return "image refused: not the size of the configured camera";
    case ImageRejection::kBlack:
      return "image refused: one even grey, no X-ray image";
    case ImageRejection::kSaturated:
      return "image refused: more than half of it is saturated";
    case ImageRejection::kFrozen:
      return "image refused: equal to the one before, bit by bit";
    case ImageRejection::kNoGeometry:
      return "image refused: it came without a geometry, and its [[camera]] has geometry = \"required\"";
    case ImageRejection::kWrongGeometry:
      return "image refused: the geometry that came with it cannot be";
  }
  return "image refused";
}

bool FrangiStage::step(const Clock& clock) noexcept {
  if (!from_grab_.fetch()) {
    return false;
  }
  if (configured_ != nullptr && configured_->fetch()) {
    image_half_.door.look_from(configured_->front());
  }
  const ImageFrame& frame = from_grab_.front();
  ImageMeasurement& measurement = to_optimizer_.back();
  measurement.camera = camera_;
  measurement.origin = frame.origin;
  measurement.frame_number = frame.frame_number;
  measurement.exposure = frame.exposure;
  measurement.grabbed = frame.received;
  measurement.frangi_started = clock.now();
  measurement.rejection = ImageRejection::kNone;
  if (!frame.fluoroscopy_on) {
    measurement.state = ImageState::kOff;
  } else {
    measurement.rejection = image_half_.door.take(frame, measurement);
    if (measurement.rejection == ImageRejection::kNone) {
      measure(frame, measurement);
      measurement.state = ImageState::kMeasured;
    } else {
      measurement.state = ImageState::kRejected;
      ++refused_;
    }
  }
  newest_rejection_ = measurement.rejection;
  seen_any_ = true;
  const MonotonicTime measurement_end = clock.now();
  measurement.frangi_finished = measurement_end;
  superseded_ += to_optimizer_.publish() ? 1 : 0;
  ++outputs_;
  optimizer_bell_.ring();
  if (preview_) preview_->offer(frame, measurement_end);
  return true;
}

// A prediction that the optimizer made long ago, or never, foresees nothing.
void FrangiStage::measure(const ImageFrame& frame, ImageMeasurement& measurement) noexcept {
  from_optimizer_.fetch();
  const PredictedArea& predicted = from_optimizer_.front();
  if (predicted.polarity) image_half_.meter.read_as(*predicted.polarity);
  image_half_.meter.take(measurement, frame.exposure <= predicted.until ? predicted.area : whole_);
}

void FrangiStage::describe(StageReport& report) const noexcept {
  report.state = !seen_any_ ? StageState::kStarting
                            : (newest_rejection_ == ImageRejection::kNone ? StageState::kRunning
                                                                          : StageState::kDegraded);
  const bool has_words = newest_rejection_ == ImageRejection::kWrongGeometry;
  if (newest_rejection_ == ImageRejection::kNone && image_half_.meter.reads_otherwise()) {
    std::snprintf(report.why.data(), report.why.size(),
                  "tubes are bright on its images: found from where the coils have the tube");
  } else if (newest_rejection_ == ImageRejection::kNone && image_half_.door.averaging().any()) {
    std::snprintf(
        report.why.data(), report.why.size(),
        "its images are averaged over time, %.0f %% of each are of those before%s",
        100 * image_half_.door.averaging().of_before(),
        image_half_.door.averaging_gives_way() ? ", less where something moves: undone" : ": undone");
  } else {
    std::snprintf(report.why.data(), report.why.size(), "%s%s%s", words_of(newest_rejection_),
                  has_words ? ": " : "", has_words ? image_half_.door.geometry_fault() : "");
  }
  report.outputs = outputs_;
  report.dropped = superseded_;
  report.refused = refused_;
}

}  // namespace tubed
