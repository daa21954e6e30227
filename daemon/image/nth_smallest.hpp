// The element of a rank, without branches that a processor cannot foresee.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace tubed {

/// What std::nth_element would put at `rank` (0: the smallest) of at most kMost numbers, sooner for some
/// dozens of noisy ones: each round copies those below and those above a value that is tried to where they
/// belong, whichever they are, and counts. Precondition: rank < values.size() <= kMost, no NaN. Changes
/// `values`.
template <std::size_t kMost>
float nth_smallest(std::span<float> values, std::size_t rank) {
  std::array<float, kMost> greater;
  while (true) {
    const std::size_t count = values.size();
    const float first = values[0];
    const float middle = values[count / 2];
    const float last = values[count - 1];
    const float tried = std::max(std::min(first, middle), std::min(std::max(first, middle), last));
    std::size_t below = 0;
    std::size_t above = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const float value = values[i];
      values[below] = value;  // nothing is lost: below <= i
      greater[above] = value;
      below += value < tried ? 1 : 0;
      above += value > tried ? 1 : 0;
    }
    if (rank < below) {
      values = values.first(below);
    } else if (rank < count - above) {
      return tried;
    } else {
      rank -= count - above;
      std::copy_n(greater.begin(), above, values.begin());
      values = values.first(above);
    }
  }
}

}  // namespace tubed
