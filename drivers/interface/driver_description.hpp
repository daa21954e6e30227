// What a driver says of itself: NAME_driver() of the folder drivers/NAME returns it, and the registry has it.
#pragma once

#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/image_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// What a driver is given to make a source from.
struct SourceContext {
  const RoomDescription& room;                 ///< has to outlive the source
  DriverSettings settings;                     ///< the driver's table of the configuration, checked
  std::string device;                          ///< of [em] or [[camera]], as written
  std::filesystem::path configuration_folder;  ///< what relative paths of the settings are relative to

  /// The settings with the paths under `keys` made relative to the file that names them, wherever the daemon
  /// was started. An empty path stays empty.
  [[nodiscard]] DriverSettings settings_with_paths(std::initializer_list<const char*> keys) const {
    DriverSettings resolved = settings;
    for (const char* const key : keys) {
      const std::filesystem::path path = settings.get<std::string>(key);
      if (!path.empty()) {
        resolved = resolved.with(key, (configuration_folder / path).lexically_normal().string());
      }
    }
    return resolved;
  }
};

struct DriverDescription {
  std::string name;                      ///< what "driver" says, and the name of the driver's table
  std::string meaning;                   ///< one line for a person
  Origin origin = Origin::kDevice;       ///< where its measurements come from
  std::vector<KeyDescription> settings;  ///< the keys of its table
  /// Empty: the driver has no EM tracker.
  std::function<std::unique_ptr<EmSource>(const SourceContext&)> make_em_source;
  /// Empty: the driver has no fluoroscope. `camera_index` counts from 0 in room.cameras.
  std::function<std::unique_ptr<ImageSource>(const SourceContext&, int camera_index)> make_image_source;
  bool needs_device = false;         ///< "device" of [em] or [[camera]] has to be given
  bool finds_coils_by_port = false;  ///< every [[instrument.coil]] has to say its port and channel
  bool gives_orientation = false;    ///< its CoilSample has x_axis_em: a sensor can have 6 degrees of freedom
  /// Where the device of a [[camera]] is a socket: its path. Empty: it is none.
  std::function<std::string(const std::string& device, const std::string& camera,
                            const std::filesystem::path& configuration_folder)>
      device_socket{};
  /// Where the driver changes the pictures of a [[camera]] on their way: turns what the file says of the
  /// camera into the camera of what is delivered, and may add to the settings of its source. Returns why they
  /// do not go together, in words for the file's message; empty: they do. Empty: it delivers what it gets.
  std::function<std::string(CameraCalibration& camera, DriverSettings& settings)> deliver_camera{};
};

}  // namespace tubed
