// Are errors as large as the published covariances say? By stretch of the tube and by direction to the view.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

#include "clients/evaluation/estimates_csv.hpp"
#include "clients/evaluation/shape_error.hpp"

namespace tubed {

/// Seen from the camera of an instant: across the tube in the image, along it there, and along the ray.
inline constexpr std::array<std::string_view, 3> kSeenDirections{"across", "along", "in depth"};

/// A stretch of the tube from the end of the one before to `to_mm` from the tip.
struct ConsistencyStretch {
  std::string_view name;
  double to_mm;
};
inline constexpr std::array<ConsistencyStretch, 4> kConsistencyStretches{
    {{"tip, 0 .. 30 mm", 30}, {"30 .. 100 mm", 100}, {"100 .. 200 mm", 200}, {"from 200 mm on", 1e9}}};

/// Normalised estimation error squared (NEES) of one coordinate: (u' e)^2 / (u' Sigma u), with e = estimated
/// minus true point of the same arc length, u a unit vector and Sigma the published covariance. Its mean is 1
/// where Sigma is right (Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and
/// Navigation, 2001, section 5.4); errors of neighbours and of instants that follow each other are no
/// independent draws, so that no interval of chi-square belongs to a mean of one run.
struct NormalisedErrors {
  std::size_t count = 0;
  double sum_of_squares = 0;
  std::size_t beyond_3_sigma = 0;

  void add(double squared_error_mm2, double variance_mm2);
  /// Precondition: count > 0.
  [[nodiscard]] double mean_of_squares() const { return sum_of_squares / static_cast<double>(count); }
  [[nodiscard]] double share_beyond_3_sigma() const {
    return static_cast<double>(beyond_3_sigma) / static_cast<double>(count);
  }
};

/// All points up to s_max_mm, in view or not; nothing is counted of shapes without covariances.
class Consistency {
 public:
  /// `view`: of that instant.
  void add(const EstimatedShape& shape, const SampledCentreline& truth, const Camera& view, double s_max_mm);

  [[nodiscard]] const NormalisedErrors& of(std::size_t stretch, std::size_t direction) const {
    return errors_[stretch][direction];
  }
  /// Of all stretches.
  [[nodiscard]] NormalisedErrors of(std::size_t direction) const;

 private:
  std::array<std::array<NormalisedErrors, kSeenDirections.size()>, kConsistencyStretches.size()> errors_{};
};

}  // namespace tubed
