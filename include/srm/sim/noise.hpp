// Noise of a sensor, the same on every machine: a value follows from seed, channel and sample
// alone.
//
// The sum of twelve uniform numbers less six has mean 0 and variance 1, is close to Gaussian, and
// never leaves +-6: a margin of six times the rms value is sure. Integers come from splitmix64
// (G. Steele, D. Lea, C. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014), so
// no library function decides the digits.
#pragma once

#include <cstdint>

namespace srm {

/// The greatest magnitude of `noise`, in parts of its rms value.
inline constexpr double noise_peak = 6;

constexpr std::uint64_t splitmix64(std::uint64_t z) {
  z += 0x9E3779B97F4A7C15;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
  return z ^ (z >> 31);
}

/// Noise of unit rms value of a channel at a sample.
constexpr double noise(int seed, int channel, long sample) {
  std::uint64_t z = splitmix64(splitmix64(static_cast<std::uint64_t>(seed)) +
                               static_cast<std::uint64_t>(channel));
  z = splitmix64(z + static_cast<std::uint64_t>(sample));
  double sum = -6;
  for (int word = 0; word < 3; ++word) {
    z = splitmix64(z);
    for (int shift = 0; shift < 64; shift += 16) {
      sum += (static_cast<double>(z >> shift & 0xFFFF) + 0.5) / 65536;
    }
  }
  return sum;
}

}  // namespace srm
