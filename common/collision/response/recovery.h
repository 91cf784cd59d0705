// From which point of the object, and how far along a direction, the hull is left (paper,
// section 4.3): CP_obj, CP_hull, D_rec.
#pragma once
#include <optional>
#include <span>

#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// The order of equals: by triangle, then by x, y, z. That in which points are given plays no part.
bool precedes(const CollisionPoint& a, const CollisionPoint& b);

// CP_obj: of the points, not empty, the one farthest from RP_obj; of those nearer by at most
// equally_far_m, where that is not zero, the one that is deepest on its way to RP_obj. Of equals,
// the one that comes before.
const CollisionPoint& cp_object(const hull::HullQuery& query,
                                std::span<const CollisionPoint> points,
                                const Eigen::Vector3d& rp_world_m, double equally_far_m = 0);

// Where a ray leaves the hull: in_hull() says yes error_m before and no error_m behind, or the
// error is kMaxRounding_m; where it was sampled, it ends between distance_m and distance_m +
// error_m.
struct HullExit {
  double distance_m = 0, error_m = 0;
};
// From rounding of the least scene to what no scene resolves [m].
inline constexpr double kMinRounding_m = 1e-14, kMaxRounding_m = 1e-6;

// Along a unit direction from p in the hull, p itself where it is not.
// The first exit, if before reach_m.
std::optional<HullExit> exit_outward(const hull::HullQuery& query, const Eigen::Vector3d& p_world_m,
                                     const Eigen::Vector3d& direction_world, double reach_m);
// The last exit before the base, reach_m from p; nothing where the base is in the hull.
std::optional<HullExit> exit_from_base(const hull::HullQuery& query,
                                       const Eigen::Vector3d& p_world_m,
                                       const Eigen::Vector3d& direction_world, double reach_m);
// The same to the accuracy of `samples` steps, as the paper does.
std::optional<HullExit> exit_sampled(const hull::HullQuery& query, const Eigen::Vector3d& p_world_m,
                                     const Eigen::Vector3d& direction_world, double reach_m,
                                     int samples);

// How much farther along a unit direction until each of the points has been outside; reach_m where
// one has not.
double residual_m(const hull::HullQuery& query, std::span<const CollisionPoint> points,
                  const Eigen::Vector3d& direction_world, double reach_m);

// The largest pixel, at p, of the cameras that have it in front of them [m].
double pixel_footprint_m(const hull::HullQuery& query, const Eigen::Vector3d& p_world_m);

}  // namespace fivepipe::collision
