// What TubeHealth says of coils against images, as the daemon's own values.
#pragma once

#include <string>
#include <vector>

#include "TubeHealth.h"
#include "TubeIdentity.h"
#include "drivers/interface/room.hpp"
#include "idl/estimate.hpp"

namespace tubed {

EmImageAgreement agreement_of(const tubed_EmImageAgreement& wire);

/// The part of an instrument that TubeIdentity tells: id, sizes, arc lengths, each coil's number from the tip
/// in the place of its sensor number, which is not told. nullptr: without coils.
InstrumentDescription instrument_of(const tubed_TubeIdentity* identity);

/// The views, by name alone; nullptr: none.
std::vector<CameraCalibration> cameras_of(const tubed_TubeIdentity* identity);

/// describe_agreement() of what was published.
std::string agreement_line(const tubed_EmImageAgreement& wire, const tubed_TubeIdentity* identity);

}  // namespace tubed
