// Contact manifold of a virtual object with the hull, as input for a rigid-body solver: a few
// points with depth and normal. The paper has no counterpart.
//
//     hull border ----f-----      p   collision point, deep in the hull
//                  \  |  /e       e   where the ray from p to RP_obj leaves the hull
//                   \ | /         f   the contact: exit from p along the normal
//                     p           fp  depth
//
// The depth is found by local descent. The normal of the hull's border at e is tried as the next
// direction from p, then the normal at the end of that ray, as long as the distance decreases.
#pragma once
#include <vector>

#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"
#include "common/hull/silhouette/hull_border.h"

namespace fivepipe::collision {

struct ManifoldRequest {
  Eigen::Vector3d rp_object_world_m;  // RP_obj: the first direction of each point leads to it
  int max_contacts = 4;               // > 0; solvers usually take 4 to 8
  double reach_m = 0.05;              // > 0: a deeper point has no exit
};

enum class ContactStatus {
  defined,
  // No exit closer than reach_m exists towards RP_obj or along a world axis.
  no_exit_within_reach,
  // An exit exists, but no silhouette border was found there: normal_world is only the direction
  // of the exit.
  no_border
};

struct Contact {
  ContactStatus status = ContactStatus::no_exit_within_reach;
  CollisionPoint on_object;
  // The fields below are valid if status is defined or no_border.
  Eigen::Vector3d on_hull_world_m = Eigen::Vector3d::Zero();
  // Unit, outward: on_hull = on_object + depth * normal, found by a ray.
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();
  // Local minimum of the exit distance. The error is that of HullExit.
  double depth_m = 0, depth_error_m = 0;
  // The fields below are valid if status is defined.
  double normal_error_rad = 0;  // estimate for the border's normal (contour.h)
  // The border's normal equals normal_world within kConverged_rad. Otherwise the descent ended at
  // an edge of the hull.
  bool converged = false;
  int camera = -1;  // index of the silhouette that limits the hull there
};
// Three standard errors of a border normal that is fitted over a full window.
inline constexpr double kConverged_rad = 0.05;

struct ContactManifold {
  // The first contact is the deepest towards RP_obj among a sample of the points. The others are a
  // farthest-point sample; no two are within a pixel footprint of each other.
  std::vector<Contact> contacts;
};

// Ignores points outside the hull. Throws std::invalid_argument if the request or a point is not
// finite or out of range.
ContactManifold contact_manifold(const hull::HullQuery& query, const ObjectCollision& collision,
                                 const ManifoldRequest& request);

}  // namespace fivepipe::collision
