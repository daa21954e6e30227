// Faults on request: what a simulated source is told to do wrong while it runs.
#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include "drivers/interface/em_source.hpp"
#include "drivers/interface/source.hpp"

namespace tubed {

/// What is wrong at present.
struct Faults {
  MonotonicTime stalled_until{};  ///< nothing is delivered before
  bool fluoroscopy_off = false;
  bool black = false;
  double pan_mm = 0;  ///< of the table; no image says so
  bool stuck = false;
  std::array<bool, kMaxTrackerCoils> lost{};          ///< by sensor - 1
  std::array<double, kMaxTrackerCoils> outlier_mm{};  ///< by sensor - 1
};

/// Applies one command ("lose-coil 2") given at `now`; false, without any change, for one that is not
/// understood. Never allocates.
bool apply_fault(std::string_view command, MonotonicTime now, Faults& faults) noexcept;

/// A Unix datagram socket that takes one command a datagram. open() and close() may allocate, poll() never
/// does.
class FaultSocket {
 public:
  FaultSocket() = default;
  ~FaultSocket() { close(); }
  FaultSocket(const FaultSocket&) = delete;
  FaultSocket& operator=(const FaultSocket&) = delete;

  /// Binds `folder`/`name`, replacing what an earlier run left there.
  OpenResult open(const std::filesystem::path& folder, const std::string& name);
  /// Applies all commands that have come. Does nothing when not open.
  void poll(MonotonicTime now, Faults& faults) noexcept;
  void close() noexcept;

 private:
  int socket_ = -1;
  std::filesystem::path path_;
};

}  // namespace tubed
