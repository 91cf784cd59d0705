#include "sim_node/messages.h"

namespace fivepipe {
namespace {

fivepipe_v1_CollisionVerdict wire_verdict(CollisionVerdict verdict) {
  switch (verdict) {
    case CollisionVerdict::free: return fivepipe_v1_certainly_free;
    case CollisionVerdict::touching: return fivepipe_v1_touching;
    case CollisionVerdict::colliding: return fivepipe_v1_colliding;
  }
  return fivepipe_v1_certainly_free;
}

fivepipe_v1_ResponseStatus wire_response(RecoveryStatus status) {
  switch (status) {
    case RecoveryStatus::recovered: return fivepipe_v1_recovered;
    case RecoveryStatus::still_colliding: return fivepipe_v1_still_colliding;
    case RecoveryStatus::reference_inside: return fivepipe_v1_reference_inside;
    case RecoveryStatus::no_exit_within_reach: return fivepipe_v1_no_exit_within_reach;
    case RecoveryStatus::direction_undefined: return fivepipe_v1_direction_undefined;
    case RecoveryStatus::no_collision_point: break;
  }
  return fivepipe_v1_no_response;
}

fivepipe_v1_NormalStatus wire_normal(NormalStatus status) {
  switch (status) {
    case NormalStatus::defined: return fivepipe_v1_normal_defined;
    case NormalStatus::not_asked: return fivepipe_v1_normal_not_asked;
    default: return fivepipe_v1_normal_undefined;
  }
}

void put(fivepipe_v1_CollisionResult& message, const Response& response) {
  message.response = wire_response(response.status);
  message.cp_object_m = wire(response.cp_object_world_m);
  message.v_rec = wire(response.v_rec_world);
  message.cp_hull_m = wire(response.cp_hull_world_m);
  message.d_rec_m = response.d_rec_m;
  message.d_rec_error_m = response.d_rec_error_m;
  message.residual_m = response.residual_m;
  const HullNormal& normal = response.normal();
  message.normal = wire_normal(normal.status);
  message.n_hull = wire(normal.normal_world);
  message.n_hull_error_rad = normal.error_rad;
}

}  // namespace

const fivepipe_v1_VirtualState& OutgoingState::message() {
  for (std::size_t i = 0; i < objects.size(); ++i) borrow(objects[i].vertices_m, vertices_m[i]);
  borrow(header.objects, objects);
  return header;
}

OutgoingState state_message(const std::string& simulation, std::uint64_t frame, std::int64_t capture_stamp_ns, double simulation_time_s,
                            const Scene& scene, const std::vector<ObjectState>& states) {
  OutgoingState out;
  set_text(out.header.simulation, simulation);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  out.header.simulation_time_s = simulation_time_s;
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (scene.objects[i].motion == Motion::fixed && states[i].vertices_m.empty()) continue;
    fivepipe_v1_ObjectState& object = out.objects.emplace_back();
    set_text(object.object, states[i].name);
    object.world_from_object = wire(states[i].world_from_object);
    std::vector<float>& vertices = out.vertices_m.emplace_back();
    for (const Eigen::Vector3d& v : states[i].vertices_m) vertices.insert(vertices.end(), {float(v.x()), float(v.y()), float(v.z())});
  }
  return out;
}

const fivepipe_v1_CollisionResult& OutgoingCollision::message() {
  borrow(header.points_m, points_m);
  return header;
}

OutgoingCollision collision_message(std::uint64_t frame, std::int64_t capture_stamp_ns, const CollisionReport& report) {
  OutgoingCollision out;
  set_text(out.header.object, report.name);
  out.header.frame = frame;
  out.header.capture_stamp_ns = capture_stamp_ns;
  const bool perhaps_inside = report.collision.verdict == CollisionVerdict::free && report.collision.hull_in_box;
  out.header.verdict = perhaps_inside ? fivepipe_v1_touching : wire_verdict(report.collision.verdict);
  out.header.triangles_colliding = std::uint32_t(report.collision.triangles.size());
  out.header.points_truncated = report.truncated;
  for (const CollisionPoint& point : report.collision.points) out.points_m.push_back(wire(point.p_world_m));
  if (report.response) put(out.header, *report.response);
  return out;
}

void apply(const fivepipe_v1_Command& command, const std::string& node, Simulation& simulation) {
  if (command.target[0] != '\0' && node != command.target) return;
  switch (command.kind) {
    case fivepipe_v1_reset_simulation: return simulation.reset();
    case fivepipe_v1_pause_simulation: return simulation.pause();
    case fivepipe_v1_resume_simulation: return simulation.resume();
  }
}

}  // namespace fivepipe
