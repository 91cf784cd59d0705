// The SIMD kernels of BruteForce.
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/hull/cpu/point_simd.h"

namespace fivepipe::baselines {

// One triangle in one map. A sample's homogeneous pixel relative to the triangle's reference pixel
// is of_1 + base * of_base + side * of_side; pixel p covers [p, p + 1).
struct SampledMap {
  float of_1[3], of_base[3], of_side[3];
  float size[3];                     // sums of the absolute values of these three
  float u0_px, u1_px, v0_px, v1_px;  // bounds of the object pixels, relative to the reference pixel
  std::int32_t first_bit;            // index of the reference pixel in the map's bits
  std::int32_t row_bits;
  const std::uint32_t* bits;
};

// Arrays that the kernels read and write have this many additional elements.
inline constexpr std::size_t kSimdPadding = 16;

// Writes base = x - y * apex_x and side = y of those positions (x, y) whose base is in [0, 1 - y].
// Returns their number.
std::size_t covered_samples(const float* x, const float* y, std::size_t count, float apex_x,
                            float* base, float* side);

void samples_in_hull(std::span<const SampledMap> maps, const float* base, const float* side,
                     std::size_t count, hull::InHull* verdicts);

}  // namespace fivepipe::baselines
