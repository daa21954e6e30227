#include "clients/tubectl/check/live_findings.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "clients/evaluation/agreement_parts.hpp"
#include "clients/tubectl/watch/published_agreement.hpp"
#include "daemon/estimator/agreement/agreement_words.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

constexpr double kMostlyLost = 0.4;  // share of the seconds
constexpr double kSeldom = 0.1;      // share of the seconds without a shape that needs no word

SequenceMeasurement measurement_of(const tubed_EmSamples& samples) {
  SequenceMeasurement measurement;
  measurement.t_s = static_cast<double>(samples.measured_monotonic_ns) * 1e-9;
  measurement.em_frame = samples.tracker_frame;
  const std::size_t count = std::min<std::size_t>(samples.coil_count, std::size(samples.coils));
  measurement.coil_count = static_cast<int>(count);
  for (std::size_t i = 0; i < count; ++i) {
    CoilSample& coil = measurement.coils[i];
    if (samples.coils[i].status == static_cast<std::uint32_t>(CoilStatus::kOk)) {
      coil.status = CoilStatus::kOk;
      coil.p_em_mm = Eigen::Map<const Eigen::Vector3d>(samples.coils[i].p_em_mm);
      coil.tangent_em = Eigen::Map<const Eigen::Vector3d>(samples.coils[i].tangent_em);
    }
  }
  return measurement;
}

}  // namespace

void LiveFindings::take(const tubed_EmSamples& samples) {
  if (measurements_.size() < kMaxMeasurements) {
    measurements_.push_back(measurement_of(samples));
    return;
  }
  measurements_[next_measurement_] = measurement_of(samples);
  next_measurement_ = (next_measurement_ + 1) % kMaxMeasurements;
}

void LiveFindings::take(const tubed_TubeHealth& health) {
  health_ = health;
  ++seconds_;
  const Reasons reasons(status_ ? status_->reasons : 0);
  const bool has_image = status_ && !reasons.has(Reason::kImageOff) && !reasons.has(Reason::kImageStale) &&
                         !reasons.has(Reason::kImageRejected);
  without_image_ += has_image ? 0 : 1;
  lost_ += has_image && reasons.has(Reason::kImageLostTube) ? 1 : 0;
  moved_ += reasons.has(Reason::kGeometryChanged) ? 1 : 0;
  rivalled_ += reasons.has(Reason::kRivalWriter) ? 1 : 0;
  const auto validity = static_cast<Validity>(status_ ? status_->validity : 0);
  const bool has_shape = validity == Validity::kValid || validity == Validity::kQuestionable;
  without_shape_ += has_shape ? 0 : 1;
  if (!has_shape) why_none_ = names_of(reasons);
}

void LiveFindings::add_coils(std::vector<RecordingFinding>& findings) const {
  if (!identity_) {
    const std::string nobody = "the daemon has not said where its coils are";
    findings.push_back({"coil directions", RecordingFinding::Verdict::kNotJudged, nobody, ""});
    return;
  }
  Sequence sequence;
  sequence.room.instruments.push_back(instrument_of(&*identity_));
  sequence.measurements = measurements_;
  findings.push_back(check_coil_directions(sequence));
  findings.push_back(check_coil_distances(sequence));
}

RecordingFinding LiveFindings::shapes() const {
  RecordingFinding finding{
      "shapes", RecordingFinding::Verdict::kFine,
      fmt::format("VALID or QUESTIONABLE in {} of {} s", seconds_ - without_shape_, seconds_), ""};
  if (rivalled_ > 0) {
    finding.verdict = RecordingFinding::Verdict::kWrong;
    finding.evidence += fmt::format(", RIVAL_WRITER in {} s", rivalled_);
    finding.advice = "somebody else publishes this instrument too: `tubectl doctor` says who";
  } else if (share(without_shape_) > kSeldom) {
    finding.verdict = RecordingFinding::Verdict::kWrong;
    finding.evidence += ", otherwise " + why_none_;
    finding.advice = "`tubectl top` says which stage is at fault, and why";
  }
  return finding;
}

RecordingFinding LiveFindings::tube_in_images() const {
  RecordingFinding finding{"tube in images", RecordingFinding::Verdict::kNotJudged, "", ""};
  if (identity_ && identity_->camera_count == 0) {
    finding.evidence = "no camera is configured";
    return finding;
  }
  if (!has_images()) {
    finding.evidence = fmt::format("no new image in {} of {} s", without_image_, seconds_);
    finding.advice = "fluoroscopy on, the catheter in view and moving, and check again";
    return finding;
  }
  finding.verdict =
      share(lost_) > kMostlyLost ? RecordingFinding::Verdict::kWrong : RecordingFinding::Verdict::kFine;
  finding.evidence =
      fmt::format("images did not show it where the coils have it in {} of {} s", lost_, seconds_);
  if (finding.verdict == RecordingFinding::Verdict::kWrong) {
    finding.advice =
        "unless something below explains it: polarity and mirrored of the images, the registration "
        "(T_world_em), the camera's pose; a recording's check tries them";
  }
  return finding;
}

void LiveFindings::add_agreement(std::vector<RecordingFinding>& findings) const {
  const EmImageAgreement agreement = health_ ? agreement_of(health_->agreement) : EmImageAgreement{};
  if (agreement.probability <= 0) {
    const bool compares = !identity_ || std::string_view(identity_->mode) == "filter";
    findings.push_back({"coils and images", RecordingFinding::Verdict::kNotJudged,
                        compares ? "no image has shown the tube where the coils have it yet"
                                 : fmt::format("estimator mode {} does not compare them", identity_->mode),
                        compares ? "" : "[estimator] mode = \"filter\" does"});
    return;
  }
  const std::vector<CameraCalibration> cameras = cameras_of(identity_ ? &*identity_ : nullptr);
  if (agreement.explanation == Discord::kNegative || agreement.explanation == Discord::kMirrored) {
    const bool is_negative = agreement.explanation == Discord::kNegative;
    findings.push_back({is_negative ? "polarity" : "mirrored images", RecordingFinding::Verdict::kWrong,
                        fmt::format("{:.0f} % of the tube's lines agree with images that are read so",
                                    100 * static_cast<double>(agreement.probability)),
                        explanation_of(agreement, InstrumentDescription{}, cameras)});
  }
  for (const AgreementPart& part : parts_of(agreement)) {
    if (agreement.disagree && part.is_named_by(agreement.explanation)) {
      findings.push_back({part.what, RecordingFinding::Verdict::kWrong,
                          agreement.explanation == Discord::kArcLengths
                              ? part.evidence  // the end is seen, however likely
                              : fmt::format("explains best how coils and images disagree, {:.0f} %",
                                            100 * static_cast<double>(agreement.probability)),
                          explanation_of(agreement, InstrumentDescription{}, cameras)});
    } else if (agreement.disagree) {
      findings.push_back({part.what, RecordingFinding::Verdict::kNotJudged, "what is WRONG hides it", ""});
    } else if (!has_images()) {
      findings.push_back({part.what, RecordingFinding::Verdict::kNotJudged, "no new image", ""});
    } else {
      findings.push_back({part.what, RecordingFinding::Verdict::kFine, part.evidence, ""});
    }
  }
}

RecordingFinding LiveFindings::view() const {
  if (moved_ == 0 && !has_images()) {
    return {"view", RecordingFinding::Verdict::kNotJudged, "no new image", ""};
  }
  return {
      "view", moved_ > 0 ? RecordingFinding::Verdict::kWrong : RecordingFinding::Verdict::kFine,
      fmt::format("it had moved, or may have, in {} of {} s", moved_, seconds_),
      moved_ > 0 ? "send the pose with each image, or put the C-arm and the table back: `tubectl top`" : ""};
}

std::vector<RecordingFinding> LiveFindings::findings() const {
  std::vector<RecordingFinding> findings;
  findings.push_back(shapes());
  add_coils(findings);
  findings.push_back(tube_in_images());
  add_agreement(findings);
  findings.push_back(view());
  return findings;
}

}  // namespace tubed
