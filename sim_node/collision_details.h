// What a scene asks of a collision beyond verdict and points: computed here, and only what it asks
// for.
#pragma once
#include <optional>
#include <vector>

#include "common/collision/proximity/proximity.h"
#include "common/collision/response/contact_manifold.h"
#include "common/collision/response/local_minimum_translation.h"
#include "common/collision/response/response.h"
#include "common/collision/tracking/first_contact.h"
#include "common/config/collision_requests.h"

namespace fivepipe::sim {

struct CollisionDetails {
  std::optional<collision::Response> response;  // of an object that collides
  std::optional<collision::LocalMinimumTranslation>
      local_minimum_translation;                       // where the response has a way out
  std::optional<collision::ContactManifold> contacts;  // of an object that collides
  std::vector<collision::Proximity> proximity;         // by vertex or by triangle
  std::optional<collision::FirstContact> first_contact;
  std::uint64_t first_contact_component = 0;  // TrackedComponent::id
};

// Response, shorter way and contacts of an object that collides. rp_object_world_m: RP_obj;
// requery: response.h.
void add_response(CollisionDetails& details, const hull::HullQuery& query,
                  const collision::ObjectCollision& collision,
                  const Eigen::Vector3d& rp_object_world_m, const collision::Requery& requery,
                  const config::CollisionRequests& requests);

// By vertex or triangle, as asked for. The proximity has the requests' cap and tolerance.
std::vector<collision::Proximity> proximity_of(collision::HullProximity& proximity,
                                               const geometry::Mesh& mesh,
                                               const Eigen::Isometry3d& world_from_object,
                                               config::ProximityOf of);

}  // namespace fivepipe::sim
