#include "sim_node/collision_details.h"

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

void add_response(CollisionDetails& details, const hull::HullQuery& query,
                  const collision::ObjectCollision& collision,
                  const Eigen::Vector3d& rp_object_world_m, const collision::Requery& requery,
                  const config::CollisionRequests& requests) {
  if (!collision.colliding()) return;
  if (requests.contacts > 0)
    details.contacts = collision::contact_manifold(
        query, collision,
        {.rp_object_world_m = rp_object_world_m, .max_contacts = requests.contacts});
  if (!requests.response) return;
  const config::ResponseRequests& asked = *requests.response;
  const collision::ResponseRequest request{
      .rp_object_world_m = rp_object_world_m,
      .v_rec_world = asked.v_rec_world,
      .normals = {.four_points = asked.four_points, .closed_form = asked.closed_form}};
  const collision::ResponseConfig config{.search = search_of(asked.search),
                                         .height_m = asked.height_m,
                                         .apex_angle_rad = asked.apex_angle_rad};
  details.response = collision::respond(query, collision, request, requery, config);
  if (asked.local_minimum_translation && details.response->has_exit())
    details.local_minimum_translation =
        collision::find_local_minimum_translation(query, collision, *details.response, requery);
}

std::vector<collision::Proximity> proximity_of(collision::HullProximity& proximity,
                                               const geometry::Mesh& mesh,
                                               const Eigen::Isometry3d& world_from_object,
                                               config::ProximityOf of) {
  if (of == config::ProximityOf::triangles)
    return proximity.of_mesh(mesh, world_from_object).triangles;
  std::vector<Eigen::Vector3d> vertices_world_m;
  for (const Eigen::Vector3d& v : mesh.vertices_m)
    vertices_world_m.push_back(world_from_object * v);
  std::vector<collision::Proximity> result(vertices_world_m.size());
  proximity.of_points(vertices_world_m, result);
  return result;
}

}  // namespace fivepipe::sim
