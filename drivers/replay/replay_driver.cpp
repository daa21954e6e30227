#include "drivers/replay/replay_driver.hpp"

#include <limits>

#include "drivers/replay/replay_em_source.hpp"
#include "drivers/replay/replay_image_source.hpp"

namespace tubed {

std::vector<KeyDescription> replay_settings() {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return {
      key::required(key::text("folder", "", {}, "sequence folder to play back"), "\"/path/to/a/sequence\""),
      key::boolean("loop", false, "begin again at the end; otherwise the source ends"),
      key::integer("start_monotonic_ns", 0, "ns", {0, kNoLimit},
                   "CLOCK_MONOTONIC at time 0 of the sequence; 0 = 300 ms after its first source has opened"),
      key::integer("memory_limit_mb", 2048, "MB", {1, 1e6},
                   "refuse recordings whose decoded images need more")};
}

DriverDescription replay_driver() {
  DriverDescription driver{
      "replay",
      "a sequence folder played back in real time",
      Origin::kReplayed,
      replay_settings(),
      [](const SourceContext& context) {
        return make_replay_em_source(context.room, context.settings_with_paths({"folder"}));
      },
      [](const SourceContext& context, int camera_index) {
        return make_replay_image_source(context.room, context.settings_with_paths({"folder"}), camera_index);
      }};
  driver.gives_orientation = true;
  return driver;
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
