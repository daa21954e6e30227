#include "drivers/laboratory/flat_panel.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace tubed {

namespace {

constexpr double kPixelOfSettings_mm = 0.6;  ///< of Sec. 3.1's view: f = 2000 px, 1200 mm
constexpr double kMaxSide_px = 2048;
constexpr double kMinGridPeriod_px = 2;  // of lines that coarse pixels can show
constexpr double kMinPixel_mm = 0.05;
constexpr double kMaxPixel_mm = 3;

/// One side of an image: its size and principal point in pixels `finer` times as small.
struct Side {
  int size_px;
  double principal_px;
};

Side in_finer_pixels(int size_px, double principal_px, double finer) {
  const double wanted_px = std::round(size_px * finer);
  const double kept_px = std::min(wanted_px, kMaxSide_px);
  return {static_cast<int>(kept_px), (principal_px + 0.5) * finer - 0.5 - (wanted_px - kept_px) / 2};
}

}  // namespace

FlatPanel parse_panel(std::string_view words) {
  FlatPanel panel;
  std::string text(words);
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  std::string readout;
  std::string rest;
  const bool is_complete = (stream >> readout >> panel.bits >> panel.pixel_mm) && !(stream >> rest) &&
                           (readout == "linear" || readout == "log") && panel.bits >= 9 && panel.bits <= 16 &&
                           panel.pixel_mm >= kMinPixel_mm && panel.pixel_mm <= kMaxPixel_mm;
  if (!is_complete) {
    throw std::invalid_argument(
        "a panel is READOUT,BITS,PIXEL_MM such as linear,12,0.2: linear or log, 9 to 16 "
        "bits, pixels of 0.05 to 3 mm; found '" +
        std::string(words) + "'");
  }
  panel.readout = readout == "log" ? DetectorReadout::kDisplay : DetectorReadout::kIntensity;
  return panel;
}

CameraCalibration with_pixels(const CameraCalibration& camera, double pixel_mm) {
  const auto p_world_mm = camera.looked_at_world_mm();
  if (!p_world_mm) {
    throw std::invalid_argument("camera '" + camera.name + "' does not look at anything");
  }
  const double depth_mm = (camera.T_camera_world * *p_world_mm).z();
  const double finer = depth_mm / camera.fx / pixel_mm;
  const Side across = in_finer_pixels(camera.width, camera.cx, finer);
  const Side down = in_finer_pixels(camera.height, camera.cy, finer);
  CameraCalibration panel = camera;
  panel.width = across.size_px;
  panel.height = down.size_px;
  panel.fx *= finer;
  panel.fy *= finer;
  panel.cx = across.principal_px;
  panel.cy = down.principal_px;
  return panel;
}

RadiographSettings with_panel(RadiographSettings settings, const FlatPanel& panel) {
  const double finer = kPixelOfSettings_mm / panel.pixel_mm;
  settings.detector.source_blur_px *= finer;
  settings.detector.detector_blur_px *= finer;
  settings.detector.scatter_width_px *= finer;
  settings.detector.quanta_per_pixel = std::max(settings.detector.quanta_per_pixel / (finer * finer), 1.0);
  settings.detector.electronic_noise /= finer;
  settings.display.compression_width_px *= finer;
  settings.console.edge_width_px *= finer;
  settings.console.grid_period_px = std::max(settings.console.grid_period_px * finer, kMinGridPeriod_px);
  settings.display.bits = panel.bits;
  settings.display.readout = panel.readout;
  for (double* const px :
       {&settings.collimator.left_px, &settings.collimator.right_px, &settings.collimator.top_px,
        &settings.collimator.bottom_px, &settings.collimator.corner_px}) {
    *px *= finer;
  }
  return settings;
}

}  // namespace tubed
