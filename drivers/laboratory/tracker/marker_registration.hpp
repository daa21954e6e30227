// A tracker registered to a CT by fiducial markers, as a person does it with a phantom: each marker is found
// in both, with an error in both, and the rigid motion of least squares is what the room is described with.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "drivers/laboratory/tracker/em_errors.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// The registration error of markers after the fit: Sec. 3.2, "1.81 +- 0.78 mm and the maximum error, 3.64
/// mm". Errors that are normal and the same in every direction leave residuals whose lengths follow Maxwell's
/// distribution, SD / mean = 0.42; the paper's 0.78 / 1.81 = 0.43 is that of such errors.
struct MarkerSettings {
  int count = 13;
  double mean_residual_mm = 1.81;
  double sd_residual_mm = 0.78;
  /// Of a marker's middle in the CT, an axis: half a voxel of 0.5 mm to either side, 0.5 / sqrt(12).
  double sigma_ct_mm = 0.144;
  /// The markers sit on the faces of this box, world frame.
  Eigen::AlignedBox3d box_world_mm{Eigen::Vector3d(-90, -60, -205), Eigen::Vector3d(90, 60, 95)};
};

struct SimulatedRegistration {
  Eigen::Matrix3Xd found_em_mm;  ///< 3 x count, by the tracker
  Eigen::Matrix3Xd found_ct_mm;  ///< 3 x count, in the CT, whose frame is the world's
  RigidTransform T_world_em = RigidTransform::Identity();
  std::vector<double> residual_mm;  ///< |T_world_em found_em - found_ct|, one a marker
};

/// Standard deviation an axis of the errors with which markers have to be found, EM and CT together, so that
/// the mean square of the residuals is that of the settings. A rigid fit to n points takes 6 of 3 n degrees
/// of freedom: mean square = 3 (1 - 2 / n) sigma^2 (Sibson 1979; Fitzpatrick, West, Maurer, IEEE TMI 17
/// (1998) 694, Eq. (10)). `explained_mm2`: mean square of what is in the residuals beside; 0 is returned when
/// that is all of them.
double localisation_sigma_mm(const MarkerSettings& settings, double explained_mm2);

/// Markers drawn by `seed` on the box, found by the tracker with its warped `field` and a normal error, and
/// in the CT with a normal error, then fitted (Umeyama, IEEE PAMI 13 (1991) 376, without scale). The field
/// alone leaves residuals; localisation_sigma_mm() is what they leave open. `true_T_world_em` and `field`: as
/// the catheter's coils are measured with.
SimulatedRegistration register_markers(const MarkerSettings& settings, const RigidTransform& true_T_world_em,
                                       const EmErrors& field, std::int64_t seed);

}  // namespace tubed
