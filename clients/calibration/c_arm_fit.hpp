// How well a C-arm's angles explain the poses that were found, and the distances and the place that do so
// best.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "clients/calibration/camera_fit.hpp"
#include "idl/geometry/c_arm.hpp"

namespace tubed {

/// As displays and DICOM give them, degrees.
struct GantryAngles {
  double primary_deg = 0;
  double secondary_deg = 0;
};

/// A view as a C-arm model has it against the pose that its image alone gave.
struct ExplainedView {
  GantryAngles angles;
  Eigen::Vector3d turn_deg;  ///< about the camera's axes: found less model, at the isocentre
  Eigen::Vector3d shift_mm;
};

struct CArmFit {
  CArm c_arm;  ///< its angles are the first view's
  std::vector<ExplainedView> views;
  double rms_turn_deg = 0;
  double rms_shift_mm = 0;
  double isocentre_sigma_mm = 0;   ///< of source_isocentre_mm
  bool is_isocentre_known = true;  ///< false: it was given, and one direction says nothing of it
};

/// What is known of the C-arm before.
struct CArmPrior {
  double pixel_pitch_mm = 0;                  ///< of the image's pixels at the detector
  std::optional<double> source_isocentre_mm;  ///< held there
};

/// source_isocentre_mm and T_c_arm_world such that pose_of() gives the poses found: the mean of the
/// rotations, then least squares over the translations, in which both are linear. source_detector_mm is the
/// focal length times the pitch. Nothing for fewer than two views, or views within 10 deg of one another
/// while source_isocentre_mm is not given: along the beam, the isocentre and the place of the world cannot be
/// told apart.
std::optional<CArmFit> fit_c_arm(const CameraFit& fit, const std::vector<GantryAngles>& angles,
                                 const CArmPrior& prior);

/// Another reading of the angles: signs and order as other makers and other images have them.
struct AngleReading {
  const char* words;  ///< "primary with the other sign"
  GantryAngles (*read)(const GantryAngles&);
};
const std::vector<AngleReading>& other_readings();

}  // namespace tubed
