// What a fluoroscope looks at in one exposure, beside the patient. Lengths mm, room frame (the frame of the
// camera's T_camera_world, which is the patient's: x toward the patient's left, y posterior, z superior).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace tubed {

/// A metal band around a catheter. Arc length counts from the tip.
struct RadiographElectrode {
  double s_mm = 0;                ///< middle of the band
  double length_mm = 1.3;         ///< along the catheter
  double radius_mm = 1.165;       ///< outer
  double wall_mm = 0.08;          ///< thickness of the metal
  double attenuation_per_mm = 8;  ///< platinum at about 65 keV
};

/// A tube: a catheter, a wire, a lead. Its shape is the polyline through `centreline_room_mm`, swept with
/// mitred joints.
struct RadiographRod {
  Eigen::Matrix3Xd centreline_room_mm;  ///< 3 x n, n >= 2 (fewer: nothing is drawn), tip first
  double radius_mm = 1.165;             ///< outer; 7 Fr
  double lumen_radius_mm = 0.5;         ///< 0: solid
  double attenuation_per_mm = 0.20;     ///< of the wall at the beam's effective energy, beyond the tissue's
  std::vector<RadiographElectrode> electrodes;
};

/// What else is in the picture; everything is off by default.
struct ClutterStates {
  bool second_wire = false;
  bool ecg_leads = false;
  bool collimator = false;
  bool heart_beat = false;
  bool breathing = false;
  /// Since the beginning of an injection of contrast agent into RadiographSettings::lumen; negative: none.
  double contrast_age_s = -1;
  bool surgery = false;  ///< sternal wires and clips of an operation long ago
};

/// One exposure.
struct RadiographScene {
  std::int64_t exposure = 0;  ///< the source's own count: picks the noise
  double time_s = 0;          ///< of the patient: phases of heart and lungs follow from it
  bool fluoroscopy_on = true;
  std::vector<RadiographRod> catheters;
  ClutterStates clutter;
};

}  // namespace tubed
