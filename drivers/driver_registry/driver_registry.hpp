// The drivers this build has. A new driver is a folder and one row in driver_registry.cpp.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
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
};

/// One row of the registry.
struct DriverDescription {
  std::string name;                          ///< what "driver" says, and the name of the driver's table
  std::string meaning;                       ///< one line for a person
  Origin origin = Origin::kDevice;           ///< where its measurements come from
  std::vector<SettingDescription> settings;  ///< the keys of its table
  /// Empty: the driver has no EM tracker.
  std::function<std::unique_ptr<EmSource>(const SourceContext&)> make_em_source;
  /// Empty: the driver has no fluoroscope. `camera_index` counts from 0 in room.cameras.
  std::function<std::unique_ptr<ImageSource>(const SourceContext&, int camera_index)> make_image_source;
  bool needs_device = false;         ///< "device" of [em] or [[camera]] has to be given
  bool finds_coils_by_port = false;  ///< every [[instrument.coil]] has to say its port and channel
};

/// All drivers of this build; made once, at the first call.
const std::vector<DriverDescription>& drivers();

/// The driver of that name in `available`, nullptr when there is none.
const DriverDescription* find_driver(const std::vector<DriverDescription>& available, std::string_view name);

}  // namespace tubed
