// Optional details of a collision beyond verdict and points. Only what the scene requests is
// computed.
#pragma once
#include <optional>
#include <vector>

#include "common/collision/proximity/proximity.h"
#include "common/collision/response/contact_manifold.h"
#include "common/collision/response/local_minimum_translation.h"
#include "common/collision/response/response.h"
#include "common/config/collision_requests.h"
#include "sim_node/hull/hull_history.h"

namespace fivepipe::sim {

struct CollisionDetails {
  // The first three are present only if the object collides and the scene requests them.
  std::optional<collision::Response> response;
  std::optional<collision::LocalMinimumTranslation> local_minimum_translation;  // needs an exit
  std::optional<collision::ContactManifold> contacts;
  std::vector<collision::Proximity> proximity;  // one per vertex or triangle
  std::optional<ComponentContact> first_contact;
};

// Returns whether the requests need every collision point of the object.
bool needs_points(const config::CollisionRequests& requests);

// Adds the requested response, local minimum translation and contacts. The object must collide.
// rp_object_world_m: RP_obj. requery: see response.h.
void add_response(CollisionDetails& details, const hull::HullQuery& query,
                  const collision::ObjectCollision& collision,
                  const Eigen::Vector3d& rp_object_world_m, const collision::Requery& requery,
                  const config::CollisionRequests& requests);

}  // namespace fivepipe::sim
