// How much of a coil's error is noise, new with every measurement, and how much stays from one to the next.
#pragma once

#include <array>
#include <cstddef>

#include "daemon/estimator/coils/em_history.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// The settings say how wrong a coil is in all (EstimatorSettings::sigma_position_mm, sigma_tangent); a
/// distorted field, a wrong registration or a bent coil makes errors that stay, and averaging does not help
/// against them. The difference between the two kinds shows in the measurements themselves: of three equally
/// spaced ones, x_2 - 2 x_1 + x_0 has 6 times the variance of the noise, while errors that stay and steady
/// motion cancel. The median over some seconds keeps outliers and jerks out. Called by the optimizer thread;
/// never allocates.
class CoilNoise {
 public:
  explicit CoilNoise(const EstimatorSettings& settings);

  /// Takes what `frame` (which must be of `history`) adds for the coils of `instrument`.
  void observe(const EmFrame& frame, const EmHistory& history, const InstrumentDescription& instrument);

  void reset();

  /// Enough has been seen; until then everything counts as noise.
  [[nodiscard]] bool known() const { return count_ >= kMinCount; }

  /// Standard deviations an axis: noise, new with every measurement.
  [[nodiscard]] double noise_position_mm() const { return noise_position_mm_; }
  [[nodiscard]] double noise_tangent() const { return noise_tangent_; }

  /// Standard deviations an axis: what stays of a whole error of `whole_mm` or `whole`.
  [[nodiscard]] double lasting_position_mm(double whole_mm) const;
  [[nodiscard]] double lasting_tangent(double whole) const;

 private:
  static constexpr std::size_t kMinCount = 15;  ///< coils times instants
  static constexpr std::size_t kKept = 200;     ///< a second of five coils at 40 Hz
  using Differences = std::array<float, kKept>;

  [[nodiscard]] double sigma_of(const Differences& squares, double median_of_chi_squared);

  EstimatorSettings settings_;
  Differences positions_mm2_{};
  Differences tangents_{};
  Differences scratch_{};
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  double noise_position_mm_;
  double noise_tangent_;
};

}  // namespace tubed
