// Which tracker and which tools: what the device says of itself.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/interface/bounded_text.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed {

/// A tool in a plug of the tracker. Both coils of a two-coil tool share it.
struct ToolIdentity {
  int port = 0;  ///< counts from 1
  std::uint32_t serial_number = 0;
  BoundedText<20> part_number;

  friend bool operator==(const ToolIdentity&, const ToolIdentity&) = default;
};

/// What the tracker says of itself, in its own words made printable; empty where it says nothing.
struct TrackerIdentity {
  BoundedText<47> firmware;             ///< as "AURORA Rev 008"
  BoundedText<15> api_revision;         ///< as "D.001.007"
  BoundedText<15> control_unit_serial;  ///< of the system control unit (SCU)
  BoundedText<63> field_generator;      ///< with its serial number
  int tool_count = 0;
  std::array<ToolIdentity, kMaxTrackerCoils> tools;

  friend bool operator==(const TrackerIdentity&, const TrackerIdentity&) = default;
};

/// Beside EmSource, for a tracker that says which it is. Called by the source's own thread.
class HasIdentity {
 public:
  virtual ~HasIdentity() = default;
  HasIdentity() = default;
  HasIdentity(const HasIdentity&) = delete;
  HasIdentity& operator=(const HasIdentity&) = delete;

  /// As of the last read(); tools as of the last look at the ports. Never allocates, locks, logs or throws.
  [[nodiscard]] virtual const TrackerIdentity& identity() noexcept = 0;
};

}  // namespace tubed
