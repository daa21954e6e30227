// What a chain of lines next to each other does with one of them: spread it to the next, and normalise it.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>

namespace tubed {

/// The first `states` of a row, whatever they are together, become 1 together.
template <typename Row>
void normalise(Row& row, int states) {
  Eigen::Map<Eigen::ArrayXf> used(row.data(), states);
  used *= 1.0F / std::max(used.sum(), 1e-30F);
}

/// `to` is `from` spread by a symmetric kernel of which `kernel` is one half, its middle first; beyond the
/// first `states` there is nothing. Without a branch, so that a compiler takes several states at once.
template <std::size_t kStates, std::size_t kWeights>
void convolve(const std::array<float, kStates>& from, const std::array<float, kWeights>& kernel, int states,
              std::array<float, kStates>& to) {
  constexpr std::size_t kReach = kWeights - 1;
  std::array<float, kStates + 2 * kReach> padded{};
  std::copy_n(from.begin(), states, padded.begin() + kReach);
  for (std::size_t k = 0; k < static_cast<std::size_t>(states); ++k) {
    float sum = kernel[0] * padded[k + kReach];
    for (std::size_t j = 1; j <= kReach; ++j) {
      sum += kernel[j] * (padded[k + kReach - j] + padded[k + kReach + j]);
    }
    to[k] = sum;
  }
}

}  // namespace tubed
