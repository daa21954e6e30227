// How wrong the coils really are in all, as images that show the tube tell it.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/coils/coil_noise.hpp"
#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// The settings state one error for every tracker and room; a good tracker taken for a bad one loses depth,
/// which nothing but the coils knows. Across the tube, in the plane of an image, the shape is known far
/// better than the coils are, so the distance of a coil from it there is one sample of the coil's error along
/// one axis. The scale is the mean square of such samples in units of the settings, begun with kPriorSamples
/// as the settings say. An error that stays gives no new sample with the next image: each counts by the share
/// of it that is new, by noise or by the way the coil has gone; and as a part of one, since a field bends
/// neighbouring coils alike. So a run of small errors across the view says little about depth, and large ones
/// make sigma larger than the settings have it, up to twice: a wrong registration looks the same. Called by
/// the optimizer thread; never allocates.
class CoilErrorScale {
 public:
  static constexpr double kNewAfter_mm =
      200;  ///< way of a coil after which an error that stays is another one

  explicit CoilErrorScale(const EstimatorSettings& settings) : settings_(settings) {}

  /// Takes the coils against the shape C (of `map`) that an image with these lines confirmed. `dt_s`: since
  /// the last call.
  void observe(const CoilObservations& coils, const CoilNoise& noise, std::span<const ViewConstraints> views,
               const UniformCubicBSpline& spline, const Eigen::Matrix3Xd& C, double dt_s);

  /// Standard deviations an axis of the whole error, noise and what stays together.
  [[nodiscard]] double position_mm() const { return settings_.sigma_position_mm * position_.factor(); }
  [[nodiscard]] double tangent() const { return settings_.sigma_tangent * tangent_.factor(); }

  void reset();

 private:
  /// Weighted mean of squares, in units of the settings' variance.
  struct MeanSquare {
    double weight = 0;
    double sum = 0;
    void add(double square, double share);
    [[nodiscard]] double factor() const;
  };
  struct Place {
    bool seen = false;
    Eigen::Vector3d p_world_mm = Eigen::Vector3d::Zero();
  };

  EstimatorSettings settings_;
  MeanSquare position_;
  MeanSquare tangent_;
  std::array<Place, kMaxCoils> places_{};
};

}  // namespace tubed
