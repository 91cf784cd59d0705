// SIMD membership test of many points, in double with certified error bounds, for Limits::all.
// HullQuery::contains() decides the points that the bounds leave uncertain.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::hull {

// A camera of a hull that is not empty, in the layout of the kernel. Pixel p covers [p, p + 1).
struct PointSimdCamera {
  double camera_from_world[12];  // rows of rotation and translation
  double fx_px, fy_px, cx_px, cy_px, u0_px, u1_px, v0_px, v1_px;  // bounds of the object pixels
  double translation_m;        // sum of the absolute values of its components
  const std::int8_t* extents;  // bytes of Quadrant::right_down
  double stored_u0_px, stored_v0_px, stride;
};
// Returns the cameras of a hull that is not empty and has Quadrant::right_down of every skip map.
// The result refers to the skip maps and is valid until CpuHull::assign().
std::vector<PointSimdCamera> point_simd_cameras(const CpuHull& hull);

enum class InHull : std::uint8_t { no = 0, yes = 1, uncertain = 2 };
// Writes the verdict on each point to `verdicts`, which has room for p_world_m.size() entries. Up
// to seven points at the end, which do not fill a vector, are uncertain.
void contains_simd(std::span<const PointSimdCamera> cameras,
                   std::span<const Eigen::Vector3d> p_world_m, InHull* verdicts);

}  // namespace fivepipe::hull
