#include "daemon/estimator/coils/coil_error_scale.hpp"

#include <algorithm>
#include <cmath>
#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr double kPriorSamples = 3;
constexpr double kMemory_s = 60;
// What an error that stays counts as a sample: a field bends neighbouring coils alike, and they follow each
// other through the same places. Counted in full, the one side that a view shows soon speaks for depth.
constexpr double kOwnShare = 0.3;
constexpr double kMaxSquare = 9;  // that of an outlier counts as much and no more
constexpr double kMinFactor = 0.25;
constexpr double kMaxFactor = 2;  // beyond it the image is the likelier to be wrong

// The side to which an image sees a point of the tube move: unit, world frame; nothing outside the image and
// behind a mask.
bool seen_side(const Camera& camera, const Eigen::Vector3d& p_world_mm, const Eigen::Vector3d& tangent_world,
               Eigen::Vector3d& side_world) {
  const auto projection = camera.project(p_world_mm);
  if (!projection || !camera.contains(projection->p_image_px) ||
      is_masked(camera.calibration(), projection->p_image_px)) {
    return false;
  }
  const Eigen::Vector2d along = projection->J_image_world * tangent_world;
  side_world = projection->J_image_world.transpose() * Eigen::Vector2d(-along.y(), along.x());
  const double length = side_world.norm();
  side_world /= std::max(length, 1e-9);
  return length > 1e-9;
}

}  // namespace

void CoilErrorScale::MeanSquare::add(double square, double share) {
  weight += share;
  sum += share * std::min(square, kMaxSquare);
}

double CoilErrorScale::MeanSquare::factor() const {
  return std::clamp(std::sqrt((kPriorSamples + sum) / (kPriorSamples + weight)), kMinFactor, kMaxFactor);
}

void CoilErrorScale::reset() {
  position_ = MeanSquare{};
  tangent_ = MeanSquare{};
  places_ = {};
}

void CoilErrorScale::observe(const CoilObservations& coils, const CoilNoise& noise,
                             std::span<const ViewConstraints> views, const UniformCubicBSpline& spline,
                             const Eigen::Matrix3Xd& C, double dt_s) {
  const double kept = std::exp(-std::clamp(dt_s, 0.0, 1.0) / kMemory_s);
  for (MeanSquare* mean : {&position_, &tangent_}) {
    mean->weight *= kept;
    mean->sum *= kept;
  }
  // Squared: with little noise, however many samples have that little in them, what stays was drawn once.
  const auto noise_share = [&noise](double noise_sigma, double whole) {
    return noise.known() ? std::min(1.0, std::pow(noise_sigma / whole, 4)) : 0;
  };
  const double position_share = noise_share(noise.noise_position_mm(), position_mm());
  const double tangent_share = noise_share(noise.noise_tangent(), tangent());
  for (int i = 0; i < coils.count; ++i) {
    const CoilObservation& coil = coils.coils[static_cast<std::size_t>(i)];
    if (!coil.used()) {
      continue;
    }
    const CubicBasis basis = spline.basis(coil.s_mm);
    const Eigen::Vector3d p_mm = combine(C, basis.first, basis.value);
    const Eigen::Vector3d direction = -combine(C, basis.first, basis.first_derivative).normalized();
    Place& place = places_[static_cast<std::size_t>(i)];
    const double lasting_share =
        kOwnShare * (place.seen ? std::min(1.0, (p_mm - place.p_world_mm).norm() / kNewAfter_mm) : 1.0);
    for (const ViewConstraints& view : views) {
      Eigen::Vector3d side;
      if (!seen_side(*view.camera, p_mm, direction, side)) {
        continue;
      }
      place = {true, p_mm};
      const double position = side.dot(coil.p_world_mm - p_mm) / settings_.sigma_position_mm;
      const double tangent = side.dot(coil.tangent_world - direction) / settings_.sigma_tangent;
      position_.add(position * position, std::max(position_share, lasting_share));
      tangent_.add(tangent * tangent, std::max(tangent_share, lasting_share));
    }
  }
}

}  // namespace tubed
