#include "drivers/replay/replay_driver.hpp"

#include <limits>

#include "drivers/replay/replay_em_source.hpp"
#include "drivers/replay/replay_image_source.hpp"

namespace tubed {

std::vector<SettingDescription> replay_settings() {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return {
      {"folder", std::string(), true, -kNoLimit, kNoLimit, {}, "", "sequence folder to play back"},
      {"loop",
       false,
       false,
       -kNoLimit,
       kNoLimit,
       {},
       "",
       "begin again at the end; otherwise the source ends"},
      {"start_monotonic_ns",
       std::int64_t{0},
       false,
       0,
       kNoLimit,
       {},
       "ns",
       "CLOCK_MONOTONIC at time 0 of the sequence; 0 = 300 ms after its first source has opened"},
      {"memory_limit_mb",
       std::int64_t{2048},
       false,
       1,
       1e6,
       {},
       "MB",
       "refuse recordings whose decoded images need more"},
  };
}

std::unique_ptr<EmSource> make_replay_em_source(const RoomDescription& /*room*/,
                                                const DriverSettings& settings) {
  return std::make_unique<ReplayEmSource>(settings);
}

std::unique_ptr<ImageSource> make_replay_image_source(const RoomDescription& room,
                                                      const DriverSettings& settings, int camera_index) {
  return std::make_unique<ReplayImageSource>(room.cameras.at(static_cast<std::size_t>(camera_index)),
                                             settings);
}

}  // namespace tubed
