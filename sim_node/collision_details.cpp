#include "sim_node/collision_details.h"

namespace fivepipe {
namespace {

HullSearch search_of(RecoverySearch search) {
  switch (search) {
    case RecoverySearch::from_reference: return HullSearch::from_reference;
    case RecoverySearch::outward: return HullSearch::outward;
    case RecoverySearch::sampled: return HullSearch::sampled;
  }
  return HullSearch::from_reference;
}

}  // namespace

void add_response(CollisionDetails& details, const HullQuery& query, const ObjectCollision& collision, const Eigen::Vector3d& rp_object_world_m,
                  const Requery& requery, const CollisionWishes& wishes) {
  if (!collision.colliding()) return;
  if (wishes.contacts > 0)
    details.contacts = contact_manifold(query, collision, {.rp_object_world_m = rp_object_world_m, .most_contacts = wishes.contacts});
  if (!wishes.response) return;
  const ResponseWishes& asked = *wishes.response;
  const ResponseRequest request{.rp_object_world_m = rp_object_world_m,
                                .v_rec_world = asked.v_rec_world,
                                .normals = {.four_points = asked.four_points, .closed_form = asked.closed_form}};
  const ResponseConfig config{.search = search_of(asked.search), .height_m = asked.height_m, .apex_angle_rad = asked.apex_angle_rad};
  details.response = respond(query, collision, request, requery, config);
  if (asked.shorter_way && details.response->has_way_out()) details.shorter_way = shorter_way_out(query, collision, *details.response, requery);
}

std::vector<Proximity> proximity_of(HullProximity& proximity, const Mesh& mesh, const Eigen::Isometry3d& world_from_object, ProximityOf of) {
  if (of == ProximityOf::triangles) return proximity.of_mesh(mesh, world_from_object).triangles;
  std::vector<Eigen::Vector3d> vertices_world_m;
  for (const Eigen::Vector3d& v : mesh.vertices_m) vertices_world_m.push_back(world_from_object * v);
  std::vector<Proximity> result(vertices_world_m.size());
  proximity.of_points(vertices_world_m, result);
  return result;
}

}  // namespace fivepipe
