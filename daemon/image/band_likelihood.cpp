#include "daemon/image/band_likelihood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tubed {

namespace {

/// Numerator of Eq. (16).
double numerator(double foreground, double background, double h) {
  return foreground * h + background * (1 - h);
}

}  // namespace

double smooth_heaviside(double x, double epsilon) {
  if (x < -epsilon) return 0;
  if (x > epsilon) return 1;
  const double r = x / epsilon;
  return 0.5 * (1 + r + std::sin(r * std::numbers::pi) / std::numbers::pi);
}

double smooth_heaviside_slope(double x, double epsilon) {
  return std::abs(x) > epsilon ? 0 : 0.5 / epsilon * (1 + std::cos(x / epsilon * std::numbers::pi));
}

void BandLikelihood::choose_band(const ImageMeasurement& image, std::span<const PathVertex> path,
                                 double reach_px, const AppearanceModel& model, PathEnd end) {
  width_ = image.width;
  height_ = image.height;
  nearest_.resize(image.grey.size());
  measure_distances(path, reach_px);
  pixels_.clear();
  for (std::size_t index = 0; index < nearest_.size(); ++index) {
    const Nearest& nearest = nearest_[index];
    const bool behind = nearest.segment + 2 == path.size() && nearest.along >= 1;
    if (nearest.round == round_ && image.measured.holds_pixel(index) &&
        !(behind && end == PathEnd::kGoesOn)) {
      pixels_.push_back({index, static_cast<float>(signed_distance(path, nearest))});
    }
  }
  weigh(image, model);
}

void BandLikelihood::weigh(const ImageMeasurement& image, const AppearanceModel& model) {
  weights_.clear();
  for (const PixelDistance& pixel : pixels_) {
    const float grey = image.grey[pixel.index];
    const float vesselness = image.vesselness[pixel.index];
    weights_.push_back({model.foreground(grey, vesselness), model.background(grey, vesselness)});
  }
}

void BandLikelihood::measure_distances(std::span<const PathVertex> path, double reach_px) {
  ++round_;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    if (path[i].p_px.allFinite() && path[i + 1].p_px.allFinite()) {
      measure_segment(path[i], path[i + 1], static_cast<std::uint32_t>(i), reach_px);
    }
  }
}

void BandLikelihood::measure_segment(const PathVertex& a, const PathVertex& b, std::uint32_t segment,
                                     double reach_px) {
  const double far_px = reach_px + std::max(a.half_width_px, b.half_width_px);
  const Eigen::Vector2d low = a.p_px.cwiseMin(b.p_px).array() - far_px;
  const Eigen::Vector2d high = a.p_px.cwiseMax(b.p_px).array() + far_px;
  if (high.x() < 0 || high.y() < 0 || low.x() > width_ - 1 || low.y() > height_ - 1) {
    return;
  }
  const int left = static_cast<int>(std::ceil(std::max(low.x(), 0.0)));
  const int top = static_cast<int>(std::ceil(std::max(low.y(), 0.0)));
  const int right = static_cast<int>(std::floor(std::min(high.x(), width_ - 1.0)));
  const int bottom = static_cast<int>(std::floor(std::min(high.y(), height_ - 1.0)));
  const Eigen::Vector2d along = b.p_px - a.p_px;
  const double squared_length = std::max(along.squaredNorm(), 1e-12);
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const Eigen::Vector2d from = Eigen::Vector2d(x, y) - a.p_px;
      const double t = std::clamp(from.dot(along) / squared_length, 0.0, 1.0);
      const double distance = (from - t * along).norm();
      Nearest& nearest = nearest_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                                  static_cast<std::size_t>(x)];
      const bool within = distance <= far_px;
      if (within && (nearest.round != round_ || distance < nearest.distance_px)) {
        nearest = {distance, t, segment, round_};
      }
    }
  }
}

double BandLikelihood::signed_distance(std::span<const PathVertex> path, const Nearest& nearest) const {
  const double t = nearest.along;
  const double half_width =
      (1 - t) * path[nearest.segment].half_width_px + t * path[nearest.segment + 1].half_width_px;
  return half_width - nearest.distance_px;
}

double BandLikelihood::log_likelihood(std::span<const PathVertex> path, double epsilon_px,
                                      BandDerivatives* derivatives) {
  measure_distances(path, epsilon_px);
  double inside = 0;  // sum of H over Omega
  double sum = 0;
  for (std::size_t m = 0; m < pixels_.size(); ++m) {
    const Nearest& nearest = nearest_[pixels_[m].index];
    // Eq. (17): H_eps of the signed distance phi to the tube's edge, positive inside.
    const double h =
        nearest.round == round_ ? smooth_heaviside(signed_distance(path, nearest), epsilon_px) : 0.0;
    inside += h;
    sum += std::log(numerator(static_cast<double>(weights_[m].foreground),
                              static_cast<double>(weights_[m].background), h));
  }
  // The denominator of Eq. (16): P_f eta_f + P_b eta_b with eta_f = sum of H, eta_b = sum of 1 - H over the
  // band.
  const double outside = static_cast<double>(pixels_.size()) - inside;
  double normaliser = 0;  // derivative of the logarithms of the denominators by `inside`
  for (const Weight& weight : weights_) {
    const auto foreground = static_cast<double>(weight.foreground);
    const auto background = static_cast<double>(weight.background);
    const double denominator = foreground * inside + background * outside;
    sum -= std::log(denominator);
    normaliser += (foreground - background) / denominator;
  }
  if (derivatives != nullptr) add_derivatives(path, epsilon_px, normaliser, *derivatives);
  return sum;
}

void BandLikelihood::add_derivatives(std::span<const PathVertex> path, double epsilon_px, double normaliser,
                                     BandDerivatives& derivatives) const {
  derivatives.gradient.setZero(2, static_cast<Eigen::Index>(path.size()));
  derivatives.information.assign(path.size(), Eigen::Matrix2d::Zero());
  derivatives.information_next.assign(path.size(), Eigen::Matrix2d::Zero());
  for (std::size_t m = 0; m < pixels_.size(); ++m) {
    const Nearest& nearest = nearest_[pixels_[m].index];
    if (nearest.round != round_ || nearest.distance_px <= 0) continue;
    const double phi = signed_distance(path, nearest);
    const double slope = smooth_heaviside_slope(phi, epsilon_px);
    if (slope == 0) continue;
    const auto foreground = static_cast<double>(weights_[m].foreground);
    const auto background = static_cast<double>(weights_[m].background);
    // d log numerator / d phi = (P_f - P_b) delta_eps(phi) / (P_f H + P_b (1 - H)).
    const double score = (foreground - background) * slope /
                         numerator(foreground, background, smooth_heaviside(phi, epsilon_px));
    // The nearest place slides along the path without changing the distance: only its two vertices count.
    const double t = nearest.along;
    const PathVertex& a = path[nearest.segment];
    const PathVertex& b = path[nearest.segment + 1];
    const auto width = static_cast<std::size_t>(width_);
    const Eigen::Vector2d pixel(static_cast<double>(pixels_[m].index % width),
                                static_cast<double>(pixels_[m].index / width));
    // phi = half width - distance: a vertex that moves toward the pixel by w makes phi larger by w (weight 1
    // - t or t).
    const Eigen::Vector2d away = (pixel - (1 - t) * a.p_px - t * b.p_px).normalized();
    const Eigen::Vector2d move = (score - normaliser * slope) * away;
    const auto column = static_cast<Eigen::Index>(nearest.segment);
    derivatives.gradient.col(column) += (1 - t) * move;
    derivatives.gradient.col(column + 1) += t * move;
    // Fisher information of the numerator alone: the squared score in place of second derivatives.
    const Eigen::Matrix2d outer = score * score * away * away.transpose();
    derivatives.information[nearest.segment] += (1 - t) * (1 - t) * outer;
    derivatives.information[nearest.segment + 1] += t * t * outer;
    derivatives.information_next[nearest.segment] += t * (1 - t) * outer;
  }
}

void offsets_along(const BandDerivatives& derivatives, const Eigen::Matrix2Xd& normals,
                   std::span<BandOffset> offsets) {
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    const Eigen::Vector2d normal = normals.col(column);
    const double information = normal.dot(derivatives.information[i] * normal);
    if (information > 0) {
      offsets[i] = {normal.dot(derivatives.gradient.col(column)) / information, 1 / information};
    } else {
      offsets[i] = {0, std::numeric_limits<double>::infinity()};
    }
  }
}

}  // namespace tubed
