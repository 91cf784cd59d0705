#include "sim_node/messages_collision.h"

#include <cmath>
#include <limits>

namespace fivepipe::sim {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

fivepipe_v1_CollisionVerdict wire_verdict(const collision::ObjectCollision& collision) {
  const bool may_contain_hull =
      collision.verdict == collision::CollisionVerdict::free && collision.hull_in_box;
  if (may_contain_hull || collision.verdict == collision::CollisionVerdict::undecided)
    return fivepipe_v1_undecided;
  return collision.colliding() ? fivepipe_v1_colliding : fivepipe_v1_free;
}

fivepipe_v1_ResponseStatus wire_response(collision::RecoveryStatus status) {
  switch (status) {
    case collision::RecoveryStatus::recovered: return fivepipe_v1_recovered;
    case collision::RecoveryStatus::still_colliding: return fivepipe_v1_still_colliding;
    case collision::RecoveryStatus::reference_inside: return fivepipe_v1_reference_inside;
    case collision::RecoveryStatus::no_exit_within_reach: return fivepipe_v1_no_exit_within_reach;
    case collision::RecoveryStatus::direction_undefined: return fivepipe_v1_direction_undefined;
    case collision::RecoveryStatus::no_collision_point: break;
  }
  return fivepipe_v1_no_response;
}

fivepipe_v1_LocalTranslationStatus wire_local_minimum_translation(
    collision::LocalMinimumTranslationStatus status) {
  switch (status) {
    case collision::LocalMinimumTranslationStatus::shorter_found: return fivepipe_v1_shorter_found;
    case collision::LocalMinimumTranslationStatus::none_shorter_found:
      return fivepipe_v1_none_shorter_found;
    case collision::LocalMinimumTranslationStatus::none_verified: break;
  }
  return fivepipe_v1_none_verified;
}

fivepipe_v1_ContactStatus wire_contact(collision::ContactStatus status) {
  switch (status) {
    case collision::ContactStatus::defined: return fivepipe_v1_contact_defined;
    case collision::ContactStatus::no_border: return fivepipe_v1_contact_without_border;
    case collision::ContactStatus::no_exit_within_reach: break;
  }
  return fivepipe_v1_contact_without_exit;
}

fivepipe_v1_ComponentOrigin wire_origin(collision::ComponentOrigin origin) {
  switch (origin) {
    case collision::ComponentOrigin::appeared: return fivepipe_v1_component_appeared;
    case collision::ComponentOrigin::tracked: return fivepipe_v1_component_tracked;
    case collision::ComponentOrigin::merged: return fivepipe_v1_component_merged;
    case collision::ComponentOrigin::split: break;
  }
  return fivepipe_v1_component_split;
}

// Round so that lower bounds stay lower bounds, and upper bounds upper bounds.
float rounded_down(double value) {
  const float f = float(value);
  return double(f) > value ? std::nextafter(f, -kInfinity) : f;
}
float rounded_up(double value) {
  const float f = float(value);
  return double(f) < value ? std::nextafter(f, kInfinity) : f;
}

void set_camera(char (&field)[33], int camera, const std::vector<std::string>& cameras) {
  if (camera >= 0 && std::size_t(camera) < cameras.size())
    messages::set_text(field, cameras[std::size_t(camera)]);
}

void add_normal(OutgoingCollision& out, const collision::HullNormal& normal,
                fivepipe_v1_NormalKind kind, const std::vector<std::string>& cameras) {
  if (normal.status == collision::NormalStatus::not_requested) return;
  const bool defined = normal.status == collision::NormalStatus::defined;
  out.normals.push_back({kind,
                         defined ? fivepipe_v1_normal_defined : fivepipe_v1_normal_undefined,
                         messages::to_wire(normal.normal_world),
                         normal.error_rad,
                         {}});
  out.cameras.emplace_back();
  for (const hull::LimitingCamera& limiting : normal.cameras) {
    fivepipe_v1_LimitingNormal& message = out.cameras.back().emplace_back();
    set_camera(message.camera, limiting.camera, cameras);
    message.normal = messages::to_wire(limiting.normal_world);
    message.error_rad = limiting.error_rad;
  }
}

void put_response(OutgoingCollision& out, const collision::Response& response,
                  const std::vector<std::string>& cameras) {
  out.header.response = wire_response(response.status);
  out.header.cp_object_m = messages::to_wire(response.cp_object_world_m);
  out.header.v_rec = messages::to_wire(response.v_rec_world);
  out.header.cp_hull_m = messages::to_wire(response.cp_hull_world_m);
  out.header.d_rec_m = response.d_rec_m;
  out.header.d_rec_error_m = response.d_rec_error_m;
  out.header.residual_m = response.residual_m;
  add_normal(out, response.four_points, fivepipe_v1_four_points, cameras);
  add_normal(out, response.closed_form, fivepipe_v1_closed_form, cameras);
}

fivepipe_v1_Contact contact_message(const collision::Contact& contact,
                                    const std::vector<std::string>& cameras) {
  fivepipe_v1_Contact message{};
  message.status = wire_contact(contact.status);
  message.triangle = contact.on_object.triangle;
  message.on_object_m = messages::to_wire(contact.on_object.p_world_m);
  message.on_hull_m = messages::to_wire(contact.on_hull_world_m);
  message.normal = messages::to_wire(contact.normal_world);
  message.depth_m = contact.depth_m;
  message.depth_error_m = contact.depth_error_m;
  message.normal_error_rad = contact.normal_error_rad;
  set_camera(message.camera, contact.camera, cameras);
  return message;
}

void put_proximity(OutgoingCollision& out, const std::vector<collision::Proximity>& proximity,
                   const config::ProximityRequests& requests) {
  for (const collision::Proximity& p : proximity) {
    out.min_m.push_back(rounded_down(p.min_m));
    out.max_m.push_back(rounded_up(p.max_m));
  }
  out.proximity.push_back({requests.of == config::ProximityOf::vertices ? fivepipe_v1_of_vertices
                                                                        : fivepipe_v1_of_triangles,
                           requests.cap_m,
                           {},
                           {}});
}

void put_first_contact(OutgoingCollision& out, const ComponentContact& first,
                       const ResultFrame& frame) {
  constexpr double kNanosecondsPerSecond = 1e9;
  const collision::FirstContact& contact = first.contact;
  fivepipe_v1_FirstContact& message = out.first_contact.emplace_back();
  message.component = first.component;
  message.stamp_ns = frame.capture_stamp_ns +
                     std::llround(kNanosecondsPerSecond * (contact.time_s - frame.time_s));
  message.error_ns = std::uint64_t(std::ceil(kNanosecondsPerSecond * contact.time_error_s));
  message.p_m = messages::to_wire(contact.p_world_m);
  message.triangle = contact.triangle;
  message.coarse = contact.coarse;
}

}  // namespace

const fivepipe_v1_CollisionResult& OutgoingCollision::message() {
  for (std::size_t i = 0; i < normals.size(); ++i) messages::borrow(normals[i].cameras, cameras[i]);
  for (fivepipe_v1_ProximityField& field : proximity) {
    messages::borrow(field.min_m, min_m);
    messages::borrow(field.max_m, max_m);
  }
  messages::borrow(header.points_m, points_m);
  messages::borrow(header.triangles, triangles);
  messages::borrow(header.triangles_undecided, triangles_undecided);
  messages::borrow(header.normals, normals);
  messages::borrow(header.local_minimum_translation, local_minimum_translation);
  messages::borrow(header.contacts, contacts);
  messages::borrow(header.proximity, proximity);
  messages::borrow(header.first_contact, first_contact);
  return header;
}

OutgoingCollision collision_message(const ResultFrame& frame, const CollisionReport& report,
                                    const config::CollisionRequests& requests) {
  OutgoingCollision out;
  messages::set_text(out.header.object, report.name);
  out.header.frame = frame.frame;
  out.header.capture_stamp_ns = frame.capture_stamp_ns;
  out.header.verdict = wire_verdict(report.collision);
  out.header.triangles_colliding = std::uint32_t(report.collision.triangles.size());
  out.header.points_truncated = report.truncated;
  for (const collision::CollisionPoint& point : report.collision.points)
    out.points_m.push_back(messages::to_wire(point.p_world_m));
  if (requests.triangles)
    out.triangles = report.collision.triangles,
    out.triangles_undecided = report.collision.undecided;
  const CollisionDetails& details = report.details;
  if (const auto& response = details.response ? details.response : report.response)
    put_response(out, *response, frame.cameras);
  if (details.local_minimum_translation)
    out.local_minimum_translation.push_back(
        {wire_local_minimum_translation(details.local_minimum_translation->status),
         messages::to_wire(details.local_minimum_translation->translation_world_m)});
  if (details.contacts)
    for (const collision::Contact& contact : details.contacts->contacts)
      out.contacts.push_back(contact_message(contact, frame.cameras));
  if (requests.proximity) put_proximity(out, details.proximity, *requests.proximity);
  if (details.first_contact) put_first_contact(out, *details.first_contact, frame);
  return out;
}

const fivepipe_v1_HullComponents& OutgoingComponents::message() {
  for (std::size_t i = 0; i < components.size(); ++i) messages::borrow(components[i].from, from[i]);
  messages::borrow(header.components, components);
  return header;
}

OutgoingComponents components_message(const std::string& simulation, const ResultFrame& frame,
                                      const std::vector<collision::TrackedComponent>& components) {
  OutgoingComponents out;
  messages::set_text(out.header.simulation, simulation);
  out.header.frame = frame.frame;
  out.header.capture_stamp_ns = frame.capture_stamp_ns;
  for (const collision::TrackedComponent& tracked : components) {
    fivepipe_v1_HullComponent& message = out.components.emplace_back();
    message.id = tracked.id;
    message.origin = wire_origin(tracked.origin);
    out.from.push_back(tracked.from);
    message.centroid_m = messages::to_wire(tracked.component.centroid_world_m);
    message.volume_m3 = tracked.component.volume_m3;
    message.box_min_m = messages::to_wire(Eigen::Vector3d(tracked.component.box_world_m.min()));
    message.box_max_m = messages::to_wire(Eigen::Vector3d(tracked.component.box_world_m.max()));
    message.clipped = tracked.component.clipped;
    if (!tracked.motion) continue;
    message.frames = std::uint16_t(tracked.motion->frames);
    message.window_s = tracked.motion->window_s;
    message.velocity_m_s = messages::to_wire(tracked.motion->velocity_world_m_s);
    message.angular_velocity_rad_s =
        messages::to_wire(tracked.motion->angular_velocity_world_rad_s);
    message.determined_axes = std::uint8_t(tracked.motion->determined_axes);
    message.residual_m = tracked.motion->residual_m;
  }
  return out;
}

}  // namespace fivepipe::sim
