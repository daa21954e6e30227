// How a fluoroscope and its patient are set for a simulated run.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "drivers/laboratory/fluoroscope/radiograph_scene.hpp"

namespace tubed {

/// X-ray beam and detector. Attenuation is of one effective energy, about 65 keV of a filtered 80 kV beam.
struct DetectorSettings {
  /// Dose: quanta detected by the median pixel of the patient's picture, as automatic exposure control keeps
  /// it. Infinity: no quantum noise.
  double quanta_per_pixel = 240;
  double scatter_to_primary = 0.9;  ///< behind an anti-scatter grid, for the median pixel of the patient
  double scatter_width_px = 60;     ///< standard deviation of the scatter's spread
  double source_blur_px = 0.55;   ///< standard deviation of the focal spot's shadow: before the quanta count
  double detector_blur_px = 0.5;  ///< of the scintillator's light: after it, so that noise is blurred too
  double lag = 0.03;              ///< part of a picture that stays for the next, 0 .. 0.9
  double electronic_noise = 4;    ///< standard deviation, in quanta
};

/// What becomes of the quanta that a detector has counted.
enum class DetectorReadout {
  kDisplay,    ///< -log, part of its large scales taken away, one fixed window: what a console shows
  kIntensity,  ///< grey values in proportion, saturated beyond 8 times the median of the patient
};

/// From detected quanta to grey values. Of kIntensity only bits count.
struct DisplaySettings {
  DetectorReadout readout = DetectorReadout::kDisplay;
  int bits = 8;                      ///< 8, or 9 .. 16 in words of 16
  double range_compression = 0.6;    ///< part of the large-scale attenuation that is taken away, 0 .. 1
  double compression_width_px = 50;  ///< what counts as large scale: standard deviation
  double contrast = 1;               ///< above 1: a narrower window
};

/// How the patient moves when ClutterStates say so. Phases are cast once and interpolated.
struct MotionSettings {
  int heart_phases = 0;      ///< cached for half a beat, 0: the heart cannot beat; 4 is enough
  int breathing_phases = 0;  ///< cached for half a breath, 0: no breathing; 8 is enough
  double heart_period_s = 0.9;
  double breathing_period_s = 4.2;
  double heart_squeeze = 0.10;      ///< shortening of the heart's radii at the end of the systole, as a share
  double diaphragm_travel_mm = 10;  ///< toward the feet at the end of the inspiration
  Eigen::Vector3d heart_centre_room_mm{10, -58, -100};
  double heart_radius_mm = 72;        ///< nothing beyond moves with the beat
  double diaphragm_z_room_mm = -122;  ///< its dome; what lies above moves less, up to the apex of the lungs
};

/// Where contrast agent flows: along the vessel from its first point on.
struct LumenSettings {
  Eigen::Matrix3Xd centreline_room_mm;  ///< 3 x n; empty: no agent can be seen
  Eigen::VectorXd radius_mm;            ///< n
  double flow_mm_s = 220;
  double injection_s = 1.2;
  double washout_s = 0.9;             ///< time constant after the injection
  double attenuation_per_mm = 0.022;  ///< of the undiluted agent in the vessel, beyond blood's
};

/// Blades of the collimator: how much of each side of the picture they cover, px.
struct CollimatorSettings {
  double left_px = 22, right_px = 22, top_px = 16, bottom_px = 24;
  double corner_px = 10;  ///< rounding
  double transmission = 0.004;
};

struct RadiographSettings {
  DetectorSettings detector;
  DisplaySettings display;
  MotionSettings motion;
  LumenSettings lumen;
  CollimatorSettings collimator;
  /// What ClutterStates::second_wire and ecg_leads show; add_default_clutter() of clutter.hpp fills them.
  std::vector<RadiographRod> second_wire;
  std::vector<RadiographRod> ecg_leads;
};

}  // namespace tubed
