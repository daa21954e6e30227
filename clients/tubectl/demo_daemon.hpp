// The daemon that a demonstration runs: a real `tubed` process with a configuration and a folder of its own.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace tubed {

/// What the demonstration's configuration is made from.
struct DemoScene {
  int domain = 0;             ///< private DDS domain
  std::int64_t epoch_ns = 0;  ///< CLOCK_MONOTONIC at which the simulated motion begins
  std::int64_t seed = 1;
  std::string preset = "arch";  ///< of the simulation
};

/// The configuration as TOML: one simulated catheter in the views of the preset, tracked twice: "cath-1" from
/// coils and images, "cath-1-em" from the coils alone.
std::string demo_configuration(const DemoScene& scene, const std::filesystem::path& folder);

/// Starts `tubed` and ends it with the object; its folder goes with it. One thread.
class DemoDaemon {
 public:
  /// Throws std::runtime_error with what to do when no tubed is found beside this program, in ../sbin or in
  /// PATH, or it cannot be started.
  explicit DemoDaemon(const DemoScene& scene);
  ~DemoDaemon();
  DemoDaemon(const DemoDaemon&) = delete;
  DemoDaemon& operator=(const DemoDaemon&) = delete;

  /// False once the process has ended by itself.
  bool is_running();
  /// Sends a command to a simulated source: `source` is "em" or "image-A". False when it was not taken.
  bool command(const std::string& source, const std::string& words) const;
  /// What the daemon logged so far, its last `lines` lines.
  [[nodiscard]] std::vector<std::string> log_tail(std::size_t lines) const;

  [[nodiscard]] const std::string& configuration() const { return configuration_; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
  std::string configuration_;
  pid_t process_ = -1;
};

}  // namespace tubed
