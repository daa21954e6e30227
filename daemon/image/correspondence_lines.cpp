#include "daemon/image/correspondence_lines.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "daemon/image/chain_steps.hpp"
#include "daemon/image/line_samples.hpp"
#include "daemon/image/sample_vesselness.hpp"

namespace tubed {

namespace {

constexpr int kTransitionReach = 4;      // px; changes beyond are not considered
constexpr float kEvidenceSlope = 6.0F;   // log-odds gained from no ridge to a full one
constexpr float kRidgeNoiseShare = 30;   // of (ridge of noise / usual height)^2 by which that is less
constexpr float kProfileShare = 0.6F;    // of the evidence; the rest is the ridge's
constexpr float kEvidenceLimit = 3.0F;   // no single line may say more than this
constexpr double kFlank_px = 3.0;        // beyond the tube's side, where its background is looked at
constexpr float kMinOfOtherSide = 0.1F;  // of the brighter side's contrast
constexpr float kStrongEdge = 1.5F;      // times how much the tube usually stands out
constexpr int kMinEdgesBeside = 2;       // of the four next lines
constexpr float kAgreement = 0.4F;       // share of the usual ridge height that counts as seeing the tube

/// Of a line that knows nothing.
double anywhere_px2(int reach_px) { return reach_px * reach_px / 3.0; }

/// Differences in grey of both sides from what a line found: equal signs where it stands out. Over three
/// pixels each.
struct Sides {
  float smaller = 0;  ///< 0 when the signs differ
  float greater = 0;
};

Sides sides_of(const ImageMeasurement& image, const CorrespondenceLine& line) {
  const auto mean_at = [&](double offset_px) {
    std::array<float, 3> greys{};
    sample_line(image, image.grey,
                {line.base_px + (line.offset_px + offset_px - 1) * line.normal, line.normal},
                BeyondEdge::kNothing, greys);
    return (greys[0] + greys[1] + greys[2]) / 3;
  };
  const double away_px = line.half_width_px + kFlank_px;
  const float centre = mean_at(0);
  const float left = mean_at(-away_px) - centre;
  const float right = mean_at(away_px) - centre;
  return {left * right > 0 ? std::min(std::abs(left), std::abs(right)) : 0,
          std::max(std::abs(left), std::abs(right))};
}

/// Lines on an edge speak neither for the tube nor against it, while they are the fewer.
void count_agreeing(const std::array<CorrespondenceLine, LineSearch::kMaxLines>& lines,
                    const std::array<bool, LineSearch::kMaxLines>& doubted, int count,
                    LineSearch::Outcome& outcome) {
  int agreeing = 0;
  int asked = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    outcome.in_view += lines[i].in_view ? 1 : 0;
    asked += lines[i].in_view && !doubted[i] ? 1 : 0;
    agreeing += lines[i].agrees ? 1 : 0;
  }
  const double all = std::max<double>(asked, outcome.in_view / 2.0);
  outcome.inlier_ratio = outcome.in_view > 0 ? agreeing / all : 0;
}

/// Mean of log(P_f / P_b) across the tube where the line found it, as far as the line reaches.
float mean_log_odds(const ImageMeasurement& image, const AppearanceModel& model,
                    const CorrespondenceLine& line, int reach_px) {
  const int half = std::max(0, static_cast<int>(std::lround(line.half_width_px)));
  float sum = 0;
  int count = 0;
  for (int k = -half; k <= half; ++k) {
    const double place_px = line.offset_px + k;
    if (std::abs(place_px) > reach_px) continue;
    const Eigen::Vector2d p = line.base_px + place_px * line.normal;
    sum += model.log_odds(sample_map(image, image.grey, p), sample_map(image, image.vesselness, p));
    ++count;
  }
  return sum / static_cast<float>(std::max(count, 1));
}

}  // namespace

void LineSearch::sample(const ImageMeasurement& image, const std::array<CorrespondenceLine, kMaxLines>& lines,
                        int count, int reach_px) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const CorrespondenceLine& line = lines[i];
    const auto row = std::span(vesselness_[i]).first(static_cast<std::size_t>(2 * reach_px + 1));
    if (line.in_view) {
      sample_line(image, image.vesselness, {line.base_px - reach_px * line.normal, line.normal},
                  BeyondEdge::kNothing, row);
    } else {
      std::ranges::fill(row, 0.0F);
    }
  }
}

// The usual height of the tube's ridge: the median over the lines of each one's maximum.
float LineSearch::ridge_height(const std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                               int states) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (lines[i].in_view) {
      peaks_[seen++] = *std::max_element(vesselness_[i].begin(), vesselness_[i].begin() + states);
    }
  }
  if (seen == 0) {
    return 0;
  }
  const auto middle = peaks_.begin() + static_cast<std::ptrdiff_t>(seen / 2);
  std::nth_element(peaks_.begin(), middle, peaks_.begin() + static_cast<std::ptrdiff_t>(seen));
  return *middle;
}

// A ridge as high as those of noise around it says little, one in a clean stretch all that a ridge can say.
void LineSearch::to_evidence(const std::array<CorrespondenceLine, kMaxLines>& lines, int count, int states,
                             float height, Among among) {
  const bool weighs_noise = is_thorough_ && among == Among::kNoise;
  const auto searched = std::span(lines).first(static_cast<std::size_t>(count));
  if (weighs_noise) noise_.measure(searched, vesselness_, states);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    Eigen::Map<Eigen::ArrayXf> evidence(evidence_[i].data(), states);
    if (!lines[i].in_view || !(height > 0)) {
      evidence.setOnes();
      continue;
    }
    const bool has_profile = is_thorough_ && profiles_.knows(i);
    const float noise = weighs_noise ? noise_.at(searched, i) / height : 0;
    // What is no number weighs nothing.
    const float slope = noise > 0 ? kEvidenceSlope / (1 + kRidgeNoiseShare * noise * noise) : kEvidenceSlope;
    for (std::size_t k = 0; k < static_cast<std::size_t>(states); ++k) {
      const float ridge = slope * (vesselness_[i][k] / height - 0.5F);
      const float odds = has_profile ? ridge + kProfileShare * (profiles_.log_odds(i, k) - ridge) : ridge;
      evidence_[i][k] = std::clamp(odds, -kEvidenceLimit, kEvidenceLimit);
    }
    evidence = evidence.exp();
  }
}

void LineSearch::run_chain(int count, int states, double transition_px) {
  std::array<float, kTransitionReach + 1> kernel{};
  for (int d = 0; d <= kTransitionReach; ++d) {
    kernel[static_cast<std::size_t>(d)] =
        static_cast<float>(std::exp(-0.5 * d * d / (transition_px * transition_px)));
  }
  const auto last = static_cast<std::size_t>(count - 1);
  Row carried{};
  forward_[0] = evidence_[0];
  normalise(forward_[0], states);
  for (std::size_t i = 1; i <= last; ++i) {
    convolve(forward_[i - 1], kernel, states, carried);
    for (std::size_t k = 0; k < static_cast<std::size_t>(states); ++k) {
      forward_[i][k] = carried[k] * evidence_[i][k];
    }
    normalise(forward_[i], states);
  }
  backward_[last].fill(1.0F);
  for (std::size_t i = last; i > 0; --i) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(states); ++k) {
      carried[k] = backward_[i][k] * evidence_[i][k];
    }
    convolve(carried, kernel, states, backward_[i - 1]);
    normalise(backward_[i - 1], states);
  }
}

// From the evidence.
void LineSearch::find(std::array<CorrespondenceLine, kMaxLines>& lines, int count, int reach_px,
                      double transition_px) {
  const int states = 2 * reach_px + 1;
  run_chain(count, states, transition_px);
  find_moments(lines, count, reach_px);
  if (!is_thorough_) {
    return;
  }
  const auto searched = std::span(lines).first(static_cast<std::size_t>(count));
  const auto evidence = std::span(evidence_).first(static_cast<std::size_t>(count));
  if (choice_.prefer(searched, reach_px, evidence)) {
    run_chain(count, states, transition_px);
    find_moments(lines, count, reach_px);
    if (choice_.settle(searched, reach_px, evidence)) {
      run_chain(count, states, transition_px);
      find_moments(lines, count, reach_px);
    }
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const double state = lines[i].offset_px + reach_px;
    const bool is_one = state >= 0 && state <= states - 1;  // what is no number is none
    on_ridge_[i] = is_one && evidence_[i][static_cast<std::size_t>(std::lround(state))] > 1;
  }
  if (!claims_.find(searched, on_ridge_)) {
    return;
  }
  look_beside(count, reach_px);
  if (claims_.settle(searched, sees_another_)) {
    leave_to_others(count, reach_px);
    run_chain(count, states, transition_px);
    find_moments(lines, count, reach_px);
  }
}

void LineSearch::look_beside(int count, int reach_px) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const RidgeClaims::Claim& claim = claims_.claims()[i];
    sees_another_[i] = false;
    for (int k = -reach_px; claim.rival >= 0 && k <= reach_px; ++k) {
      sees_another_[i] = sees_another_[i] ||
                         (claim.is_beyond(k) && evidence_[i][static_cast<std::size_t>(k + reach_px)] > 1);
    }
  }
}

// All but the line's own side is background to it.
void LineSearch::leave_to_others(int count, int reach_px) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const RidgeClaims::Claim& claim = claims_.claims()[i];
    if (claim.verdict != RidgeClaims::Verdict::kOthers) continue;
    for (int k = -reach_px; k <= reach_px; ++k) {
      if (!claim.is_beyond(k)) {
        evidence_[i][static_cast<std::size_t>(k + reach_px)] = std::exp(-kEvidenceLimit);
      }
    }
  }
}

// A line that keeps a ridge which may belong to another tube may be wrong by as much as that ridge pulled it;
// a line that had to leave its ridge and found no other has no measurement.
void LineSearch::doubt_claims(std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                              int reach_px) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    CorrespondenceLine& line = lines[i];
    const RidgeClaims::Claim& claim = claims_.claims()[i];
    if (claim.verdict == RidgeClaims::Verdict::kUnsure) {
      line.variance_px2 = std::max(line.variance_px2, line.offset_px * line.offset_px);
    } else if (claim.verdict == RidgeClaims::Verdict::kOthers && !claim.is_beyond(line.offset_px)) {
      line.variance_px2 = std::max(line.variance_px2, anywhere_px2(reach_px));
    }
  }
}

void LineSearch::to_evidence(const ImageMeasurement& image, const AppearanceModel& model,
                             const std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                             int reach_px) {
  std::array<float, kMaxStates> odds{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const CorrespondenceLine& line = lines[i];
    evidence_[i].fill(1.0F);
    if (!line.in_view) continue;
    const int half = std::max(0, static_cast<int>(std::lround(line.half_width_px)));
    for (int k = -reach_px; k <= reach_px; ++k) {
      const Eigen::Vector2d p = line.base_px + k * line.normal;
      odds[static_cast<std::size_t>(k + reach_px)] =
          model.log_odds(sample_map(image, image.grey, p), sample_map(image, image.vesselness, p));
    }
    for (int k = 0; k <= 2 * reach_px; ++k) {
      const int from = std::max(0, k - half);
      const int to = std::min(2 * reach_px, k + half);
      float sum = 0;
      for (int j = from; j <= to; ++j) sum += odds[static_cast<std::size_t>(j)];
      const float mean = sum / static_cast<float>(to - from + 1);
      evidence_[i][static_cast<std::size_t>(k)] = std::exp(std::clamp(mean, -kEvidenceLimit, kEvidenceLimit));
    }
  }
}

void LineSearch::find_moments(std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                              int reach_px) const {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    CorrespondenceLine& line = lines[i];
    double sum = 0;
    double first_moment = 0;
    double second_moment = 0;
    for (int k = 0; k <= 2 * reach_px; ++k) {
      const double p = static_cast<double>(forward_[i][static_cast<std::size_t>(k)]) *
                       static_cast<double>(backward_[i][static_cast<std::size_t>(k)]);
      const double offset = k - reach_px;
      sum += p;
      first_moment += p * offset;
      second_moment += p * offset * offset;
    }
    line.offset_px = first_moment / std::max(sum, 1e-300);
    line.variance_px2 =
        std::max(0.0, second_moment / std::max(sum, 1e-300) - line.offset_px * line.offset_px);
  }
}

// A round thing in front of an even background differs from both sides alike. The edge of a blade or of a
// lung has one side only, and a ridge filter answers to it all the same. Lines on an edge that is stronger
// than the tube know nothing of where the tube is, nor does one among such lines.
void LineSearch::doubt_edges(const ImageMeasurement& image, std::array<CorrespondenceLine, kMaxLines>& lines,
                             int count, int reach_px) {
  std::array<Sides, kMaxLines> sides;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    if (lines[i].in_view && lines[i].half_width_px > 0) {
      sides[i] = sides_of(image, lines[i]);
      peaks_[seen++] = sides[i].smaller;
    }
  }
  if (seen == 0) {
    on_edge_.fill(false);
    return;
  }
  const auto middle = peaks_.begin() + static_cast<std::ptrdiff_t>(seen / 2);
  std::nth_element(peaks_.begin(), middle, peaks_.begin() + static_cast<std::ptrdiff_t>(seen));
  const float usual = *middle;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    on_edge_[i] = lines[i].in_view && sides[i].greater > kStrongEdge * usual &&
                  sides[i].smaller < kMinOfOtherSide * sides[i].greater;
  }
  for (int i = 0; i < count; ++i) {
    int beside = 0;
    for (const int k : {-2, -1, 1, 2}) {
      const int neighbour = i + k;
      beside += neighbour >= 0 && neighbour < count && on_edge_[static_cast<std::size_t>(neighbour)] ? 1 : 0;
    }
    if (on_edge_[static_cast<std::size_t>(i)] || beside >= kMinEdgesBeside) {
      CorrespondenceLine& line = lines[static_cast<std::size_t>(i)];
      line.agrees = false;
      line.variance_px2 = std::max(line.variance_px2, anywhere_px2(reach_px));
    }
  }
}

LineSearch::Outcome LineSearch::search(const ImageMeasurement& image,
                                       std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                                       int reach_px, double transition_px, Among among) {
  Outcome outcome;
  if (count == 0) {
    return outcome;
  }
  const int states = 2 * reach_px + 1;
  sample(image, lines, count, reach_px);
  const float height = ridge_height(lines, count, states);
  outcome.ridge_height = height;
  if (is_thorough_) {
    profiles_.measure(image, std::span(lines).first(static_cast<std::size_t>(count)), reach_px);
  }
  to_evidence(lines, count, states, height, among);
  find(lines, count, reach_px, transition_px);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    CorrespondenceLine& line = lines[i];
    const Eigen::Vector2d found = line.base_px + line.offset_px * line.normal;
    line.agrees = line.in_view && height > 0 && sample_vesselness(image, found) > kAgreement * height;
  }
  doubt_claims(lines, count, reach_px);
  doubt_edges(image, lines, count, reach_px);
  count_agreeing(lines, on_edge_, count, outcome);
  return outcome;
}

LineSearch::Outcome LineSearch::search(const ImageMeasurement& image, const AppearanceModel& model,
                                       std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                                       int reach_px, double transition_px) {
  if (count == 0) {
    return {};
  }
  to_evidence(image, model, lines, count, reach_px);
  find(lines, count, reach_px, transition_px);
  const Outcome outcome = judge(image, model, lines, count, reach_px);
  doubt_claims(lines, count, reach_px);
  return outcome;
}

LineSearch::Outcome LineSearch::judge(const ImageMeasurement& image, const AppearanceModel& model,
                                      std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                                      int reach_px) {
  Outcome outcome;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    CorrespondenceLine& line = lines[i];
    line.agrees = line.in_view && mean_log_odds(image, model, line, reach_px) > 0;
    if (line.in_view) {
      peaks_[seen++] = sample_vesselness(image, line.base_px + line.offset_px * line.normal);
    }
  }
  doubt_edges(image, lines, count, reach_px);
  count_agreeing(lines, on_edge_, count, outcome);
  if (seen > 0) {
    const auto middle = peaks_.begin() + static_cast<std::ptrdiff_t>(seen / 2);
    std::nth_element(peaks_.begin(), middle, peaks_.begin() + static_cast<std::ptrdiff_t>(seen));
    outcome.ridge_height = *middle;
  }
  return outcome;
}

}  // namespace tubed
