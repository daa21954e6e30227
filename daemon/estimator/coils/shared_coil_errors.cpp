#include "daemon/estimator/coils/shared_coil_errors.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numeric>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kMinLever_mm = 20;  // of all coils together; a turn about a line that all lie on moves none

}  // namespace

// A turn w moves the coil at r from the centre by w x r: of all coils w' W w with W = sum (r.r I - r r').
// Along W's eigenvectors u the columns u x r are orthogonal to each other, and to shifts because the r sum to
// zero.
SharedCoilErrors::SharedCoilErrors(std::span<const Eigen::Vector3d> places_mm)
    : J_(decltype(J_)::Zero(3 * static_cast<Eigen::Index>(places_mm.size()), 6)) {
  const auto count = static_cast<double>(places_mm.size());
  const Eigen::Vector3d centre_mm =
      std::accumulate(places_mm.begin(), places_mm.end(), Eigen::Vector3d(0, 0, 0)) / count;
  Eigen::Matrix3d W = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& place_mm : places_mm) {
    const Eigen::Vector3d r_mm = place_mm - centre_mm;
    W += r_mm.squaredNorm() * Eigen::Matrix3d::Identity() - r_mm * r_mm.transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(W);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double square_mm2 = axes.eigenvalues()[axis];
    for (std::size_t coil = 0; coil < places_mm.size(); ++coil) {
      const Eigen::Index row = 3 * static_cast<Eigen::Index>(coil);
      J_(row + axis, axis) = 1 / std::sqrt(count);
      if (square_mm2 > squared(kMinLever_mm)) {
        J_.block<3, 1>(row, 3 + axis) =
            axes.eigenvectors().col(axis).cross(places_mm[coil] - centre_mm) / std::sqrt(square_mm2);
      }
    }
  }
}

}  // namespace tubed
