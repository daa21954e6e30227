// A configuration file read again while the daemon runs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"
#include "idl/geometry/view_geometry.hpp"

namespace tubed {

/// What a reload came to, in lines for the log.
struct ReloadOutcome {
  bool is_taken = false;             ///< false: the file is wrong and nothing was changed
  std::string log_level;             ///< to be used from now on
  std::vector<std::string> notices;  ///< what was wrong, or what changes only with a restart
  /// Of each camera, intrinsics and pose from now on; empty when none has changed.
  std::vector<ViewGeometry> views;
};

/// The file of a running daemon as it was when it was read last.
class ReloadableConfiguration {
 public:
  /// `running` outlives this object.
  explicit ReloadableConfiguration(const Configuration& running);

  /// Reads the file again. A key that TakesEffect::kAtOnce, as daemon.log_level or the pose of a camera,
  /// changes while the daemon runs; every other key is part of what the pipeline was built from, and of
  /// TubeIdentity: it is named as waiting for a restart, and so are the poses of cameras that are not those
  /// the daemon was started with. Never throws because of the file.
  ReloadOutcome reload();

 private:
  std::filesystem::path file_;
  std::string log_level_;
  std::string running_text_;  ///< empty when the file had changed before it could be kept
  std::vector<std::string> camera_names_;
  std::vector<ViewGeometry> views_;  ///< as they are now
};

}  // namespace tubed
