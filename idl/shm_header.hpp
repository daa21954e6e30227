// What a segment says of itself, checked before anything relies on it.
#pragma once

#include <cstddef>

#include "idl/shm_layout.hpp"

namespace tubed {

/// Throws ShmError for a geometry out of the limits.
void check_geometry(const ShmGeometry& geometry);

/// How the segment of `bytes` with this header is divided. Throws ShmError when it is none of this layout or
/// contradicts its size. `header` is the caller's copy: a hostile writer changes its own at any time.
ShmGeometry checked_geometry(const tubed_shm_header& header, std::size_t bytes);

}  // namespace tubed
