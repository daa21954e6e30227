// A moving field generator and the patient's reference in a simulated run: what the daemon would be told of
// it.
#pragma once

#include <filesystem>
#include <string>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/room.hpp"
#include "drivers/laboratory/simulated_tracker.hpp"

namespace tubed {

/// How the generator moves (drivers/laboratory/tracker/generator_motion.hpp), and what is on the patient.
struct SimulatedReference {
  std::string kind = "none";  ///< "none", "sensor" of 6 degrees of freedom, "coils": two of 5
  double shift_mm = 0;        ///< the generator is pushed so far
  double turn_deg = 0;        ///< and turned
  double at_s = 5;            ///< when
  double drift_mm_s = 0;

  [[nodiscard]] DriverSettings in(const DriverSettings& settings) const;
};

/// Puts the reference into the room: the sensors behind those of the catheters.
void add_reference(const SimulatedReference& reference, RoomDescription& room);

/// Sets the registered pose as a person finds it: the mean of 200 measurements with the generator at rest.
/// Precondition: the world's room has a reference.
ReferenceDescription registered_reference(const SimulatedTracker& tracker, const SimulatedWorld& world);

/// Writes [em.reference] into a file of its own, for the configuration of a daemon. Throws
/// std::runtime_error when it cannot be written.
void write_reference(const ReferenceDescription& reference, const std::filesystem::path& file);

}  // namespace tubed
