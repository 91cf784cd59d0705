// Membership of many points in vector lanes, in double with certified margins; what margins can't
// decide is left to HullQuery::contains. For Limits::all: the first camera that has a point off its
// object removes it.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::hull {

// A camera of the hull, which has object pixels, as lanes read it; pixel p covers [p, p + 1).
struct PointSimdCamera {
  double camera_from_world[12];  // rows of rotation and translation
  double fx_px, fy_px, cx_px, cy_px, u0_px, u1_px, v0_px, v1_px;  // bounds of the object pixels
  double translation_m;                                           // sum of its parts' sizes
  const std::int8_t* extents;  // of Box::right_down, of the stored pixels
  double stored_u0_px, stored_v0_px, stride;
};
std::vector<PointSimdCamera> point_simd_cameras(const CpuHull& hull);

enum class InHull : std::uint8_t { no = 0, yes = 1, uncertain = 2 };
void contains_simd(std::span<const PointSimdCamera> cameras,
                   std::span<const Eigen::Vector3d> p_world_m, InHull* verdicts);

}  // namespace fivepipe::hull
