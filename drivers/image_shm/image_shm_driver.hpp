// Driver "image_shm": images of a frame grabber's program on the same machine, through shared memory.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "drivers/interface/driver_description.hpp"

namespace tubed {

/// Keys of the table [image_shm].
std::vector<KeyDescription> image_shm_settings();

/// This driver as the registry has it.
DriverDescription image_shm_driver();

/// The socket of a camera: `device` of its [[camera]], relative to `folder`; empty:
/// /run/tubed/image-NAME.sock.
std::string image_shm_socket(const std::string& device, const std::string& camera,
                             const std::filesystem::path& folder);

/// A source for camera `camera_index` of the room. Throws std::runtime_error for a user that does not exist.
std::unique_ptr<ImageSource> make_shm_image_source(const RoomDescription& room,
                                                   const DriverSettings& settings, const std::string& socket,
                                                   int camera_index);

}  // namespace tubed
