// A configuration file read again while the daemon runs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/config/configuration.hpp"

namespace tubed {

/// What a reload came to, in lines for the log.
struct ReloadOutcome {
  bool is_taken = false;             ///< false: the file is wrong and nothing was changed
  std::string log_level;             ///< to be used from now on
  std::vector<std::string> notices;  ///< what was wrong, or what changes only with a restart
};

/// The file of a running daemon as it was when it was read last.
class ReloadableConfiguration {
 public:
  /// `running` outlives this object.
  explicit ReloadableConfiguration(const Configuration& running);

  /// Reads the file again. daemon.log_level changes while the daemon runs; every other key is part of what
  /// the pipeline was built from, and of TubeIdentity: it is named as waiting for a restart. Never throws
  /// because of the file.
  ReloadOutcome reload();

 private:
  std::filesystem::path file_;
  std::string log_level_;
  std::string running_text_;  ///< empty when the file had changed before it could be kept
};

}  // namespace tubed
