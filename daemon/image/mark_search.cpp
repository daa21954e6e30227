#include "daemon/image/mark_search.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tubed {

namespace {

constexpr double kMinSideLengths = 0.5;  // of a band, that it is compared with to either side
constexpr double kMaxSide = 1.5;
constexpr float kNoResponse = 1.5F;    // standard deviations of the noise that say nothing,
constexpr float kFullResponse = 4;     // and that count as a mark, whole
constexpr double kMinMarkScore = 0.6;  // of the marks' number, that the best shift has to explain
constexpr double kMinLead = 0.6;       // of a mark, by which it has to lead every other
constexpr double kSigmaShift_mm = 4;   // of where the marks are expected: coils and arc lengths
constexpr double kSameBand = 1.0;      // band lengths within which two shifts are one
constexpr double kBeyondLast = 1.5;    // lengths behind the last mark from which on nothing may be,
constexpr double kBeyondLast_mm = 8;   // so far
constexpr float kUsualMax = 1;         // noise: the greatest of some is so much greater than one
constexpr float kMinShare = 0.05F;     // of a mark's response, that the noise is taken for at least
constexpr float kMinNoise = 1e-6F;
constexpr double kMinSigma_mm = 0.15;

/// How much of a mark a response is, in standard deviations of the noise: -1 .. 1.
double share_of(float response) {
  const float beyond = std::max(std::abs(response) - kNoResponse, 0.0F) / (kFullResponse - kNoResponse);
  return static_cast<double>(std::copysign(std::min(beyond, 1.0F), response));
}

int steps_of(double mm) { return std::max(1, static_cast<int>(std::lround(mm / MarkSearch::kStep_mm))); }

}  // namespace

MarkSearch::MarkSearch(std::vector<double> marks_mm, double length_mm)
    : marks_mm_(std::move(marks_mm)), length_mm_(length_mm) {
  if (!can_find()) {
    return;
  }
  double gap_mm = kMaxSide * length_mm_;
  for (std::size_t i = 1; i < marks_mm_.size(); ++i) {
    gap_mm = std::min(gap_mm, marks_mm_[i] - marks_mm_[i - 1] - length_mm_);
  }
  side_mm_ = std::max(gap_mm, kMinSideLengths * length_mm_);
  const double around_mm = kReach_mm + length_mm_ / 2 + side_mm_ + kStep_mm;
  from_mm_ = marks_mm_.front() - around_mm;
  until_mm_ = marks_mm_.back() + around_mm + kShaft_mm;
  responses_.resize(static_cast<std::size_t>(steps_of(until_mm_ - from_mm_)) + 1);
  sorted_.resize(responses_.size());
  scores_.resize(2 * static_cast<std::size_t>(steps_of(kReach_mm)) + 1);
}

int MarkSearch::index_of(double s_mm) const {
  return static_cast<int>(std::lround((s_mm - from_mm_) / kStep_mm));
}

/// Mean over a band less the mean over both of its sides: a slope, or a step far away, gives nothing.
void MarkSearch::respond(std::span<const float> darkness) {
  const int half = std::max(1, static_cast<int>(length_mm_ / 2 / kStep_mm));
  const int side = steps_of(side_mm_);
  const auto count = static_cast<int>(responses_.size());
  const auto mean = [&](int from, int until) {
    return std::accumulate(darkness.begin() + from, darkness.begin() + until, 0.0F) /
           static_cast<float>(until - from);
  };
  std::fill(responses_.begin(), responses_.end(), 0.0F);
  for (int i = half + side; i + half + side < count; ++i) {
    const float before = mean(i - half - side, i - half);
    const float after = mean(i + half + 1, i + half + side + 1);
    // The lower of both differences: the edge of something that is dark on one side of it is no band.
    responses_[static_cast<std::size_t>(i)] = mean(i - half, i + half + 1) - std::max(before, after);
  }
}

/// What all marks together show at that shift, none of them more than twice what the middle one does: a wire
/// that crosses the tube is no pattern.
float MarkSearch::sum_at(int shift) {
  const std::size_t count = marks_mm_.size();
  for (std::size_t i = 0; i < count; ++i) {
    sorted_[i] = responses_[static_cast<std::size_t>(index_of(marks_mm_[i]) + shift)];
  }
  const auto begin = sorted_.begin();
  const auto middle = begin + static_cast<std::ptrdiff_t>((count - 1) / 2);
  const auto end = begin + static_cast<std::ptrdiff_t>(count);
  std::nth_element(begin, middle, end);
  const float most = 2 * std::max(*middle, 0.0F);
  return std::accumulate(begin, end, 0.0F,
                         [=](float sum, float value) { return sum + std::min(value, most); });
}

/// Standard deviation of the responses along the shaft: before the marks lies the tip, whose end and
/// electrode respond.
float MarkSearch::noise() {
  const int from = index_of(marks_mm_.back() + kReach_mm + length_mm_ + side_mm_);
  const auto begin = responses_.begin() + from;
  const auto end = responses_.end() - steps_of(length_mm_ / 2 + side_mm_) - 1;
  if (end <= begin) {
    return kMinNoise;
  }
  std::transform(begin, end, sorted_.begin(), [](float value) { return std::abs(value); });
  const auto middle = sorted_.begin() + (end - begin) / 2;
  std::nth_element(sorted_.begin(), middle, sorted_.begin() + (end - begin));
  constexpr float kToSigma = 1.4826F;
  return std::max(kToSigma * *middle, kMinNoise);
}

/// How many marks are seen at that shift: each counts by how far it stands out of the noise, once at most.
/// Against it counts a band further along the shaft, where the pattern has none: shifted by the distance of
/// two marks it would have one.
double MarkSearch::score_at(int shift, float noise) const {
  double score = 0;
  for (const double mark_mm : marks_mm_) {
    score += share_of(responses_[static_cast<std::size_t>(index_of(mark_mm) + shift)] / noise);
  }
  const int last = index_of(marks_mm_.back()) + shift;
  const auto begin = responses_.begin() + last + steps_of(kBeyondLast * length_mm_);
  const float beyond = *std::max_element(begin, begin + steps_of(kBeyondLast_mm));
  return score - std::max(share_of(beyond / noise - kUsualMax), 0.0);
}

/// Centre of gravity of the summed responses around `shift`, steps.
double MarkSearch::middle_near(int shift) {
  const int around = steps_of(length_mm_ / 2);
  double weight = 0;
  double moment = 0;
  for (int off = -around; off <= around; ++off) {
    const int at = shift + off;
    if (std::abs(at) > static_cast<int>(scores_.size() / 2)) continue;
    const auto sum = static_cast<double>(std::max(sum_at(at), 0.0F));
    weight += sum;
    moment += sum * at;
  }
  return weight > 0 ? moment / weight : shift;
}

std::optional<MarkShift> MarkSearch::find(std::span<const float> darkness) {
  if (!can_find() || darkness.size() != responses_.size()) {
    return std::nullopt;
  }
  respond(darkness);
  const auto reach = static_cast<int>(scores_.size() / 2);
  int best = 0;
  float best_sum = sum_at(0);
  for (int shift = -reach; shift <= reach; ++shift) {
    const float sum = sum_at(shift);
    if (sum > best_sum) {
      best = shift;
      best_sum = sum;
    }
  }
  // However little noise there is, a twentieth of a mark is none.
  const float sigma = std::max(noise(), kMinShare * best_sum / static_cast<float>(marks_mm_.size()));
  for (int shift = -reach; shift <= reach; ++shift) {
    const double unlikely = kStep_mm * shift / kSigmaShift_mm;
    scores_[static_cast<std::size_t>(shift + reach)] = score_at(shift, sigma) - 0.5 * unlikely * unlikely;
  }
  const double best_score = scores_[static_cast<std::size_t>(best + reach)];
  if (best == -reach || best == reach || best_score < kMinMarkScore * static_cast<double>(marks_mm_.size())) {
    return std::nullopt;
  }
  const int same = steps_of(kSameBand * length_mm_);
  for (int shift = -reach; shift <= reach; ++shift) {
    if (std::abs(shift - best) > same &&
        scores_[static_cast<std::size_t>(shift + reach)] > best_score - kMinLead) {
      return std::nullopt;
    }
  }
  MarkShift found;
  found.shift_mm = kStep_mm * middle_near(best);
  const double height =
      static_cast<double>(best_sum / sigma) / std::sqrt(static_cast<double>(marks_mm_.size()));
  found.sigma_mm = std::max(kMinSigma_mm, length_mm_ / std::max(height, 1.0));
  for (const double mark_mm : marks_mm_) {
    found.seen += responses_[static_cast<std::size_t>(index_of(mark_mm) + best)] > 3 * sigma ? 1 : 0;
  }
  return found;
}

}  // namespace tubed
