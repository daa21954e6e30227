// Writes estimates as rows of "Estimates" of the sequence format: every 1 mm from the tip.
#pragma once

#include <cstdint>
#include <ostream>

#include "idl/estimate.hpp"

namespace tubed {

/// The header line.
void write_estimate_header(std::ostream& out);

/// All rows of one estimate under `frame`: centreline from the spline, sigma interpolated between the points.
/// An estimate without a shape becomes one row with the frame and the validity alone, so that nothing is
/// lost.
void write_estimate_rows(std::ostream& out, std::uint32_t frame, const TubeEstimate& estimate);

}  // namespace tubed
