#include "daemon/image/correspondence_lines.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/image/sample_vesselness.hpp"

namespace tubed {

namespace {

constexpr int kTransitionReach = 4;     // px; changes beyond are not considered
constexpr float kEvidenceSlope = 6.0F;  // log-odds gained from no ridge to a full one
constexpr float kEvidenceLimit = 3.0F;  // no single line may say more than this
constexpr float kAgreement = 0.4F;      // share of the usual ridge height that counts as seeing the tube

template <typename Row>
void normalise(Row& row, int states) {
  float sum = 0;
  for (int k = 0; k < states; ++k) {
    sum += row[static_cast<std::size_t>(k)];
  }
  const float scale = 1.0F / std::max(sum, 1e-30F);
  for (int k = 0; k < states; ++k) {
    row[static_cast<std::size_t>(k)] *= scale;
  }
}

template <typename Row, typename Kernel>
void convolve(const Row& from, const Kernel& kernel, int states, Row& to) {
  for (int k = 0; k < states; ++k) {
    float sum = 0;
    for (int j = std::max(0, k - kTransitionReach); j <= std::min(states - 1, k + kTransitionReach); ++j) {
      sum += from[static_cast<std::size_t>(j)] * kernel[static_cast<std::size_t>(std::abs(j - k))];
    }
    to[static_cast<std::size_t>(k)] = sum;
  }
}

}  // namespace

void LineSearch::sample(const ImageMeasurement& image, const std::array<CorrespondenceLine, kMaxLines>& lines,
                        int count, int reach_px) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const CorrespondenceLine& line = lines[i];
    for (int k = -reach_px; k <= reach_px; ++k) {
      const Eigen::Vector2d p = line.base_px + k * line.normal;
      vesselness_[i][static_cast<std::size_t>(k + reach_px)] =
          line.in_view ? sample_vesselness(image, p) : 0.0F;
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

void LineSearch::to_evidence(const std::array<CorrespondenceLine, kMaxLines>& lines, int count, int states,
                             float height) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    for (std::size_t k = 0; k < static_cast<std::size_t>(states); ++k) {
      const float odds = kEvidenceSlope * (vesselness_[i][k] / std::max(height, 1e-6F) - 0.5F);
      evidence_[i][k] =
          lines[i].in_view && height > 0 ? std::exp(std::clamp(odds, -kEvidenceLimit, kEvidenceLimit)) : 1.0F;
    }
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

LineSearch::Outcome LineSearch::search(const ImageMeasurement& image,
                                       std::array<CorrespondenceLine, kMaxLines>& lines, int count,
                                       int reach_px, double transition_px) {
  Outcome outcome;
  if (count == 0) {
    return outcome;
  }
  const int states = 2 * reach_px + 1;
  sample(image, lines, count, reach_px);
  const float height = ridge_height(lines, count, states);
  outcome.ridge_height = height;
  to_evidence(lines, count, states, height);
  run_chain(count, states, transition_px);
  int agreeing = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    CorrespondenceLine& line = lines[i];
    double sum = 0;
    double first_moment = 0;
    double second_moment = 0;
    for (int k = 0; k < states; ++k) {
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
    const Eigen::Vector2d found = line.base_px + line.offset_px * line.normal;
    line.agrees = line.in_view && height > 0 && sample_vesselness(image, found) > kAgreement * height;
    outcome.in_view += line.in_view ? 1 : 0;
    agreeing += line.agrees ? 1 : 0;
  }
  outcome.inlier_ratio = outcome.in_view > 0 ? static_cast<double>(agreeing) / outcome.in_view : 0;
  return outcome;
}

}  // namespace tubed
