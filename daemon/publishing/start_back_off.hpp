// How long a daemon that cannot start waits before it tries again.
#pragma once

#include <chrono>
#include <filesystem>

namespace tubed {

/// More starts than that are not counted.
inline constexpr unsigned kMaxCountedStarts = 8;

/// Of the start after so many in a row that published nothing: none after none, then 0.2 s, doubled up to 2
/// s.
std::chrono::milliseconds back_off_after(unsigned failed_starts);

/// Where a service manager of systemd keeps what outlives a process: RUNTIME_DIRECTORY; empty when there is
/// none.
std::filesystem::path runtime_directory_of_environment();

/// Counts starts that have not published yet, in a file that outlives the process. systemd 252 restarts after
/// the same time for ever (its RestartSteps= came with 254), five times a second to bring back a daemon that
/// was killed; one that cannot start at all would fill the journal. Without a folder it counts nothing.
class StartBackOff {
 public:
  explicit StartBackOff(const std::filesystem::path& folder);

  /// Counts this start; how many before it, in a row, have failed. What cannot be read counts as none.
  unsigned begin();

  /// This start has published, or was asked to end: the next one waits for nothing. The main or the
  /// publisher's thread, one at a time.
  void succeed() const noexcept;

 private:
  std::filesystem::path file_;  ///< empty: there is no service manager
};

}  // namespace tubed
