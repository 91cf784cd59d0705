// Whether silhouettes have a common point at all.
#pragma once
#include <span>

#include "common/hull/cpu/cpu_hull.h"

namespace fivepipe::hull {

// Returns true if the ray through an object pixel of the camera with the fewest of them meets the
// hull. `hull` was assigned these silhouettes with Limits::all; returns false if there is none.
bool has_hull(CpuHull& hull, std::span<const Silhouette> silhouettes);

// What to tell the user if every camera has object pixels and there is no hull.
inline constexpr const char* kNoCommonPoint =
    "every camera has object pixels, but no point of volume_m is inside all silhouettes: the "
    "objects are outside volume_m, a pose is wrong, cameras are exchanged, or the videos do not "
    "start together";

}  // namespace fivepipe::hull
