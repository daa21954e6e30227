#include "daemon/image/ridge_choice.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kSigmaOfRidge_px = 1.0;  // of a ridge off the tube's middle, beside the prediction's own
// Neighbouring lines err together: the evidence of five counts as that of one, and so does the prediction of
// eight (16 mm, a knot of the spline).
constexpr double kLinesOfOneEvidence = 5;
constexpr double kLinesOfOnePrediction = 8;
constexpr double kMaxChiSquare = 16;  // 4 sigma: what is further off is as unlikely as that
constexpr double kOtherRidge_px = 2;  // nearer, two ridges are one
constexpr float kBackground = 0.05F;  // evidence of a ridge that is another tube's

/// Multiplies the evidence at offsets -reach_px .. reach_px by how likely the tube is there by the prediction
/// alone.
void multiply_prediction(const CorrespondenceLine& line, int reach_px, RidgeChoice::Row& evidence) {
  const double variance_px2 = line.expected_variance_px2 + kSigmaOfRidge_px * kSigmaOfRidge_px;
  const auto per_sigma = static_cast<float>(1 / std::sqrt(variance_px2));
  const auto first = static_cast<float>(-reach_px - line.expected_px) * per_sigma;
  Eigen::Map<Eigen::ArrayXf> used(evidence.data(), 2 * reach_px + 1);
  const auto steps =
      Eigen::ArrayXf::LinSpaced(used.size(), first, first + static_cast<float>(2 * reach_px) * per_sigma);
  const auto factor = static_cast<float>(-0.5 * kLinesOfOneEvidence / kLinesOfOnePrediction);
  used *= (factor * steps.square().min(static_cast<float>(kMaxChiSquare))).exp();
}

}  // namespace

bool RidgeChoice::prefer(std::span<const CorrespondenceLine> lines, int reach_px, std::span<Row> evidence) {
  const auto is_predicted = [](const CorrespondenceLine& line) {
    return line.in_view && line.expected_variance_px2 > 0;
  };
  if (std::none_of(lines.begin(), lines.end(), is_predicted)) {
    return false;
  }
  for (std::size_t i = 0; i < lines.size(); ++i) {
    found_[i] = {lines[i].offset_px, lines[i].variance_px2};
    alone_[i] = evidence[i];
    if (is_predicted(lines[i])) multiply_prediction(lines[i], reach_px, evidence[i]);
  }
  return true;
}

bool RidgeChoice::settle(std::span<CorrespondenceLine> lines, int reach_px, std::span<Row> evidence) const {
  bool has_others = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double own_px = lines[i].offset_px;
    const double others_px = found_[i].offset_px;
    lines[i].offset_px = others_px;
    lines[i].variance_px2 = found_[i].variance_px2;
    evidence[i] = alone_[i];
    const double state = std::round(own_px) + reach_px;
    const bool is_ridge = lines[i].in_view && state >= 0 && state <= 2 * reach_px &&
                          alone_[i][static_cast<std::size_t>(state)] > 1;
    if (!is_ridge || !(std::abs(own_px - others_px) > kOtherRidge_px)) {
      continue;
    }
    has_others = true;
    const double between_px = (own_px + others_px) / 2;
    for (int k = -reach_px; k <= reach_px; ++k) {
      float& here = evidence[i][static_cast<std::size_t>(k + reach_px)];
      if ((k - between_px) * (others_px - own_px) > 0) here = std::min(here, kBackground);
    }
  }
  return has_others;
}

}  // namespace tubed
