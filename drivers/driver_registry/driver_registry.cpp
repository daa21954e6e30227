#include "drivers/driver_registry/driver_registry.hpp"

#include "drivers/aurora_can/aurora_can_driver.hpp"
#include "drivers/aurora_serial/aurora_serial_driver.hpp"
#include "drivers/image_shm/image_shm_driver.hpp"
#include "drivers/replay/replay_driver.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

namespace {

/// The settings with the path under `key` made relative to the file that names it, wherever the daemon was
/// started. An empty path stays empty.
DriverSettings with_resolved_path(const SourceContext& context, const std::string& key) {
  const std::filesystem::path path = context.settings.get<std::string>(key);
  if (path.empty()) {
    return context.settings;
  }
  return context.settings.with(key, (context.configuration_folder / path).lexically_normal().string());
}

DriverSettings simulation_paths(const SourceContext& context) {
  SourceContext resolved = context;
  resolved.settings = with_resolved_path(context, "control_folder");
  return with_resolved_path(resolved, "vessel");
}

DriverDescription aurora_serial() {
  DriverDescription driver{"aurora-serial",
                           "an NDI Aurora at a serial port, em.device",
                           Origin::kDevice,
                           aurora_serial_settings(),
                           [](const SourceContext& context) {
                             SourceContext resolved = context;
                             resolved.settings = with_resolved_path(context, "tool_folder");
                             return make_aurora_serial_em_source(
                                 context.room, with_resolved_path(resolved, "trace_folder"), context.device);
                           },
                           {}};
  driver.needs_device = true;
  driver.finds_coils_by_port = true;
  return driver;
}

DriverDescription aurora_can() {
  DriverDescription driver{"aurora-can",
                           "an NDI Aurora behind a gateway on a CAN bus, em.device",
                           Origin::kDevice,
                           aurora_can_settings(),
                           [](const SourceContext& context) {
                             return make_aurora_can_em_source(context.room, context.settings, context.device);
                           },
                           {}};
  driver.needs_device = true;
  return driver;
}

DriverDescription replay() {
  return {"replay",
          "a sequence folder played back in real time",
          Origin::kReplayed,
          replay_settings(),
          [](const SourceContext& context) {
            return make_replay_em_source(context.room, with_resolved_path(context, "folder"));
          },
          [](const SourceContext& context, int camera_index) {
            return make_replay_image_source(context.room, with_resolved_path(context, "folder"),
                                            camera_index);
          }};
}

DriverDescription image_shm() {
  return {"image_shm",
          "images of a frame grabber's program on this machine, through shared memory",
          Origin::kDevice,
          image_shm_settings(),
          {},
          [](const SourceContext& context, int camera_index) {
            const CameraCalibration& camera = context.room.cameras.at(static_cast<std::size_t>(camera_index));
            return make_shm_image_source(
                context.room, context.settings,
                image_shm_socket(context.device, camera.name, context.configuration_folder), camera_index);
          }};
}

DriverDescription simulation() {
  return {"simulation",
          "a catheter in an aortic arch, without any hardware",
          Origin::kSimulated,
          simulation_settings(),
          [](const SourceContext& context) {
            return make_simulation_em_source(context.room, simulation_paths(context));
          },
          [](const SourceContext& context, int camera_index) {
            return make_simulation_image_source(context.room, simulation_paths(context), camera_index);
          }};
}

}  // namespace

const std::vector<DriverDescription>& drivers() {
  static const std::vector<DriverDescription> all = {aurora_serial(), aurora_can(), replay(), image_shm(),
                                                     simulation()};
  return all;
}

}  // namespace tubed
