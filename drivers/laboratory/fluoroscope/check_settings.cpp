#include "drivers/laboratory/fluoroscope/check_settings.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace tubed {

namespace {

void within(const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    std::ostringstream text;
    text << "radiograph: " << name << " is " << value << ", has to be " << low << " to " << high;
    throw std::invalid_argument(text.str());
  }
}

void check(const DetectorSettings& detector) {
  if (!(detector.quanta_per_pixel >= 1)) {
    throw std::invalid_argument("radiograph: quanta_per_pixel has to be 1 or more, or infinite for no noise");
  }
  within("scatter_to_primary", detector.scatter_to_primary, 0, 20);
  within("scatter_width_px", detector.scatter_width_px, 1, 1e4);
  within("source_blur_px", detector.source_blur_px, 0, 20);
  within("detector_blur_px", detector.detector_blur_px, 0, 20);
  within("lag", detector.lag, 0, 0.9);
  within("electronic_noise", detector.electronic_noise, 0, 1e6);
}

void check(const DisplaySettings& display) {
  within("bits", display.bits, 8, 16);
  within("range_compression", display.range_compression, 0, 1);
  within("compression_width_px", display.compression_width_px, 1, 1e4);
  within("contrast", display.contrast, 0.01, 100);
}

void check(const MotionSettings& motion) {
  within("heart_phases", motion.heart_phases, 0, 64);
  within("breathing_phases", motion.breathing_phases, 0, 64);
  within("heart_period_s", motion.heart_period_s, 0.1, 100);
  within("breathing_period_s", motion.breathing_period_s, 0.1, 100);
  within("heart_squeeze", motion.heart_squeeze, 0, 0.3);
  within("diaphragm_travel_mm", motion.diaphragm_travel_mm, 0, 60);
  within("heart_radius_mm", motion.heart_radius_mm, 1, 500);
}

void check(const LumenSettings& lumen) {
  if (lumen.centreline_room_mm.cols() != lumen.radius_mm.size()) {
    throw std::invalid_argument("radiograph: the lumen has " +
                                std::to_string(lumen.centreline_room_mm.cols()) + " points but " +
                                std::to_string(lumen.radius_mm.size()) + " radii");
  }
  within("flow_mm_s", lumen.flow_mm_s, 1, 1e5);
  within("washout_s", lumen.washout_s, 1e-3, 1e3);
}

void check(const ConsoleSettings& console) {
  within("grid_lines", console.grid_lines, 0, 0.5);
  within("grid_period_px", console.grid_period_px, 2, 1000);
  within("vignetting", console.vignetting, 0, 0.95);
  within("edge_enhancement", console.edge_enhancement, 0, 10);
  within("edge_width_px", console.edge_width_px, 0.3, 50);
  within("recursive_share", console.recursive_share, 0, 0.9);
  within("recursive_limit", console.recursive_limit, 0, 100);
  within("table_slope", console.table_slope, 1, 10);
  within("brightness_share", console.brightness_share, 0, 1);
}

}  // namespace

const RadiographSettings& checked(const RadiographSettings& settings) {
  check(settings.detector);
  check(settings.display);
  check(settings.motion);
  check(settings.lumen);
  check(settings.console);
  return settings;
}

}  // namespace tubed
