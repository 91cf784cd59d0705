// Contacts that a rigid object keeps from step to step, as planes on the hull.
//
// Each frame measures the hull's surface again, and each measurement is uncertain by about a
// pixel's footprint. An object at rest would follow these changes and wander. A contact therefore
// keeps its plane as long as the measured surface is within kPlaneTolerance footprints of it, and a
// new contact on the same plane takes that plane. The paper has no counterpart; physics engines
// keep contacts in the same way, without the tolerance (persistent manifold, Moravanszky and
// Terdiman, "Fast Contact Reduction for Dynamics Simulation", 2004).
#pragma once
#include <span>
#include <vector>

#include "common/hull/query/hull_query.h"
#include "sim_node/hull/hull_part.h"

namespace fivepipe::sim {

struct KeptContact {
  std::uint64_t part;           // HullPart::id
  Eigen::Vector3d on_object_m;  // object frame; not used for a ball
  // The plane, with the part at its place of the newest frame. The normal is unit and leaves the
  // hull.
  Eigen::Vector3d on_hull_world_m, normal_world;
  double footprint_m;  // of a pixel there
  // Above 0: the object is a ball of this radius about its origin. It rolls, so its point is always
  // the one nearest to the plane.
  double ball_radius_m = 0;
  double impulse_n_s = 0;  // see HullContactPoint
};

// Velocity of a part's surface where an object touches it, beyond the part's rigid motion, from the
// previous frame to the newest one: a hand turns about its wrist.
struct SurfaceMotion {
  std::uint64_t part;  // HullPart::id
  Eigen::Vector3d velocity_world_m_s;
};

// The object's point [m]. world_from_object: relative to the part at its place of the newest frame,
// as everywhere below.
Eigen::Vector3d point_world_m(const KeptContact& contact,
                              const Eigen::Isometry3d& world_from_object);

// Signed distance of the object's point from the plane [m]; negative in the hull.
double distance_m(const KeptContact& contact, const Eigen::Isometry3d& world_from_object);

// Drops the contacts with a part that the object has left: those whose point is more than a
// footprint from the plane, or has slid by more than that along it.
void drop_left(std::vector<KeptContact>& contacts, std::uint64_t part,
               const Eigen::Isometry3d& world_from_object);

// Moves the planes with their parts to a new frame, `between_s` after the last one. If the new
// hull's surface is not near a plane, the plane moves along its normal to the surface, by at most
// reach_m; the contact is dropped if there is no surface. A contact with a part that is no longer
// known goes to one whose box contains it; a part keeps at most kMaxHullContacts. Returns the mean
// motion of each part's moved planes.
std::vector<SurfaceMotion> follow_hull(std::vector<KeptContact>& contacts,
                                       std::span<const HullPart> parts, double between_s,
                                       const hull::HullQuery& query, double reach_m);

// Adds measured contacts with a part, each as its own plane or that of a kept contact that it
// shares, unless one is kept within a footprint of its place on this plane. Keeps at most
// kMaxHullContacts contacts with the part (support_points.h).
void add_contacts(std::vector<KeptContact>& contacts, std::uint64_t part,
                  std::span<const KeptContact> measured,
                  const Eigen::Isometry3d& world_from_object);

// Whether a point is within kPlaneTolerance of a kept plane and within the contacts on this plane:
// no farther from their centre than the farthest of them.
bool is_on_kept_plane(std::span<const KeptContact> contacts, const Eigen::Vector3d& p_world_m);

// In footprints. A border pixel that appears and disappears moves the surface by one; the plane may
// be that of either state.
inline constexpr double kPlaneTolerance = 1.5;
// Contacts whose normals differ by less may share a plane.
inline constexpr double kSamePlane_rad = 0.1;
// Smallest cosine between the normals of contacts on one side of an object.
inline constexpr double kSameSide = 0.7;

}  // namespace fivepipe::sim
