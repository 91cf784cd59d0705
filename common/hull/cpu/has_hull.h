// Whether silhouettes have a common point at all.
#pragma once
#include <span>

#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::hull {

// Returns true if a ray from the camera with the fewest object pixels meets the hull. Tests the
// rays through every fourth pixel of its image, in both directions, so that a hull which is
// narrower there can be missed. `hull` was assigned these silhouettes; returns false if there is
// none.
bool has_hull(CpuHull& hull, std::span<const Silhouette> silhouettes);

// What to tell the user if every camera has object pixels and there is no hull.
inline constexpr const char* kNoCommonPoint =
    "every camera has object pixels, but no point of volume_m is inside all silhouettes: the "
    "objects are outside volume_m, a pose is wrong, cameras are exchanged, or the videos do not "
    "start together";

}  // namespace fivepipe::hull
