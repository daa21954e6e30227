#include "clients/evaluation/agreement_parts.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "clients/evaluation/recording_check.hpp"
#include "daemon/estimator/agreement/agreement_words.hpp"
#include "daemon/estimator/images/tube_views.hpp"
#include "idl/geometry/degree.hpp"

namespace tubed {

namespace {

/// Of one number of each agreement; 0 of none.
template <typename Number>
float median_of(const std::vector<EmImageAgreement>& agreements, const Number& number) {
  std::vector<float> numbers;
  numbers.reserve(agreements.size());
  for (const EmImageAgreement& agreement : agreements) numbers.push_back(number(agreement));
  if (numbers.empty()) return 0;
  const auto middle = numbers.begin() + static_cast<std::ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

}  // namespace

bool AgreementPart::is_named_by(Discord explanation) const {
  return std::find(named.begin(), named.end(), explanation) != named.end();
}

std::vector<AgreementPart> parts_of(const EmImageAgreement& agreement) {
  using enum Discord;
  const auto mm = [](float value) { return static_cast<double>(value); };
  return {{"registration",
           {kRegistration},
           fmt::format("seen {:.1f} mm and {:.1f} degrees off, may be {:.1f} and {:.1f}",
                       length_of(agreement.shift_mm), length_of(agreement.turn_rad) / kDegree,
                       mm(agreement.unsure_mm), mm(agreement.unsure_rad) / kDegree)},
          {"arc lengths",
           {kArcLengths, kCoilArcLength},
           fmt::format("seen {:+.1f} mm off, the tube ends {:+.1f} mm from where they say",
                       mm(agreement.arc_length_mm), mm(agreement.end_mm))},
          {"clock", {kClock}, fmt::format("images are stamped {:+.0f} ms late", 1e3 * mm(agreement.clock_s))},
          {"focal length",
           {kMagnification},
           fmt::format("seen {:+.1f} % too large", 100 * mm(agreement.magnification))},
          {"coils and field", {kField, kCoil}, "each coil lies where the others and the images have it"}};
}

void RecordedAgreement::add(const TubeEstimate& estimate) {
  for (std::size_t i = 0; i < estimate.view_count; ++i) {
    // Of T_camera_world, row by row: the camera's axis in the world.
    const Eigen::Vector3d sight =
        Eigen::Map<const Eigen::Vector3d>(estimate.views[i].T_camera_world.data() + 8);
    if (!first_sight_world_) first_sight_world_ = sight;
    two_sides_ = two_sides_ || are_two_sides(*first_sight_world_, sight);
  }
  if (estimate.agreement.probability <= 0) {
    return;
  }
  compared_.push_back(estimate.agreement);
  if (estimate.agreement.disagree) ++named_[estimate.agreement.explanation];
}

EmImageAgreement RecordedAgreement::medians() const {
  using Agreement = EmImageAgreement;
  const auto median = [this](const auto& number) { return median_of(compared_, number); };
  EmImageAgreement medians;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    medians.shift_mm[axis] = median([axis](const Agreement& a) { return a.shift_mm[axis]; });
    medians.turn_rad[axis] = median([axis](const Agreement& a) { return a.turn_rad[axis]; });
  }
  medians.unsure_mm = median([](const Agreement& a) { return a.unsure_mm; });
  medians.unsure_rad = median([](const Agreement& a) { return a.unsure_rad; });
  medians.arc_length_mm = median([](const Agreement& a) { return a.arc_length_mm; });
  medians.end_mm = median([](const Agreement& a) { return a.end_mm; });
  medians.clock_s = median([](const Agreement& a) { return a.clock_s; });
  medians.magnification = median([](const Agreement& a) { return a.magnification; });
  return medians;
}

double RecordedAgreement::share_named(const AgreementPart& part) const {
  int times = 0;
  for (const auto& [explanation, count] : named_) {
    times += part.is_named_by(explanation) ? count : 0;
  }
  return compared_.empty() ? 0 : static_cast<double>(times) / static_cast<double>(compared_.size());
}

std::vector<RecordingFinding> RecordedAgreement::findings(double seldom) const {
  using Verdict = RecordingFinding::Verdict;
  std::vector<RecordingFinding> findings;
  if (compared_.empty()) {
    return findings;
  }
  const std::vector<AgreementPart> parts = parts_of(medians());
  double most =
      seldom;  // named oftener than this, of which only one is called WRONG: it makes others be named
  for (const AgreementPart& part : parts) most = std::max(most, share_named(part));
  for (const AgreementPart& part : parts) {
    const double share = share_named(part);
    RecordingFinding finding{part.what, Verdict::kFine, part.evidence, ""};
    if (share > seldom && share == most) {
      finding.verdict = Verdict::kWrong;
      finding.evidence = fmt::format(
          "explains best how coils and images disagree, in {:.0f} % of the instants", 100 * share);
    } else if (share > seldom) {
      finding.verdict = Verdict::kNotJudged;
      finding.evidence =
          fmt::format("named in {:.0f} % of the instants, but what is WRONG comes first", 100 * share);
    } else if (most > seldom) {
      finding.verdict = Verdict::kNotJudged;
      finding.evidence = "what is WRONG hides it";
    } else if (part.is_named_by(Discord::kRegistration) && !two_sides_) {
      finding.advice =
          "seen from one direction: along its rays nothing shows. Record with the C-arm swung by 10 degrees "
          "or more";
    }
    findings.push_back(finding);
  }
  return findings;
}

}  // namespace tubed
