// The large scales of a picture.
#pragma once

#include <span>
#include <vector>

namespace tubed {

/// `image` (row by row) blurred by about `sigma_px`: averaged over blocks, blurred there, interpolated.
/// Pixels whose `weight` is 0 take no part; where there is no weight around, the result is 0. For
/// construction: it allocates.
std::vector<float> large_scale(std::span<const float> image, std::span<const float> weight, int width,
                               int height, double sigma_px);

}  // namespace tubed
