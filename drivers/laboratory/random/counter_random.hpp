// Random numbers as a pure function of what they are for: the same seed and counters give the same number in
// every process and in any order.
#pragma once

#include <cstdint>

namespace tubed {

/// Bits of one draw: SplitMix64's finaliser (Steele, Lea, Flood 2014) chained over the counters.
class CounterRandom {
 public:
  constexpr CounterRandom(std::int64_t seed, std::int64_t stream, std::int64_t index)
      : state_(mix(mix(mix(static_cast<std::uint64_t>(seed)) ^ static_cast<std::uint64_t>(stream)) ^
                   static_cast<std::uint64_t>(index))) {}

  constexpr std::uint64_t bits() {
    state_ += kGoldenGamma;
    return finalise(state_);
  }
  /// Uniform in [0, 1).
  constexpr double unit() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  /// Uniform in [-1, 1).
  constexpr double signed_unit() { return 2 * unit() - 1; }

 private:
  static constexpr std::uint64_t kGoldenGamma = 0x9E3779B97F4A7C15;

  static constexpr std::uint64_t finalise(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
  }
  static constexpr std::uint64_t mix(std::uint64_t z) { return finalise(z + kGoldenGamma); }

  std::uint64_t state_;
};

}  // namespace tubed
