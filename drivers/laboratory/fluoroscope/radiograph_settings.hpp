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

/// What a console and its detector add to a picture on its way to a video output. Everything is off by
/// default.
struct ConsoleSettings {
  /// Lines of the anti-scatter grid: their amplitude as a share of the signal, and how far apart they are.
  double grid_lines = 0;
  double grid_period_px = 3.3;
  double vignetting = 0;  ///< share of the signal that is missing in the corners, growing with the square
  /// Unsharp masking: so many times what a Gaussian of that width takes away is added.
  double edge_enhancement = 0;
  double edge_width_px = 2;  ///< standard deviation
  /// Temporal filter: share of the pictures before that stays, 0 .. 0.9. What moves leaves a ghost.
  double recursive_share = 0;
  /// Where a change is so many times that of noise, half of the share is left, beyond it hardly any: what
  /// moves is shown as it is. 0: the share is the same everywhere.
  double recursive_limit = 0;
  /// Slope of the S-shaped table of grey values at the middle, 1: a straight line.
  double table_slope = 1;
  /// Automatic brightness: which share of a change of the picture's median is taken back with each exposure,
  /// 0: none is.
  double brightness_share = 0;
  bool text = false;  ///< a clock and a counter, burnt in at the upper corners

  [[nodiscard]] bool is_off() const { return *this == ConsoleSettings{}; }
  bool operator==(const ConsoleSettings&) const = default;
};

struct RadiographSettings {
  DetectorSettings detector;
  DisplaySettings display;
  ConsoleSettings console;
  MotionSettings motion;
  LumenSettings lumen;
  CollimatorSettings collimator;
  /// What ClutterStates::second_wire and ecg_leads show; add_default_clutter() of clutter.hpp fills them.
  std::vector<RadiographRod> second_wire;
  std::vector<RadiographRod> ecg_leads;
  std::vector<RadiographRod> surgery;  ///< of ClutterStates::surgery; add_surgery() fills it
};

}  // namespace tubed
