// Everything one configuration file says, checked: what the daemon is built from.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config/configuration_error.hpp"
#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/image/frangi_settings.hpp"
#include "daemon/pipeline/pipeline_settings.hpp"
#include "daemon/publishing/dds_settings.hpp"
#include "daemon/publishing/shm_settings.hpp"
#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/room.hpp"
#include "idl/geometry/c_arm.hpp"
#include "idl/settings/bound_key.hpp"

namespace tubed {

/// Which driver one source uses and with what.
struct SourceChoice {
  std::string driver;       ///< a name of drivers/driver_registry
  std::string device;       ///< as in the file, for the driver to understand; empty when not given
  DriverSettings settings;  ///< the driver's own table, defaults filled in
};

/// A plain value; load_configuration() makes it, nothing changes it afterwards.
struct Configuration {
  std::filesystem::path file;      ///< where it was read from, as it was named
  std::string digest;              ///< SHA-256 of the file's bytes, 64 hexadecimal digits, lower case
  std::string log_level = "info";  ///< trace, debug, info, warning, error, critical

  PipelineSettings pipeline;
  DdsSettings dds;
  FilePosition security_position;  ///< of dds.security, for what is wrong with the files there
  ShmSettings shm;
  FrangiSettings frangi;
  RoomDescription room;

  SourceChoice em_source;
  /// [camera.c_arm]: one each of room.cameras, same order; nothing where a camera has a pose of its own.
  std::vector<std::optional<CArm>> c_arms;
  std::vector<SourceChoice> image_sources;    ///< one each of room.cameras, same order
  std::vector<EstimatorSettings> estimators;  ///< one each of room.instruments, same order

  /// Allowed, but worth a line in the log: each starts with file:line:column and names the key.
  std::vector<std::string> warnings;
};

/// Keys of [daemon].
inline BoundKeys<Configuration> log_keys() {
  BoundKey<Configuration> level = key::word("log_level", &Configuration::log_level,
                                            {{"trace", "trace"},
                                             {"debug", "debug"},
                                             {"info", "info"},
                                             {"warning", "warning"},
                                             {"error", "error"},
                                             {"critical", "critical"}},
                                            "the least important messages that are logged");
  level.key.takes_effect = TakesEffect::kAtOnce;
  return {level};
}

}  // namespace tubed
