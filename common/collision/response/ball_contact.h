// The normal of the contact between a ball and the hull, from the smooth outlines of the
// silhouettes.
#pragma once
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// Returns the unit normal out of the hull at its point nearest to the ball's centre, near
// `normal_world`, which the caller estimates (contact_patch.h). The hull is what its tangent planes
// there bound (hull::tangent_planes()), so that its surface has no steps of a pixel. Returns
// `normal_world` itself if there are none, if the centre is in what they bound, if the result is
// more than kMaxBallTurn_rad from it, or if a plane that touches the ball has an error above
// kMaxPlaneError_rad or is that of a part thinner than kMinThickness_px: such a part's hull has
// facets of about a pixel, and the mean over them is nearer to the real object.
Eigen::Vector3d ball_contact_normal(const hull::HullQuery& query,
                                    const Eigen::Vector3d& center_world_m, double radius_m,
                                    const Eigen::Vector3d& normal_world);

inline constexpr double kMaxPlaneError_rad = 0.02;
inline constexpr int kMinThickness_px = 24;
inline constexpr double kMaxBallTurn_rad = 0.8;

}  // namespace fivepipe::collision
