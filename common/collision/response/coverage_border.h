// CP_hull and N_hull on the border of sub-pixel silhouettes. The verdict, D_rec and the recovery
// stay those of the object pixels: coverage has no certified bounds.
#pragma once
#include <span>

#include "common/collision/response/response.h"
#include "common/hull/silhouette/coverage_hull.h"

namespace fivepipe::collision {

// Moves response.cp_hull_world_m along V_rec to where the coverage of a camera crosses one half,
// and sets response.closed_form to the normal there, if it was requested. silhouettes: of the query
// with which the response was computed, in the order in which CpuHull::assign() received them.
// Leaves the response as it is if it has no exit, or if no border is within kMaxBorderShift_px
// footprints of CP_hull.
void refine_by_coverage(Response& response, std::span<const hull::CoverageSilhouette> silhouettes);

// The border at one half is within one pixel of the outline of the object pixels in each image
// (capture_node/segmentation/coverage_estimate.h); a wire thinner than a pixel may be kept wider.
inline constexpr double kMaxBorderShift_px = 1.5;
// Error of a normal of coverage: its 95th percentile on balls with a radius of 6 px; on balls of
// 25 px it is 0.05 (tests/collision/response/coverage_border_test.cpp).
inline constexpr double kCoverageNormalError_rad = 0.17;

}  // namespace fivepipe::collision
