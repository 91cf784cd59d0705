#include "render_node/overlays/messages_marks.h"

#include <cmath>

#include "common/config/sim_config.h"

namespace fivepipe::render {
namespace {

// Why a message is invalid; nullopt: it is valid.
using Reason = std::optional<std::string>;

bool is_in_reach(const Eigen::Vector3d& p_m) {
  return (p_m.array().abs() <= kMaxCoordinate_m).all();  // false for NaN
}

Reason read_points(const fivepipe_v1_CollisionResult& message, CollisionMarks& marks) {
  const auto points = messages::span_of(message.points_m);
  if (points.size() > std::size_t(config::kMaxCollisionPoints))
    return std::to_string(points.size()) + " collision points are too many";
  marks.points_world_m.reserve(points.size());
  for (const fivepipe_v1_Vec3& point : points) {
    const Eigen::Vector3d p_world_m = messages::from_wire(point);
    if (!is_in_reach(p_world_m)) return "collision point not finite or too far";
    marks.points_world_m.push_back(p_world_m.cast<float>());
  }
  return {};
}

bool has_exit(const fivepipe_v1_CollisionResult& message) {
  return message.response == fivepipe_v1_recovered ||
         message.response == fivepipe_v1_still_colliding;
}

Reason read_recovery(const fivepipe_v1_CollisionResult& message, CollisionMarks& marks) {
  if (!has_exit(message)) return {};
  const RecoveryMark recovery{messages::from_wire(message.cp_object_m),
                              messages::from_wire(message.cp_hull_m),
                              message.response == fivepipe_v1_still_colliding};
  if (!is_in_reach(recovery.cp_object_world_m)) return "CP_obj not finite or too far";
  if (!is_in_reach(recovery.cp_hull_world_m)) return "CP_hull not finite or too far";
  marks.recovery = recovery;
  return {};
}

Reason read_normals(const fivepipe_v1_CollisionResult& message, CollisionMarks& marks) {
  std::set<fivepipe_v1_NormalKind> kinds;
  for (const fivepipe_v1_HullNormal& normal : messages::span_of(message.normals)) {
    if (!kinds.insert(normal.kind).second) return "two normals of one kind";
    if (normal.status != fivepipe_v1_normal_defined) continue;
    if (!has_exit(message)) return "normal without CP_hull";
    const HullNormalMark mark{messages::from_wire(message.cp_hull_m),
                              messages::from_wire(normal.n_hull),
                              normal.kind == fivepipe_v1_closed_form};
    if (!is_in_reach(mark.cp_hull_world_m)) return "CP_hull not finite or too far";
    if (!(std::abs(mark.n_hull_world.norm() - 1) <= kMaxUnitError))
      return "normal is not a unit vector";
    marks.hull_normals.push_back(mark);
  }
  return {};
}

Reason read_proximity(const fivepipe_v1_CollisionResult& message, const OverlaidObject& object,
                      CollisionMarks& marks) {
  const auto fields = messages::span_of(message.proximity);
  if (fields.empty()) return {};
  if (fields.size() > 1) return "more than one proximity field";
  const fivepipe_v1_ProximityField& field = fields[0];
  const bool is_of_vertices = field.of == fivepipe_v1_of_vertices;
  if (is_of_vertices != (object.proximity_of == config::ProximityOf::vertices))
    return "proximity is not of what the scene requests";
  const auto min_m = messages::span_of(field.min_m), max_m = messages::span_of(field.max_m);
  if (min_m.size() != object.proximity_values() || max_m.size() != object.proximity_values())
    return std::to_string(min_m.size()) + " and " + std::to_string(max_m.size()) +
           " bounds of proximity for " + std::to_string(object.proximity_values()) +
           (is_of_vertices ? " vertices" : " triangles");
  if (!(field.cap_m > 0 && field.cap_m <= kMaxCoordinate_m)) return "cap of proximity not valid";
  marks.proximity.reserve(min_m.size());
  for (std::size_t i = 0; i < min_m.size(); ++i) {
    if (!(min_m[i] >= 0 && double(min_m[i]) <= field.cap_m && max_m[i] >= min_m[i]))
      return "bounds of proximity not valid";
    // At the cap and beyond, min_m is the cap, rounded down, and max_m is infinite.
    marks.proximity.push_back(std::isinf(max_m[i]) ? 1 : float(double(min_m[i]) / field.cap_m));
  }
  return {};
}

}  // namespace

messages::Received<CollisionMarks> marks_from(const fivepipe_v1_CollisionResult& message,
                                              const OverlaidObject& object) {
  messages::Received<CollisionMarks> received;
  CollisionMarks& marks = std::get<CollisionMarks>(received);
  marks.object = object.object;
  for (const config::Overlay overlay : object.shown) {
    Reason why;
    switch (overlay) {
      case config::Overlay::collision_points: why = read_points(message, marks); break;
      case config::Overlay::recovery: why = read_recovery(message, marks); break;
      case config::Overlay::hull_normals: why = read_normals(message, marks); break;
      case config::Overlay::proximity: why = read_proximity(message, object, marks); break;
    }
    if (!why) continue;
    received = messages::BadMessage{"bad_collision", message.object, *why};
    break;
  }
  return received;
}

}  // namespace fivepipe::render
