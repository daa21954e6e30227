// From a C-arm's distances and angles to the pose and the intrinsics of its view.
#pragma once

#include <array>

#include "idl/geometry/camera.hpp"
#include "idl/geometry/rigid_transform.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

/// A C-arm as DICOM's XA images describe it (PS3.3 C.8.7.5, XA Positioner; tag numbers in brackets).
///
/// Frame "c_arm": origin at the isocentre, x toward the left, y toward the back and z toward the head of a
/// patient who lies on his back, head first. The detector stands from the isocentre in the direction
///   d = (sin P cos S, -cos P cos S, sin S),   P, S: primary and secondary angle,
/// so that P = 0, S = 0 is in front of the chest, P = +90 deg the patient's left (LAO) and -90 deg his right
/// (RAO), S = +90 deg his head (cranial); the source lies opposite. The camera's centre is the source; the
/// image is as the source sees it, the head up: at P = S = 0 the patient's left is on its left. Displays show
/// the mirror image of that: CameraCalibration::mirrored.
struct CArm {
  double source_detector_mm = 0;   ///< (0018,1110)
  double source_isocentre_mm = 0;  ///< (0018,9402); of older images (0018,1111), to the patient
  double pixel_pitch_mm = 0;       ///< at the detector, without zoom: (0018,1164)
  double primary_angle_deg = 0;    ///< (0018,1510)
  double secondary_angle_deg = 0;  ///< (0018,1511)
  /// How far the table top stands from where the world was registered, along c_arm's axes; patient and world
  /// go with it: p_c_arm = T_c_arm_world * p_world + table_mm.
  std::array<double, 3> table_mm{};
  double zoom = 1;  ///< the detector's whole width over the width shown, (0018,1149)
  RigidTransform T_c_arm_world = RigidTransform::Identity();  ///< with the table at 0
};

/// T_camera_world of that C-arm.
RigidTransform pose_of(const CArm& c_arm);

/// Sets fx, fy, T_camera_world, source_isocentre_mm and source_detector_mm of `camera`; the principal point
/// is the camera's own.
void place(const CArm& c_arm, CameraCalibration& camera);

/// The keys of a [camera.c_arm]; T_c_arm_world is checked and set by whoever reads them.
inline BoundKeys<CArm> c_arm_keys() {
  using S = CArm;
  const KeyRange distance_mm{100, 3000};
  BoundKeys<CArm> keys{
      key::required(key::number("source_detector_mm", &S::source_detector_mm, "mm", distance_mm,
                                "from the X-ray source to the detector; DICOM (0018,1110)"),
                    "1200.0"),
      key::required(key::number("source_isocentre_mm", &S::source_isocentre_mm, "mm", distance_mm,
                                "from the X-ray source to the isocentre; DICOM (0018,9402)"),
                    "785.0"),
      key::required(key::number("pixel_pitch_mm", &S::pixel_pitch_mm, "mm", {0.01, 10},
                                "of the image's pixels at the detector, without zoom; DICOM (0018,1164)"),
                    "0.6"),
      key::number("primary_angle_deg", &S::primary_angle_deg, "deg", {-180, 180},
                  "LAO positive, RAO negative; DICOM (0018,1510)"),
      key::number("secondary_angle_deg", &S::secondary_angle_deg, "deg", {-90, 90},
                  "cranial positive, caudal negative; DICOM (0018,1511)"),
      key::numbers("table_mm", &S::table_mm, "mm", {-3000, 3000}, {3, 3},
                   "how far the table stands from where the world was registered: toward the patient's "
                   "left, back, head"),
      key::number("zoom", &S::zoom, "", {0.1, 20},
                  "the detector's whole width over the width shown: 2 shows half the field"),
      {key::optional(key::transform("T_c_arm_world",
                                    "p_c_arm = T_c_arm_world * p_world, the table at 0; frame c_arm: the "
                                    "isocentre, x to the patient's left, y to his back, z to his head; left "
                                    "out = the world is that"),
                     "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]")}};
  for (BoundKey<CArm>& bound : keys) {
    bound.key.takes_effect = TakesEffect::kAtOnce;
  }
  return keys;
}

}  // namespace tubed
