// Images of the fluoroscope as they lie in shared memory.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "idl/shm_layout.h"
#include "idl/shm_reader.hpp"

namespace tubed {

/// One image, copied out.
struct RawImage {
  tubed_shm_image head{};
  std::vector<std::uint8_t> pixels;  ///< row by row, no padding; 16 bit in host order; none without radiation
};

/// The newest sample of the reader; nothing when it was overtaken meanwhile or contradicts itself.
/// Precondition: ShmNews::kSample.
std::optional<RawImage> take_image(ShmReader& reader);

}  // namespace tubed
