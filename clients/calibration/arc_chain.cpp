#include "clients/calibration/arc_chain.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace tubed {

namespace {

constexpr double kMinPiece_mm = 0.5;
constexpr double kSmallTurn_rad = 1e-6;

Eigen::Vector2d direction(double heading_rad) { return {std::cos(heading_rad), std::sin(heading_rad)}; }

/// Arc lengths of the points along the line through them.
std::vector<double> places_on(const Eigen::Matrix2Xd& points) {
  std::vector<double> places{0};
  for (Eigen::Index i = 1; i < points.cols(); ++i) {
    places.push_back(places.back() + (points.col(i) - points.col(i - 1)).norm());
  }
  return places;
}

/// The line's direction at the middle of each step, without jumps of a whole turn.
std::vector<double> headings_of(const Eigen::Matrix2Xd& points) {
  std::vector<double> headings;
  for (Eigen::Index i = 1; i < points.cols(); ++i) {
    const Eigen::Vector2d step = points.col(i) - points.col(i - 1);
    const double heading = std::atan2(step.y(), step.x());
    headings.push_back(
        headings.empty() ? heading : headings.back() + std::remainder(heading - headings.back(), 2 * M_PI));
  }
  return headings;
}

double interpolated(const std::vector<double>& x, const std::vector<double>& y, double at) {
  const auto above = std::upper_bound(x.begin(), x.end(), at);
  if (above == x.begin()) return y.front();
  if (above == x.end()) return y.back();
  const auto right = static_cast<std::size_t>(above - x.begin());
  const double part = (at - x[right - 1]) / (x[right] - x[right - 1]);
  return y[right - 1] + part * (y[right] - y[right - 1]);
}

}  // namespace

ArcChain ArcChain::along(const Eigen::Matrix2Xd& points_mm, std::size_t pieces) {
  const std::vector<double> places = places_on(points_mm);
  const std::vector<double> headings = headings_of(points_mm);
  std::vector<double> middles;
  for (std::size_t i = 0; i + 1 < places.size(); ++i) middles.push_back((places[i] + places[i + 1]) / 2);
  ArcChain chain;
  chain.begin_mm_ = points_mm.col(0);
  chain.heading_rad_ = headings.front();
  const double piece_mm = places.back() / static_cast<double>(pieces);
  chain.lengths_mm_.assign(pieces, piece_mm);
  for (std::size_t k = 0; k < pieces; ++k) {
    const double from_mm = static_cast<double>(k) * piece_mm;
    chain.curvatures_per_mm_.push_back(
        (interpolated(middles, headings, from_mm + piece_mm) - interpolated(middles, headings, from_mm)) /
        piece_mm);
  }
  return chain;
}

ArcChain::Place ArcChain::at(double s_mm) const {
  Place place{begin_mm_, heading_rad_};
  double left_mm = s_mm;
  for (std::size_t k = 0; k < lengths_mm_.size(); ++k) {
    const bool is_last = k + 1 == lengths_mm_.size();
    const double go_mm = is_last ? left_mm : std::min(left_mm, lengths_mm_[k]);
    const double turn_rad = go_mm * curvatures_per_mm_[k];
    // The chord of an arc leads into the direction of its middle.
    const double chord_mm =
        std::abs(turn_rad) < kSmallTurn_rad ? go_mm : 2 * std::sin(turn_rad / 2) / curvatures_per_mm_[k];
    place.p_mm += chord_mm * direction(place.heading_rad + turn_rad / 2);
    place.heading_rad += turn_rad;
    left_mm -= go_mm;
    if (left_mm <= 0) break;
  }
  return place;
}

Eigen::VectorXd ArcChain::residuals_mm(const Eigen::Matrix2Xd& points_mm) const {
  Eigen::VectorXd residuals(points_mm.cols() + 1);
  double s_mm = 0;
  Eigen::Vector2d before = begin_mm_;
  for (Eigen::Index i = 0; i < points_mm.cols(); ++i) {
    const Eigen::Vector2d point = points_mm.col(i);
    s_mm += i == 0 ? 0 : (point - before).norm();
    before = point;
    for (int round = 0; round < 3; ++round) {  // Newton's way to the nearest place
      const Place here = at(s_mm);
      s_mm += std::clamp(direction(here.heading_rad).dot(point - here.p_mm), -3.0, 3.0);
    }
    const Place here = at(s_mm);
    const Eigen::Vector2d along = direction(here.heading_rad);
    residuals(i) = along.x() * (point - here.p_mm).y() - along.y() * (point - here.p_mm).x();
  }
  residuals(points_mm.cols()) = direction(heading_rad_).dot(points_mm.col(0) - begin_mm_);
  return residuals;
}

Eigen::VectorXd ArcChain::parameters(Ends ends) const {
  const auto pieces = static_cast<Eigen::Index>(piece_count());
  Eigen::VectorXd x(3 + pieces + (ends == Ends::kFree ? pieces - 1 : 0));
  x.head<3>() << begin_mm_, heading_rad_;
  x.segment(3, pieces) = Eigen::Map<const Eigen::VectorXd>(curvatures_per_mm_.data(), pieces);
  if (ends == Ends::kFree) {
    x.tail(pieces - 1) = Eigen::Map<const Eigen::VectorXd>(lengths_mm_.data(), pieces - 1);
  }
  return x;
}

// The whole stays as long as it is.
void ArcChain::set_parameters(const Eigen::VectorXd& x, Ends ends) {
  const auto pieces = static_cast<Eigen::Index>(piece_count());
  begin_mm_ = x.head<2>();
  heading_rad_ = x(2);
  Eigen::Map<Eigen::VectorXd>(curvatures_per_mm_.data(), pieces) = x.segment(3, pieces);
  if (ends == Ends::kFree) {
    double left_mm = length_mm();
    for (Eigen::Index k = 0; k + 1 < pieces; ++k) {
      const double room_mm = left_mm - kMinPiece_mm * static_cast<double>(pieces - 1 - k);
      double& length_mm = lengths_mm_[static_cast<std::size_t>(k)];
      length_mm = std::clamp(x(3 + pieces + k), kMinPiece_mm, std::max(room_mm, kMinPiece_mm));
      left_mm -= length_mm;
    }
    lengths_mm_.back() = std::max(left_mm, kMinPiece_mm);
  }
}

void ArcChain::fit(const Eigen::Matrix2Xd& points_mm, Ends ends, int rounds) {
  Eigen::VectorXd x = parameters(ends);
  Eigen::VectorXd r = residuals_mm(points_mm);
  double damping = 1e-6;
  for (int round = 0; round < rounds; ++round) {
    Eigen::MatrixXd J(r.size(), x.size());
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      const double step = k >= 2 && k < 3 + static_cast<Eigen::Index>(piece_count()) ? 1e-6 : 1e-4;
      Eigen::VectorXd moved = x;
      moved(k) += step;
      ArcChain chain = *this;
      chain.set_parameters(moved, ends);
      J.col(k) = (chain.residuals_mm(points_mm) - r) / step;
    }
    const Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::VectorXd gradient = J.transpose() * r;
    bool improved = false;
    for (int attempt = 0; attempt < 8 && !improved; ++attempt) {
      Eigen::MatrixXd damped = H;
      damped.diagonal() += damping * (H.diagonal().array() + 1e-9).matrix();
      ArcChain chain = *this;
      chain.set_parameters(x - damped.ldlt().solve(gradient), ends);
      const Eigen::VectorXd after = chain.residuals_mm(points_mm);
      improved = after.squaredNorm() < r.squaredNorm() * (1 - 1e-9);
      damping = improved ? std::max(damping / 10, 1e-9) : damping * 10;
      if (improved) {
        *this = chain;
        x = parameters(ends);
        r = after;
      }
    }
    if (!improved) return;
  }
}

ArcChain ArcChain::merged(std::size_t piece) const {
  ArcChain chain = *this;
  const double turn_rad =
      lengths_mm_[piece] * curvatures_per_mm_[piece] + lengths_mm_[piece + 1] * curvatures_per_mm_[piece + 1];
  chain.lengths_mm_[piece] += lengths_mm_[piece + 1];
  chain.curvatures_per_mm_[piece] = turn_rad / chain.lengths_mm_[piece];
  chain.lengths_mm_.erase(chain.lengths_mm_.begin() + static_cast<std::ptrdiff_t>(piece) + 1);
  chain.curvatures_per_mm_.erase(chain.curvatures_per_mm_.begin() + static_cast<std::ptrdiff_t>(piece) + 1);
  return chain;
}

double ArcChain::length_mm() const { return std::accumulate(lengths_mm_.begin(), lengths_mm_.end(), 0.0); }

RestArc ArcChain::arc(std::size_t piece) const {
  const double curvature = curvatures_per_mm_[piece];
  return {lengths_mm_[piece], std::abs(curvature) < 1e-9 ? 0 : 1 / curvature};
}

Eigen::Matrix2Xd ArcChain::sampled(double step_mm) const {
  const auto count = static_cast<Eigen::Index>(std::ceil(length_mm() / step_mm)) + 1;
  Eigen::Matrix2Xd points(2, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    points.col(i) = at(std::min(static_cast<double>(i) * step_mm, length_mm())).p_mm;
  }
  return points;
}

}  // namespace tubed
