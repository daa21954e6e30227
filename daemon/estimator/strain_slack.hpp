// How much looser than the settings say the strain is held where every instant adds stiffness afresh.
#pragma once

namespace tubed {

/// Factor on sigma_strain (TubeMap::set_strain_slack()). Every instant adds its stiffness afresh, and images
/// fix the outline; where the spline cannot bend as the tube does, the printed weight of strain then turns
/// the error into depth.
inline constexpr double kStrainSlack = 4.5;

}  // namespace tubed
