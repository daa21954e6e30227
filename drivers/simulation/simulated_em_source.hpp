#pragma once

#include <chrono>
#include <string>

#include "drivers/laboratory/simulated_tracker.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "drivers/simulation/fault_socket.hpp"
#include "drivers/simulation/sample_clock.hpp"

namespace tubed {

/// A tracker that measures the coils of all simulated catheters, with the errors of the preset or, for
/// "arch", the noise of Eq. (19)-(20). Called by the EM acquisition thread. What measurement k says is a pure
/// function of the settings and k. A late reader gets every measurement in order; those of a stall are lost.
class SimulatedEmSource final : public EmSource {
 public:
  SimulatedEmSource(const RoomDescription& room, const DriverSettings& settings);

  OpenResult open() override;
  void wait(MonotonicTime deadline) noexcept override;
  ReadOutcome read(EmFrame& frame) noexcept override;
  void close() noexcept override;

 private:
  void measure(std::int64_t k, EmFrame& frame) const noexcept;
  void spoil(EmFrame& frame) const noexcept;

  SimulatedWorld world_;
  SampleClock clock_;
  std::chrono::nanoseconds stamp_error_;  ///< of the preset's tracker and of mistakes
  SimulatedTracker tracker_;
  std::string control_folder_;
  FaultSocket control_;
  Faults faults_;
  std::int64_t next_ = 0;   ///< measurement to deliver next
  std::int64_t shown_ = 0;  ///< measurement whose poses were delivered last: a stuck tracker repeats it
  bool is_open_ = false;
};

}  // namespace tubed
