// CP_hull and N_hull on the border of sub-pixel silhouettes. The verdict, D_rec and the recovery
// stay those of the object pixels, because coverage has no certified bounds. D_rec is then not the
// distance from CP_obj to CP_hull.
#pragma once
#include <span>

#include "common/collision/response/response.h"
#include "common/hull/coverage/coverage_hull.h"

namespace fivepipe::collision {

// Moves response.cp_hull_world_m along V_rec to where the hull of the coverage ends in the rule's
// box, and sets response.closed_form to the normal there, if it was requested: of the cameras whose
// coverage is below one half just beyond. silhouettes and rule: of the query with which the
// response was computed, the silhouettes in the order in which CpuHull::assign() received them.
// Leaves the response as it is if it has no exit, if no end is within kMaxBorderShift_px footprints
// of CP_hull, or if no camera limits the hull there, but the box does.
void refine_by_coverage(Response& response, std::span<const hull::CoverageSilhouette> silhouettes,
                        const hull::HullRule& rule);

// The border at one half is within one pixel of the outline of the object pixels in each image
// (capture_node/segmentation/coverage_estimate.h); a wire thinner than a pixel may be kept wider.
inline constexpr double kMaxBorderShift_px = 1.5;
// Error of a normal of coverage: its 95th percentile on balls with a radius of 6 px; on balls of
// 25 px it is 0.05 (tests/collision/response/coverage_border_test.cpp).
inline constexpr double kCoverageNormalError_rad = 0.17;

}  // namespace fivepipe::collision
