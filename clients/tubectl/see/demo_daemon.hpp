// The daemon that a demonstration runs: a real `tubed` process with a configuration and a folder of its own.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/tubectl/see/child_process.hpp"

namespace tubed {

/// How the simulated coils come to the daemon.
enum class DemoTracker {
  kSimulation,    ///< as measurements, inside the daemon
  kAuroraSerial,  ///< an emulated NDI Aurora at a pseudo-terminal, read by the real driver
  kAuroraCan,     ///< the same Aurora, read by a gateway, whose CAN frames the real driver reads
};

/// What the demonstration's configuration is made from.
struct DemoScene {
  int domain = 0;             ///< private DDS domain
  std::int64_t epoch_ns = 0;  ///< CLOCK_MONOTONIC at which the simulated motion begins
  std::int64_t seed = 1;
  std::string preset = "arch";  ///< of the simulation
  DemoTracker tracker = DemoTracker::kSimulation;
  std::string can_interface;  ///< of kAuroraCan; empty: a socket of the demonstration carries the frames
  std::string can_layout;     ///< of kAuroraCan: can_layout() of this interface
  std::vector<std::string> mistakes;     ///< of the room or its description, as of room_mistakes.hpp
  std::string web;                       ///< ADDRESS:PORT of the page that shows the room; empty: none
  bool shows_images = false;             ///< somebody looks at them
  std::vector<std::string> web_options;  ///< further options of tubed-view
};

/// The configuration as TOML: one simulated catheter in the views of the preset, tracked twice: "cath-1" from
/// coils and images, "cath-1-em" from the coils alone.
std::string demo_configuration(const DemoScene& scene, const std::filesystem::path& folder);

/// A folder that goes with the object.
struct DemoFolder {
  explicit DemoFolder(std::filesystem::path new_path) : path(std::move(new_path)) {}
  ~DemoFolder();
  DemoFolder(const DemoFolder&) = delete;
  DemoFolder& operator=(const DemoFolder&) = delete;

  std::filesystem::path path;
};

/// A program of the demonstration that has ended by itself.
struct EndedProgram {
  std::string name;
  std::vector<std::string> last_words;
};

/// Starts `tubed`, and the emulated tracker, the gateway and the page if there are to be, and ends them with
/// the object; its folder goes with it. One thread.
class DemoDaemon {
 public:
  /// Throws std::runtime_error with what to do when no tubed (or, for a page, no tubed-view) is found beside
  /// this program, in ../sbin or in PATH, or it cannot be started, or the CAN interface cannot be used.
  explicit DemoDaemon(const DemoScene& scene);

  /// What has ended although it should not, with the last `lines` lines of what it printed.
  [[nodiscard]] std::optional<EndedProgram> ended(std::size_t lines);
  /// What the daemon logged so far, its last `lines` lines.
  [[nodiscard]] std::vector<std::string> log_tail(std::size_t lines) const {
    return daemon_->log_tail(lines);
  }
  /// Sends a command to a simulated source: `source` is "em" or "image-A". False when it was not taken.
  bool command(const std::string& source, const std::string& words) const;

  [[nodiscard]] const std::string& configuration() const { return configuration_; }
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_.path; }

 private:
  void start_view(const DemoScene& scene);

  DemoFolder folder_;
  std::string configuration_;
  std::optional<ChildProcess> tracker_;
  std::optional<ChildProcess> gateway_;
  std::optional<ChildProcess> daemon_;
  std::optional<ChildProcess> view_;
};

}  // namespace tubed
