// Random numbers as a pure function of what they are for.
#pragma once

#include <cstdint>

namespace tubed {

/// Scatters the bits of a counter: SplitMix64's finaliser (Steele, Lea, Flood 2014).
constexpr std::uint64_t scattered_bits(std::uint64_t counter) {
  std::uint64_t z = counter + 0x9E3779B97F4A7C15;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

/// A key for one purpose from a seed and what tells the purpose apart.
constexpr std::uint64_t noise_key(std::int64_t seed, std::uint64_t purpose, std::uint64_t index) {
  return scattered_bits(scattered_bits(scattered_bits(static_cast<std::uint64_t>(seed)) ^ purpose) ^ index);
}

/// Uniform in [0, 1).
constexpr double unit_noise(std::uint64_t key) {
  return static_cast<double>(scattered_bits(key) >> 11) * 0x1.0p-53;
}

}  // namespace tubed
