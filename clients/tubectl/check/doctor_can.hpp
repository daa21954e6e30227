// What the doctor says about a gateway's CAN bus: what was heard in a while, and what that means.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "clients/tubectl/check/doctor_tracker.hpp"
#include "drivers/aurora/can_coil_assembler.hpp"
#include "drivers/aurora_can/can_port.hpp"

namespace tubed {

/// What came within a while.
struct CanHearing {
  static constexpr std::size_t kMaxOtherIds = 8;
  std::string name;  ///< of the interface
  double seconds = 0;
  std::uint64_t frames = 0;                   ///< of a gateway
  std::uint64_t other_frames = 0;             ///< of somebody else
  aurora::CanBase base;                       ///< the identifiers that were listened for
  std::vector<std::uint32_t> other_ids;       ///< of somebody else, in order: the first kMaxOtherIds of them
  std::optional<aurora::CanBase> other_base;  ///< a gateway that says so itself, by its STATUS
  std::uint64_t error_frames = 0;
  CanTrouble trouble;  ///< all that error frames said
  std::uint64_t classic_frames = 0;
  std::uint64_t fd_frames = 0;  ///< with coils
  aurora::CanCoilAssembler::Counts counts;
  std::optional<aurora::CanStatus> status;
  std::optional<aurora::CanMeasurement> newest;
  std::string gone;  ///< why listening ended early; empty mostly
};

/// Listens at `port`, which is open, for `time`; for the coils of sensors 1 to `coil_count` of the
/// gateway at `base`.
CanHearing listen_to_bus(CanPort& port, int coil_count, std::chrono::nanoseconds time,
                         aurora::CanBase base = {});

/// What to say about it. `sensors`: those of the configuration, 1, 2, ...
std::vector<NamedFinding> findings_of(const CanHearing& hearing, const std::vector<int>& sensors);

/// Can the bus of em.device be listened to? Nothing is sent. Nothing for other drivers than aurora-can.
std::vector<NamedFinding> examine_can_port(const Configuration& configuration);

/// May the service use CAN? The installed unit keeps CAN sockets from it until a drop-in lets them in.
/// Nothing where tubed is no service, or the tracker is no CAN interface.
std::vector<NamedFinding> examine_can_sandbox(const Machine& machine, const Configuration& configuration);

/// Listens to it for three seconds, which disturbs neither a daemon nor a gateway; at a socket instead of a
/// bus only while no daemon does.
std::vector<NamedFinding> examine_can_bus(const Configuration& configuration);

}  // namespace tubed
