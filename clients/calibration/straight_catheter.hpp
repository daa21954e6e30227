// Where coils sit along the catheter, and which way they point, while it lies straight in a groove.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/coil_recording.hpp"

namespace tubed {

/// What is known of the tip. At most one of the two is given; with neither, distances alone are found.
struct StraightTip {
  /// Where the tip is, in the tracker's frame, as touched with a probe or as the groove's stop is known.
  std::optional<Eigen::Vector3d> p_em_mm;
  double p_sigma_mm = 0.5;               ///< of it, an axis
  std::optional<double> beyond_coil_mm;  ///< from the middle of the first coil to the tip, along the catheter
  double beyond_sigma_mm = 0.3;          ///< of it
};

/// One coil in the groove.
struct StraightCoil {
  int sensor = 1;
  double stated_mm = 0;
  double found_mm = 0;  ///< arc length from the tip; as stated where nothing was measured
  double sigma_mm = 0;  ///< of it; without a known tip of the distance from the first coil
  bool was_found = false;
  int measurements = 0;
  double noise_mm = 0;   ///< white noise along the groove, one measurement
  double beside_mm = 0;  ///< from the line
  double angle_deg =
      0;  ///< between its direction and the line, 0 .. 180; more than 90: it points away from the tip
  bool points_away = false;
  [[nodiscard]] double change_mm() const { return found_mm - stated_mm; }
};

/// All coils, and what a person should know.
struct StraightCatheter {
  std::vector<StraightCoil> coils;  ///< in the instrument's order
  bool has_tip = false;    ///< arc lengths are from the tip; otherwise the first coil stays as stated
  int placements = 1;      ///< recordings, between which the groove was moved
  double line_rms_mm = 0;  ///< of what coils lie beside the line, an axis
  double lasting_mm =
      0;  ///< of a coil's position that does not go away by averaging, an axis: from line_rms_mm
  std::vector<std::string> remarks;
  /// What has to be repaired before the values can be used; empty: nothing.
  std::vector<std::string> mistakes;
};

/// Fits one line to the mean places of all coils of each recording (the groove may lie elsewhere in each) and
/// measures along it. Noise is averaged away, an error of the field is not: what coils lie beside the line,
/// two axes a coil, says how large it is on the third (Student's t: n coils give 2 n - 4 degrees of freedom).
///
/// Throws CalibrationError where the catheter moved, is bent, has fewer than three measured coils, or
/// where less than a second was recorded. Order and direction of coils that contradict each other are told in
/// `mistakes`.
StraightCatheter measure_straight(const std::vector<CoilRecording>& placements, const StraightTip& tip);

}  // namespace tubed
