// Plain values of the daemon into the structs that idlc generates. Pure functions; no allocation, no clock.
#pragma once

#include <span>

#include "EmSamples.h"
#include "TubeEstimate.h"
#include "TubeHealth.h"
#include "TubeIdentity.h"
#include "TubeStatus.h"
#include "daemon/publishing/clock_pair.hpp"
#include "daemon/publishing/published_values.hpp"
#include "idl/estimate.hpp"

namespace tubed {

/// All fields but instrument_id and daemon_start; `now` is the moment before the write.
/// Counts beyond the arrays are cut; array elements beyond the counts are undefined on the wire.
void to_wire(const TubeEstimate& estimate, const ClockPair& now, tubed_TubeEstimate& wire);

/// All fields but instrument_id and daemon_start.
void to_wire(const EmSamplesValues& samples, const ClockPair& now, tubed_EmSamples& wire);

/// All fields but instrument_id and daemon_start.
void to_wire(const InstrumentStatus& status, std::span<const NamedStageReport> stages, const ClockPair& now,
             tubed_TubeStatus& wire);

/// All fields but instrument_id and daemon_start.
void to_wire(const InstrumentHealthValues& health, std::span<const NamedStageReport> stages,
             const ClockPair& now, tubed_TubeHealth& wire);

/// All fields but daemon_start.
void to_wire(const TubeIdentityValues& identity, tubed_TubeIdentity& wire);

}  // namespace tubed
