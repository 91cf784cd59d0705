// Deterministic pseudo-random numbers: integer hashes, and value noise computed from them. Every
// machine computes the same bits.
#pragma once
#include <cmath>
#include <cstdint>

#include "common/base/math/splitmix64.h"

namespace fivepipe::capture {

using base::splitmix64;

// Returns a number that is uniform in [0, 1).
inline float unit_hash(std::uint64_t key) {
  return float(splitmix64(key) >> 40) * (1.0f / 16777216.0f);
}
// Returns a number, uniform in [0, 1), for a point of the integer lattice.
inline float lattice(std::uint64_t seed, std::int64_t x, std::int64_t y, std::int64_t z) {
  return unit_hash(seed + std::uint64_t(x) * 0x8da6b343u + std::uint64_t(y) * 0xd8163841u +
                   std::uint64_t(z) * 0xcb1ab31fu);
}

// Value noise of wavelength 1, in [0, 1]; continuous with its first derivative.
inline float value_noise(std::uint64_t seed, float x, float y, float z = 0) {
  const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  const auto smooth = [](float t) { return t * t * (3 - 2 * t); };
  const float u = smooth(x - fx), v = smooth(y - fy), w = smooth(z - fz);
  const auto ix = std::int64_t(fx), iy = std::int64_t(fy), iz = std::int64_t(fz);
  const auto layer = [&](std::int64_t k) {
    const float a = lattice(seed, ix, iy, k) * (1 - u) + lattice(seed, ix + 1, iy, k) * u;
    const float b = lattice(seed, ix, iy + 1, k) * (1 - u) + lattice(seed, ix + 1, iy + 1, k) * u;
    return a * (1 - v) + b * v;
  };
  return w == 0 ? layer(iz) : layer(iz) * (1 - w) + layer(iz + 1) * w;
}

// Four octaves of value noise in [0, 1]; each has half the amplitude and twice the frequency of the
// one before.
inline float fractal_noise(std::uint64_t seed, float x, float y, float z = 0) {
  float sum = 0, weight = 0.5f, scale = 1;
  for (int octave = 0; octave < 4; ++octave, weight *= 0.5f, scale *= 2)
    sum += weight * value_noise(seed + std::uint64_t(octave), x * scale, y * scale, z * scale);
  return sum / 0.9375f;
}

}  // namespace fivepipe::capture
