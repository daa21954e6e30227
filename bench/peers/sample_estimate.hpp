// The sample that all ways carry: as full as a published shape gets, 10 KB.
#pragma once

#include "TubeEstimate.h"
#include "idl/estimate.hpp"

namespace tubed {

/// 128 points, 26 coefficients, 5 coils.
TubeEstimate sample_estimate();

/// The same as it is on the wire.
void fill(tubed_TubeEstimate& wire);

}  // namespace tubed
