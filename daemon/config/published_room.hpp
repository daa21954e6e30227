// What is published of a room besides its shapes, out of its description.
#pragma once

#include <optional>

#include "daemon/estimator/estimator_settings.hpp"
#include "daemon/estimator/reference/em_reference.hpp"
#include "daemon/publishing/published_values.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// What TubeIdentity says of an instrument of `room` that is tracked in `mode`; the digest of the
/// configuration and the tracker are left empty.
TubeIdentityValues identity_of(const RoomDescription& room, const InstrumentDescription& instrument,
                               EstimatorMode mode);

/// Fills `values` but for its sequence_number with the instrument's coils of one measurement, in the
/// tracker's frame as it was registered. `placement`: see EmReference::take(); nothing: no coil has a pose.
void fill_coils(const InstrumentDescription& instrument, const EmFrame& frame,
                const std::optional<EmPlacement>& placement, EmSamplesValues& values);

}  // namespace tubed
