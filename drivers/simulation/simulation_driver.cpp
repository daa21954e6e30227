#include "drivers/simulation/simulation_driver.hpp"

#include <limits>

#include "drivers/simulation/simulated_em_source.hpp"
#include "drivers/simulation/simulated_image_source.hpp"

namespace tubed {

std::vector<SettingDescription> simulation_settings() {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return {
      {"preset",
       std::string("arch"),
       false,
       -kNoLimit,
       kNoLimit,
       {"arch", "paper", "field", "frozen", "clinical", "biplane"},
       "",
       "what is simulated; all but arch push a catheter through an aorta, set the tracker's errors "
       "themselves and "
       "take some seconds to start"},
      {"seed",
       std::int64_t{1},
       false,
       0,
       1e15,
       {},
       "",
       "of noise and background, and of the patient in a preset; in the arch the catheters move the same for "
       "all"},
      {"vessel",
       std::string(),
       false,
       -kNoLimit,
       kNoLimit,
       {},
       "",
       "file of a vessel of your own for a preset, .csv or .stl, in mm; empty = the preset's aorta"},
      {"epoch_ns",
       std::int64_t{0},
       false,
       0,
       kNoLimit,
       {},
       "ns",
       "CLOCK_MONOTONIC at which the motion begins"},
      {"em_rate_hz", 40.0, false, 1, 1000, {}, "Hz", "measurements of the tracker"},
      {"lambda_mm", 4.0, false, 0, 100, {}, "mm", "amplitude of the position noise, Eq. (19)"},
      {"psi_deg", 3.0, false, 0, 180, {}, "deg", "angle of the tangent noise, Eq. (20)"},
      {"em_latency_ms", 12.0, false, 0, 10000, {}, "ms", "from measurement to delivery"},
      {"frame_rate_hz", 30.0, false, 0.1, 200, {}, "Hz", "exposures of each fluoroscope"},
      {"image_latency_ms", 8.0, false, 0, 10000, {}, "ms", "from exposure to delivery"},
      {"cnr", 2.7, false, 0.1, 1e6, {}, "", "contrast of the catheter to the noise of one pixel"},
      {"speed_mm_s", 20.0, false, 0, 500, {}, "mm/s", "greatest speed of the catheters along the vessel"},
      {"control_folder",
       std::string(),
       false,
       -kNoLimit,
       kNoLimit,
       {},
       "",
       "where sockets for faults on request are bound; empty = none"},
  };
}

std::unique_ptr<EmSource> make_simulation_em_source(const RoomDescription& room,
                                                    const DriverSettings& settings) {
  return std::make_unique<SimulatedEmSource>(room, settings);
}

std::unique_ptr<ImageSource> make_simulation_image_source(const RoomDescription& room,
                                                          const DriverSettings& settings, int camera_index) {
  return std::make_unique<SimulatedImageSource>(room, settings, camera_index);
}

}  // namespace tubed
