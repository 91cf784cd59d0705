// Reports on the scene's reacting objects: their collision with the current hull and the details
// that the scene requests.
#pragma once
#include <string>
#include <vector>

#include "sim_node/contact/rigid_contact.h"
#include "sim_node/proximity/proximity_fields.h"
#include "sim_node/simulation/collision_details.h"

namespace fivepipe::sim {

// For Reaction::bounce, a report describes the last contact since the previous report, because the
// simulation has moved the object out of it. Without such a contact, and for other reactions, a
// report describes the object's present pose. Proximity and first contact always describe the
// present pose.
struct CollisionReport {
  std::size_t object = 0;  // index in the scene
  std::string name = {};
  collision::ObjectCollision collision = {};  // with at most SimConfig::max_points points
  bool truncated = false;                     // there were more points
  // The response of the first move out of the hull; present for Reaction::bounce if there was a
  // contact.
  std::optional<collision::Response> response = std::nullopt;
  CollisionDetails details = {};
};

// The state of a simulation from which reports are made.
struct ReportSources {
  const config::Scene& scene;
  const ObjectModels& models;
  const RigidBodies& bodies;
  CurrentHull& hull;
  RigidContact& contact;
  ProximityFields& proximity;
};

// Returns a report for each reacting object, in the scene's order; empty if there is no hull.
// Removes the contacts from sources.contact. is_new_hull: whether the hull has changed since the
// last report; first contacts are reported only then.
std::vector<CollisionReport> collision_reports(ReportSources sources, std::size_t max_points,
                                               bool is_new_hull);

}  // namespace fivepipe::sim
