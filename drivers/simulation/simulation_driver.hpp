// The driver "simulation": a catheter in an aortic arch, seen by a tracker and by fluoroscopes. Needs no
// hardware.
#pragma once

#include <memory>
#include <vector>

#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// The keys of the table [simulation].
std::vector<KeyDescription> simulation_settings();

/// This driver as the registry has it.
DriverDescription simulation_driver();

/// Measures the coils of all instruments of the room, in the tracker's frame.
std::unique_ptr<EmSource> make_simulation_em_source(const RoomDescription& room,
                                                    const DriverSettings& settings);

/// The view of room.cameras[camera_index].
std::unique_ptr<ImageSource> make_simulation_image_source(const RoomDescription& room,
                                                          const DriverSettings& settings, int camera_index);

}  // namespace tubed
