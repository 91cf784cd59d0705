// What a scene asks of a collision beyond verdict and points: computed here, and only what it asks for.
#pragma once
#include <optional>
#include <vector>

#include "common/collision/contact_manifold.h"
#include "common/collision/first_contact.h"
#include "common/collision/proximity.h"
#include "common/collision/response.h"
#include "common/collision/shorter_way.h"
#include "common/scene/collision_wishes.h"

namespace fivepipe {

struct CollisionDetails {
  std::optional<Response> response;         // of an object that collides
  std::optional<ShorterWay> shorter_way;    // where the response has a way out
  std::optional<ContactManifold> contacts;  // of an object that collides
  std::vector<Proximity> proximity;         // by vertex or by triangle
  std::optional<FirstContact> first_contact;
  std::uint64_t first_contact_part = 0;     // FollowedPart::id
};

// Response, shorter way and contacts of an object that collides. rp_object_world_m: RP_obj; requery: response.h.
void add_response(CollisionDetails& details, const HullQuery& query, const ObjectCollision& collision, const Eigen::Vector3d& rp_object_world_m,
                  const Requery& requery, const CollisionWishes& wishes);

// By vertex or triangle, as asked for. The proximity has the wishes' cap and tolerance.
std::vector<Proximity> proximity_of(HullProximity& proximity, const Mesh& mesh, const Eigen::Isometry3d& world_from_object, ProximityOf of);

}  // namespace fivepipe
