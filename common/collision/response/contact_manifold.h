// Beyond the paper: where a virtual object touches the hull, as a rigid-body solver wants it: a few
// points with depth and normal.
//
//     hull border ----f-----          p  collision point, deep in the hull        The way from p to
//     RP_obj is left at e; the border's
//                  \  |  /e           f  its contact: the exit along the normal   normal there is
//                  tried as a way, and again from where
//                   \ | /             fp depth                                    that ends, while
//                   the way gets shorter: a local descent.
//                     p
#pragma once
#include <vector>

#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"
#include "common/hull/silhouette/hull_border.h"

namespace fivepipe::collision {

struct ManifoldRequest {
  Eigen::Vector3d rp_object_world_m;  // RP_obj: each point's way starts towards it
  int max_contacts = 4;               // > 0; solvers want 4 to 8
  double reach_m = 0.05;              // > 0: deeper points have no contact
};

enum class ContactStatus {
  defined,
  no_exit_within_reach,  // no way shorter than reach_m was found: neither towards RP_obj nor along
                         // an axis of the world
  no_border  // no silhouette's border is found where the way ends: normal_world is the direction of
             // the way alone
};

struct Contact {
  ContactStatus status = ContactStatus::no_exit_within_reach;
  CollisionPoint on_object;
  // Where defined or no_border:
  Eigen::Vector3d on_hull_world_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();  // unit, out of the hull: on_hull =
                                                           // on_object + depth * normal, by ray
  double depth_m = 0,
         depth_error_m = 0;     // locally the least, along the normal; exact as HullExit has it
  double normal_error_rad = 0;  // of the border's normal there (contour.h)
  bool converged = false;  // that normal is normal_world to kConverged_rad; else the way ends at an
                           // edge of the hull
  int camera = -1;         // that limits there; index in the silhouettes
};
inline constexpr double kConverged_rad = 0.05;  // three standard errors of a fit over a full window

struct ContactManifold {
  std::vector<Contact> contacts;   // first, of some spread over all, the deepest on its way to
                                   // RP_obj; then spread out; none within a pixel of another
  std::size_t points_in_hull = 0;  // of those given; the others count for nothing
};

// Throws std::invalid_argument where the request or a point is not finite or out of range.
ContactManifold contact_manifold(const hull::HullQuery& query, const ObjectCollision& collision,
                                 const ManifoldRequest& request);

}  // namespace fivepipe::collision
