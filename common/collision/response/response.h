// Collision response: how to move a virtual object out of the visual hull, and the hull's normal
// there (paper, section 4.3 and figure 3).
//
//        B ------- base ------- C    base: `height` from A along V_rec, but not beyond RP_obj
//         \         |          /
//          \        |         /      CP_hull: first hull point on V_rec from the base towards A
//           I---CP_hull------J       I, J: the same on BA and CA
//             \     |      /         K, L: the same in the perpendicular plane, triangle DAE
//               \   |   /            N_hull = IJ x KL, with the sign of N_hull . V_rec > 0
//                 A = CP_obj         D_rec = |CP_hull - CP_obj|
//
// respond() computes only what is requested. Its steps are available separately in recovery.h
// (CP_obj, D_rec) and hull_normal.h (N_hull). The paper renders ABC over a window and steps through
// its pixels. Here the lines are intersected exactly by rays, or sampled at the window's pixels if
// HullSearch::sampled is chosen.
#pragma once
#include <functional>
#include <optional>

#include "common/collision/detection/detection.h"
#include "common/hull/query/hull_query.h"
#include "common/hull/silhouette/hull_border.h"

namespace fivepipe::collision {

// Returns the collision of the object with the same hull after the object is translated by
// move_world_m. The caller chooses the backend.
using Requery = std::function<ObjectCollision(const Eigen::Vector3d& move_world_m)>;

// The border of the hull on V_rec that becomes CP_hull.
enum class HullSearch {
  from_reference,  // the first hull point from the base towards CP_obj; exact
  // The first exit from CP_obj towards the base; exact. It is nearer if the hull is not convex.
  outward,
  // As from_reference, at window_px samples as in the paper; I, J, K and L are sampled too.
  sampled
};

struct ResponseConfig {
  HullSearch search = HullSearch::from_reference;
  double height_m = 0.05;                // of triangle ABC
  double apex_angle_rad = 0.1745329252;  // BAC: 10 degrees; in (0, pi)
  int window_px = 400;                   // samples along each line if sampled
};

struct RequestedNormals {
  bool four_points = false, closed_form = true;
};

struct ResponseRequest {
  Eigen::Vector3d rp_object_world_m;  // RP_obj; by default the object's centre
  // Direction given by the simulation, of any length; RP_obj - CP_obj if absent.
  std::optional<Eigen::Vector3d> v_rec_world;
  RequestedNormals normals = {};
  // Collision points nearer to RP_obj than the farthest by at most this count as equally far;
  // CP_obj is the one deepest in the hull towards RP_obj. A ball needs a positive value: all its
  // points are equally far except for the flatness of the triangles, so the farthest may be at the
  // contact's rim.
  double equally_far_m = 0;
};

enum class RecoveryStatus {
  // After the move by clear_distance_m() along V_rec, the residual is at most indifferent_m().
  recovered,
  // After the same move, the residual is larger: the object has another contact.
  still_colliding,
  // RP_obj is in the hull, so the search has no start. Not returned if V_rec is given or the search
  // is outward.
  reference_inside,
  no_exit_within_reach,  // the base of ABC is in the hull; outward: no exit is before the base
  direction_undefined,   // V_rec is zero or not finite
  // No hull point is on the surface; the hull may still be wholly inside the object.
  no_collision_point
};

enum class NormalStatus {
  defined,
  not_requested,       // or there is no CP_hull
  edge_starts_inside,  // four points: B, C, D or E is in the hull
  parallel,            // four points: I, J, K, L span no plane
  no_border,           // closed form: no silhouette border was found where V_rec leaves the hull
  // error_rad exceeds kMaxNormalError_rad; for four points, they span less than the maps resolve.
  too_uncertain
};

struct HullNormal {
  NormalStatus status = NormalStatus::not_requested;
  Eigen::Vector3d normal_world = Eigen::Vector3d::Zero();  // unit, outward; valid if defined
  // Estimate. Four points: one sampling step plus one pixel footprint, over the points' span.
  // Closed form: the standard error of the contour's fit.
  double error_rad = 0;
  // Closed form: several if CP_hull is on an edge or a corner; the first one has normal_world.
  std::vector<hull::LimitingCamera> cameras;
};

struct Response {
  RecoveryStatus status = RecoveryStatus::direction_undefined;
  Eigen::Vector3d cp_object_world_m = Eigen::Vector3d::Zero();
  // Unit length; also valid for no_exit_within_reach.
  Eigen::Vector3d v_rec_world = Eigen::Vector3d::Zero();
  // The fields below are valid if status is recovered or still_colliding.
  Eigen::Vector3d cp_hull_world_m = Eigen::Vector3d::Zero();
  double d_rec_m = 0;
  // Exact search: contains() changes within this distance of d_rec_m. Sampled: the hull ends
  // before d_rec_m + d_rec_error_m.
  double d_rec_error_m = 0;
  // Footprint of the cameras' largest pixel at CP_hull, the resolution of the maps there.
  double pixel_footprint_m = 0;
  // Distance along V_rec, after the move, until each of remaining_points has been outside; at most
  // the reach of the search.
  double residual_m = 0;
  std::vector<CollisionPoint> remaining_points;  // CP_i after the move by clear_distance_m()
  HullNormal four_points, closed_form;

  // Length of the move along V_rec that takes CP_obj out of the hull. D_rec alone ends on the
  // hull's border.
  double clear_distance_m() const { return d_rec_m + d_rec_error_m; }
  // Largest residual of a recovered object: the error of the exit plus one pixel footprint.
  double indifferent_m() const { return d_rec_error_m + pixel_footprint_m; }
  bool has_exit() const {
    return status == RecoveryStatus::recovered || status == RecoveryStatus::still_colliding;
  }
  // Returns the closed form if it is defined, otherwise the four points, whatever their status.
  const HullNormal& normal() const {
    return closed_form.status == NormalStatus::defined ? closed_form : four_points;
  }
};

// Computes the response to a collision with the query's hull. Throws std::invalid_argument if
// RP_obj or a collision point is not finite, the configuration is out of range, or requery is
// empty.
Response respond(const hull::HullQuery& query, const ObjectCollision& collision,
                 const ResponseRequest& request, const Requery& requery,
                 const ResponseConfig& config = {});

}  // namespace fivepipe::collision
