// How coils shake while they are still.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/coil_recording.hpp"

namespace tubed {

/// A still coil. Axes are the tracker's.
struct StillCoil {
  int sensor = 1;
  int measurements = 0;
  Eigen::Vector3d p_em_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d white_mm =
      Eigen::Vector3d::Zero();  ///< standard deviation from one measurement to the next, an axis
  Eigen::Vector3d total_mm = Eigen::Vector3d::Zero();  ///< around the mean of the recording, an axis
  double white_sigma_mm = 0;  ///< one standard deviation of white_mm's RMS over the axes
  double tangent = 0;         ///< of the unit tangent, an axis
  double averaged_mm = 0;     ///< Allan deviation of means over 40 measurements, RMS over the axes
  double expected_mm = 0;     ///< what white noise would leave of it
  double drift_mm_min = 0;    ///< speed of a straight line in time
  double drift_sigma_mm_min = 0;
  double interference_hz = 0;         ///< a line in the spectrum that noise does not explain; 0: none
  double interference_mm = 0;         ///< its amplitude
  std::vector<double> deviations_mm;  ///< of all axes, for a histogram
  [[nodiscard]] double white_rms_mm() const { return white_mm.norm() / std::sqrt(3.0); }
};

/// All coils at rest.
struct StillNoise {
  std::vector<StillCoil> coils;  ///< measured ones
  double rate_hz = 0;
  double position_mm = 0;  ///< white noise, an axis, RMS over coils
  double tangent = 0;
  std::vector<std::string> remarks;
};

/// White noise from differences of successive measurements (von Neumann), which neither a place nor a drift
/// changes; Allan's deviation over 40 of them beside it. A spectral line by Fisher's test of the
/// largest ordinate of the periodogram, at 1e-4. Throws CalibrationError when a coil moved, for a recording
/// shorter than 5 s, and when no coil was measured.
StillNoise measure_still(const CoilRecording& recording);

}  // namespace tubed
