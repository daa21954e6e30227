// How far the coils of one measurement are off their prediction.
#pragma once

#include <Eigen/Core>
#include <array>

#include "daemon/estimator/coils/coil_observation.hpp"
#include "daemon/estimator/tube_gaussian.hpp"
#include "daemon/estimator/tube_map.hpp"

namespace tubed {

/// Innovations of the coils that say something, and how far off they may be: a motion otherwise than expected
/// makes much of that in common. Memory is taken in the constructor.
struct CoilInnovations {
  explicit CoilInnovations(int max_coils);
  int count = 0;                      ///< coils that say something; of the rest nothing is read
  std::array<int, kMaxCoils> coil{};  ///< their indices
  Eigen::VectorXd innovation_mm;      ///< 3 a coil, world frame
  Eigen::MatrixXd covariance_mm2;     ///< 3 x 3 a pair of coils, noise included

  /// Of the used coils against `tube`, whose columns are those of `map`. `noise_mm`: standard deviation of
  /// what is new in a coil's error with every measurement, an axis.
  void measure(const CoilObservations& coils, const TubeMap& map, const TubeGaussian& tube, double noise_mm);

  /// chi^2 of the k-th of them by itself, 3 degrees of freedom.
  [[nodiscard]] double chi_squared(int k) const;

  /// Does no other coil than this one contradict its prediction, by itself?
  [[nodiscard]] bool others_are_calm(int than) const;

  /// Mean chi^2 a degree of freedom, without the coil that is furthest off, which may be wrong by itself. 0:
  /// too few to say.
  [[nodiscard]] double surprise() const;
};

}  // namespace tubed
