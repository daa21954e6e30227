// How coils shake while the catheter moves.
#pragma once

#include <string>
#include <vector>

#include "clients/calibration/coil_recording.hpp"

namespace tubed {

/// A coil of a catheter in use.
struct MovingCoil {
  int sensor = 1;
  int differences = 0;       ///< that were asked
  double noise_mm = 0;       ///< standard deviation of a measurement, an axis, RMS over the axes
  double tangent = 0;        ///< of the unit tangent, an axis
  double median_mm_s = 0;    ///< its speed
  double slow_noise_mm = 0;  ///< of the slower half of its measurements
  double fast_noise_mm = 0;  ///< of the faster half
  double ratio_sigma = 0;    ///< standard deviation of ln(fast_noise_mm / slow_noise_mm) if both are the same
};

struct MovingNoise {
  std::vector<MovingCoil> coils;  ///< measured ones
  double rate_hz = 0;
  double position_mm = 0;  ///< an axis, RMS over coils
  double tangent = 0;
  std::vector<std::string> remarks;
};

/// White noise from third differences x_3 - 3 x_2 + 3 x_1 - x_0 of evenly spaced measurements, whose variance
/// is 20 times theirs: a coil that moves at a steady speed or acceleration has none of its own, and how the
/// sharpest moves change theirs the median of the absolute values passes over. So it is noise alone, the
/// field's error is not in it. Throws CalibrationError for a recording shorter than 5 s and when no coil gave
/// 100 differences.
MovingNoise measure_moving(const CoilRecording& recording);

}  // namespace tubed
