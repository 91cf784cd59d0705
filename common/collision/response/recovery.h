// CP_obj, CP_hull and D_rec: the object's point from which, and the distance along V_rec after
// which, the object leaves the hull (paper, section 4.3).
#pragma once
#include <optional>
#include <span>

#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::collision {

// Total order of collision points: by triangle, then by x, y, z. Breaks ties independently of the
// order in which points are given.
bool precedes(const CollisionPoint& a, const CollisionPoint& b);

// Returns CP_obj: the point farthest from RP_obj. If equally_far_m > 0, the points nearer by at
// most that count as equally far, and CP_obj is the one deepest towards RP_obj. precedes() breaks
// ties. Requires at least one point. The result refers to an element of `points`.
const CollisionPoint& cp_object(const hull::HullQuery& query,
                                std::span<const CollisionPoint> points,
                                const Eigen::Vector3d& rp_world_m, double equally_far_m = 0);

// The exit of a ray from the hull. contains() is true at distance_m - error_m and false at
// distance_m + error_m, or error_m is kMaxRounding_m. A sampled exit is between distance_m and
// distance_m + error_m.
struct HullExit {
  double distance_m = 0, error_m = 0;
};
// Bounds of error_m for an exact exit [m]: the rounding error of the smallest scene, and a length
// that no scene's maps resolve.
inline constexpr double kMinRounding_m = 1e-14, kMaxRounding_m = 1e-6;

// The functions below follow a ray from p along a unit direction. If p is outside the hull, the
// exit is at distance 0.

// Returns the first exit before reach_m, or nullopt if there is none.
std::optional<HullExit> exit_outward(const hull::HullQuery& query, const Eigen::Vector3d& p_world_m,
                                     const Eigen::Vector3d& direction_world, double reach_m);
// Returns the last exit before the base, which is reach_m from p, or nullopt if the base is in the
// hull.
std::optional<HullExit> exit_from_base(const hull::HullQuery& query,
                                       const Eigen::Vector3d& p_world_m,
                                       const Eigen::Vector3d& direction_world, double reach_m);
// As exit_from_base(), but samples the line in `samples` steps as in the paper.
std::optional<HullExit> exit_sampled(const hull::HullQuery& query, const Eigen::Vector3d& p_world_m,
                                     const Eigen::Vector3d& direction_world, double reach_m,
                                     int samples);

// Returns the distance along a unit direction after which each of the points has been outside the
// hull; reach_m if one of them has not.
double residual_m(const hull::HullQuery& query, std::span<const CollisionPoint> points,
                  const Eigen::Vector3d& direction_world, double reach_m);

// Returns the size [m] of the largest pixel at p; with Limits::seen, of the cameras that see p, if
// there is one.
double pixel_footprint_m(const hull::HullQuery& query, const Eigen::Vector3d& p_world_m);

}  // namespace fivepipe::collision
