// The driver "replay": a sequence folder played back in real time, as tracker and as fluoroscope.
#pragma once

#include <memory>
#include <vector>

#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// The keys of the table [replay].
std::vector<KeyDescription> replay_settings();

/// This driver as the registry has it.
DriverDescription replay_driver();

/// All measurements of em.csv, none lost and in order, each at start + t_s and never earlier. Make all
/// sources of a folder before the first is opened: they share one start.
std::unique_ptr<EmSource> make_replay_em_source(const RoomDescription& room, const DriverSettings& settings);

/// The exposures of the sequence's camera that bears the same name as room.cameras[camera_index]; open()
/// fails when there is none or its size differs. A late reader gets the newest exposure due; older ones are
/// left out.
std::unique_ptr<ImageSource> make_replay_image_source(const RoomDescription& room,
                                                      const DriverSettings& settings, int camera_index);

}  // namespace tubed
