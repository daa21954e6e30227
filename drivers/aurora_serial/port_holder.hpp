// Which other program has a serial port open.
#pragma once

#include <sys/types.h>

#include "drivers/aurora/words.hpp"
#include "drivers/aurora_serial/system_files.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

struct PortHolder {
  int process = 0;  ///< 0: nobody
  BoundedText<32> program;

  friend bool operator==(const PortHolder&, const PortHolder&) = default;
};

/// The program of `process`; its name is empty when it has ended.
PortHolder program_of(const SystemPlaces& places, int process) noexcept;

/// Looks for another process that has a device open, through /proc/*/fd, a piece at a time: a whole look may
/// take 20 ms where much is running. It sees the processes of its own user, or all for root. One thread;
/// allocates nothing; never waits for a device or a file system.
class PortHolderSearch {
 public:
  explicit PortHolderSearch(const SystemPlaces& places) noexcept : places_(places) {}

  /// Goes on where the last call stopped, until `deadline`, for the character device `device` (st_rdev).
  void look(dev_t device, MonotonicTime deadline) noexcept;
  /// Of the newest look that came to its end.
  [[nodiscard]] const PortHolder& found() const noexcept { return found_; }
  /// What was found is forgotten, and the next look begins anew.
  void begin() noexcept;

 private:
  bool next_process() noexcept;
  [[nodiscard]] bool is_device(const char* entry, dev_t device) const noexcept;

  const SystemPlaces& places_;
  FolderEntries processes_;
  FolderEntries files_;  ///< open ones of process_
  int process_ = 0;
  PortHolder seen_;  ///< by the look that goes on
  PortHolder found_;
};

}  // namespace tubed
