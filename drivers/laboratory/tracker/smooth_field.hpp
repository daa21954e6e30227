// A vector field that bends space smoothly, as metal beside a tracker bends what it measures.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace tubed {

/// w(p) = sum_k a_k cos(k_k . p + phi_k): six plane waves of 350 to 900 mm, longer than the catheter's gaps
/// between coils. A pure function of what it was made from. Immutable, callable from any thread; what is
/// const never allocates.
class SmoothField {
 public:
  /// Zero everywhere.
  SmoothField() = default;
  /// Scaled so that the greatest value in `volume_mm` is `max`, in the unit that values are to have.
  SmoothField(std::int64_t seed, std::int64_t stream, double max, const Eigen::AlignedBox3d& volume_mm);

  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector3d& p_mm) const noexcept;
  /// dw / dp there, per mm.
  [[nodiscard]] Eigen::Matrix3d gradient(const Eigen::Vector3d& p_mm) const noexcept;

 private:
  struct Wave {
    Eigen::Vector3d amplitude;
    Eigen::Vector3d wave_number_per_mm;
    double phase_rad;
  };
  std::vector<Wave> waves_;
};

}  // namespace tubed
