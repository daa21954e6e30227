#include "drivers/laboratory/vessel/wall_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace tubed {

namespace {

/// Four uniform cubic B-spline weights at u in [0, 1], with first and second derivatives by u.
struct Weights {
  Eigen::Array4d value, slope, curvature;
};

Weights weights_at(double u) {
  const double v = 1 - u;
  return {{v * v * v / 6, (3 * u * u * u - 6 * u * u + 4) / 6, (3 * v * v * v - 6 * v * v + 4) / 6,
           u * u * u / 6},
          {-v * v / 2, (3 * u * u - 4 * u) / 2, -(3 * v * v - 4 * v) / 2, u * u / 2},
          {v, 3 * u - 2, 3 * v - 2, u}};
}

Eigen::AlignedBox3d box_of(std::span<const LumenBall> balls) {
  Eigen::AlignedBox3d box;
  for (const LumenBall& ball : balls) {
    box.extend((ball.centre_world_mm.array() + ball.radius_mm).matrix());
    box.extend((ball.centre_world_mm.array() - ball.radius_mm).matrix());
  }
  return box;
}

}  // namespace

/// Where a point lies in the grid: the first of its 4 x 4 x 4 coefficients, the weights, and how far the
/// point is outside the grid.
struct WallField::Place {
  Eigen::Array3i first;
  std::array<Weights, 3> weights;
  Eigen::Vector3d outside_mm;
};

WallField::WallField(const Eigen::Vector3d& origin_mm, double spacing_mm, const Eigen::Array3i& size,
                     std::vector<float> distances_mm)
    : origin_mm_(origin_mm), spacing_mm_(spacing_mm), size_(size), distances_mm_(std::move(distances_mm)) {
  if ((size_ < 4).any() ||
      distances_mm_.size() != static_cast<std::size_t>(size_.cast<Eigen::Index>().prod())) {
    throw std::invalid_argument("a wall field needs at least 4 points an axis and a distance for each");
  }
}

WallField WallField::of_balls(std::span<const LumenBall> balls, double spacing_mm) {
  if (balls.empty()) {
    throw std::invalid_argument("a vessel needs a lumen");
  }
  const Eigen::AlignedBox3d box = box_of(balls);
  const Eigen::Vector3d origin = box.min().array() - (kReach_mm + 2 * spacing_mm);
  const Eigen::Array3i size =
      ((box.sizes().array() + 2 * kReach_mm + 4 * spacing_mm) / spacing_mm).ceil().cast<int>() + 1;
  std::vector<float> distances(static_cast<std::size_t>(size.cast<Eigen::Index>().prod()),
                               static_cast<float>(-kReach_mm));
  for (const LumenBall& ball : balls) {
    if (!(ball.radius_mm > 0)) {
      throw std::invalid_argument("the radius of a lumen has to be positive");
    }
    const double reach = ball.radius_mm + kReach_mm;
    const Eigen::Array3d centre = (ball.centre_world_mm - origin).array();
    const Eigen::Array3i first = ((centre - reach) / spacing_mm).ceil().cast<int>().max(0);
    const Eigen::Array3i last = ((centre + reach) / spacing_mm).floor().cast<int>().min(size - 1);
    for (int k = first.z(); k <= last.z(); ++k) {
      for (int j = first.y(); j <= last.y(); ++j) {
        const double dy = j * spacing_mm - centre.y();
        const double dz = k * spacing_mm - centre.z();
        float* row = &distances[static_cast<std::size_t>((k * size.y() + j) * size.x())];
        for (int i = first.x(); i <= last.x(); ++i) {
          const double dx = i * spacing_mm - centre.x();
          const auto inside = static_cast<float>(ball.radius_mm - std::sqrt(dx * dx + dy * dy + dz * dz));
          row[i] = std::max(row[i], inside);
        }
      }
    }
  }
  return {origin, spacing_mm, size, std::move(distances)};
}

Eigen::AlignedBox3d WallField::box_world_mm() const {
  return {origin_mm_, origin_mm_ + (spacing_mm_ * (size_ - 1).cast<double>()).matrix()};
}

WallField::Place WallField::place(const Eigen::Vector3d& p_world_mm) const {
  // The spline is defined from the second coefficient to the last but one.
  const Eigen::Array3d wanted = (p_world_mm - origin_mm_).array() / spacing_mm_;
  const Eigen::Array3d inside = wanted.max(1.0).min(size_.cast<double>() - 2.001);
  Place place;
  place.first = inside.floor().cast<int>() - 1;
  place.outside_mm = (wanted - inside).matrix() * spacing_mm_;
  for (int axis = 0; axis < 3; ++axis) {
    place.weights[static_cast<std::size_t>(axis)] = weights_at(inside[axis] - place.first[axis] - 1);
  }
  return place;
}

double WallField::distance_mm(const Eigen::Vector3d& p_world_mm) const {
  const Place at = place(p_world_mm);
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      const auto row = static_cast<std::size_t>(
          ((at.first.z() + k) * size_.y() + at.first.y() + j) * size_.x() + at.first.x());
      const Eigen::Array4d values = Eigen::Map<const Eigen::Array4f>(&distances_mm_[row]).cast<double>();
      sum += at.weights[2].value[k] * at.weights[1].value[j] * (values * at.weights[0].value).sum();
    }
  }
  return sum - at.outside_mm.norm();
}

WallDistance WallField::at(const Eigen::Vector3d& p_world_mm) const {
  const Place at = place(p_world_mm);
  const auto& [wx, wy, wz] = at.weights;
  WallDistance result;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      const auto row = static_cast<std::size_t>(
          ((at.first.z() + k) * size_.y() + at.first.y() + j) * size_.x() + at.first.x());
      const Eigen::Array4d values = Eigen::Map<const Eigen::Array4f>(&distances_mm_[row]).cast<double>();
      const double f = (values * wx.value).sum();
      const double fx = (values * wx.slope).sum();
      const double fxx = (values * wx.curvature).sum();
      result.distance_mm += wz.value[k] * wy.value[j] * f;
      gradient.x() += wz.value[k] * wy.value[j] * fx;
      gradient.y() += wz.value[k] * wy.slope[j] * f;
      gradient.z() += wz.slope[k] * wy.value[j] * f;
      hessian(0, 0) += wz.value[k] * wy.value[j] * fxx;
      hessian(1, 1) += wz.value[k] * wy.curvature[j] * f;
      hessian(2, 2) += wz.curvature[k] * wy.value[j] * f;
      hessian(1, 0) += wz.value[k] * wy.slope[j] * fx;
      hessian(2, 0) += wz.slope[k] * wy.value[j] * fx;
      hessian(2, 1) += wz.slope[k] * wy.slope[j] * f;
    }
  }
  result.gradient = gradient / spacing_mm_;
  result.hessian_per_mm = hessian.selfadjointView<Eigen::Lower>();
  result.hessian_per_mm /= spacing_mm_ * spacing_mm_;
  const double outside = at.outside_mm.norm();
  if (outside > 0) {
    result.distance_mm -= outside;
    result.gradient -= at.outside_mm / outside;
  }
  return result;
}

}  // namespace tubed
