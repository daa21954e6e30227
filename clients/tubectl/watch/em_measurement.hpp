// What a daemon publishes of coils, as a recording has it.
#pragma once

#include "drivers/interface/room.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "idl/dds_contract.hpp"

namespace tubed {

/// The samples come in the instrument's order, a coil of it may be any sensor. Directions are published
/// toward the tip, however the coil is mounted; in a recording they are as measured.
SequenceMeasurement measurement_of(const tubed_EmSamples& samples, const InstrumentDescription& instrument,
                                   double t_s);

}  // namespace tubed
