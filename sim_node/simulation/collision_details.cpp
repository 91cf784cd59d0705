#include "sim_node/simulation/collision_details.h"

#include <cassert>

namespace fivepipe::sim {
namespace {

collision::HullSearch search_of(config::RecoverySearch search) {
  switch (search) {
    case config::RecoverySearch::from_reference: return collision::HullSearch::from_reference;
    case config::RecoverySearch::outward: return collision::HullSearch::outward;
    case config::RecoverySearch::sampled: return collision::HullSearch::sampled;
  }
  return collision::HullSearch::from_reference;
}

}  // namespace

bool needs_points(const config::CollisionRequests& requests) {
  return requests.contacts > 0 || requests.response;
}

void add_response(CollisionDetails& details, const hull::HullQuery& query,
                  const collision::ObjectCollision& collision,
                  const Eigen::Vector3d& rp_object_world_m, const collision::Requery& requery,
                  const config::CollisionRequests& requests) {
  assert(collision.colliding());
  if (requests.contacts > 0)
    details.contacts = collision::contact_manifold(
        query, collision,
        {.rp_object_world_m = rp_object_world_m, .max_contacts = requests.contacts});
  if (!requests.response) return;
  const config::ResponseRequests& requested = *requests.response;
  const collision::ResponseRequest request{
      .rp_object_world_m = rp_object_world_m,
      .v_rec_world = requested.v_rec_world,
      .normals = {.four_points = requested.four_points, .closed_form = requested.closed_form}};
  const collision::ResponseConfig config{.search = search_of(requested.search),
                                         .height_m = requested.height_m,
                                         .apex_angle_rad = requested.apex_angle_rad};
  details.response = collision::respond(query, collision, request, requery, config);
  if (requested.local_minimum_translation && details.response->has_exit())
    details.local_minimum_translation =
        collision::find_local_minimum_translation(query, collision, *details.response, requery);
}

}  // namespace fivepipe::sim
