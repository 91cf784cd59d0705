#include "sim_node/contact/rigid_contact.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim_node/contact/bounce.h"

namespace fivepipe::sim {
namespace {

// Angle BAC for bouncing objects. If a ball has entered by 5 mm, the paper's 10 degrees place I and
// J 1 mm apart, less than a pixel's footprint; 60 degrees place them 6 mm apart.
constexpr double kBounceAngle_rad = 1.0471975512;
// Number of query periods for which an object at rest on the hull falls before a query lifts it
// again.
constexpr double kRestingPeriods = 2.0;

}  // namespace

collision::DetectionObject detection_object(const ObjectModels& models, const RigidBodies& bodies,
                                            std::size_t object) {
  return {&models.objects[object].bvh, bodies.world_from_object(object),
          bodies.center_world_m(object)};
}

RigidContact::RigidContact(const config::Scene& scene, const config::SimConfig& config,
                           const ObjectModels& models, RigidBodies& bodies, CurrentHull& hull)
    : scene_(scene),
      models_(models),
      bodies_(bodies),
      hull_(hull),
      window_px_(config.window_px),
      resting_speed_m_s_(kRestingPeriods * scene.gravity_m_s2 *
                         std::max(kHullQueryPeriod_s, config.step_s)),
      steps_per_query_(
          std::uint64_t(std::max(1.0, std::round(kHullQueryPeriod_s / config.step_s)))),
      contacts_(scene.objects.size()) {}

void RigidContact::after_step() {
  if (++steps_since_query_ < steps_per_query_) return;
  steps_since_query_ = 0;
  bounce_off_hull();
}

void RigidContact::reset() {
  steps_since_query_ = 0;
  last_query_ = {};
}

std::optional<HullContact> RigidContact::take_contact(std::size_t object) {
  return std::exchange(contacts_[object], std::nullopt);
}

void RigidContact::bounce_off_hull() {
  last_query_ = {};
  if (models_.bouncing.empty() || !hull_.query()) return;
  std::vector<collision::DetectionObject> objects;
  for (const std::size_t object : models_.bouncing)
    objects.push_back(detection_object(models_, bodies_, object));
  const std::span<collision::ObjectCollision> collisions = hull_.detect(objects);
  std::vector<std::size_t> colliding;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!collisions[i].colliding()) continue;
    ++counters_.contacts;
    ++last_query_.count;
    const std::size_t object = models_.bouncing[i];
    contacts_[object] = HullContact{std::move(collisions[i]), objects[i], {}};
    colliding.push_back(object);
  }
  // recover() queries the same detector, which invalidates `collisions`.
  for (const std::size_t object : colliding)
    contacts_[object]->response = recover(object, contacts_[object]->collision);
}

collision::Response RigidContact::recover(std::size_t object,
                                          const collision::ObjectCollision& collision) {
  const collision::Response first = move_out(object, collision);
  collision::Response last = first;
  for (int i = 1; i < kMaxRecoveries && last.status == collision::RecoveryStatus::still_colliding;
       ++i) {
    collision::ObjectCollision remaining;
    remaining.points = std::move(last.remaining_points);
    last = move_out(object, remaining);
  }
  counters_.still_colliding += last.status == collision::RecoveryStatus::still_colliding;
  if (last.status == collision::RecoveryStatus::still_colliding)
    last_query_.deepest_m = std::max(last_query_.deepest_m, last.residual_m);
  counters_.unrecovered += last.status != collision::RecoveryStatus::still_colliding &&
                           last.status != collision::RecoveryStatus::recovered;
  return first;
}

// Moves the object along V_rec and sets its velocity, if the response has an exit.
collision::Response RigidContact::move_out(std::size_t object,
                                           const collision::ObjectCollision& collision) {
  const collision::ResponseConfig config{.height_m = models_.objects[object].radius_m,
                                         .apex_angle_rad = kBounceAngle_rad,
                                         .window_px = window_px_};
  // Four points span the whole contact. The closed form is the normal of one camera's border, which
  // would push a ball between two parts of the hull to one side.
  const collision::ResponseRequest request{.rp_object_world_m = bodies_.center_world_m(object),
                                           .v_rec_world = std::nullopt,
                                           .normals = {.four_points = true, .closed_form = false},
                                           .equally_far_m = models_.objects[object].flatness_m};
  collision::Response response =
      collision::respond(*hull_.query(), collision, request,
                         hull_.requery(detection_object(models_, bodies_, object)), config);
  if (response.has_exit()) {
    const Bounce after =
        bounce(response, bodies_.velocity_m_s(object), scene_.objects[object].restitution,
               scene_.gravity_m_s2, resting_speed_m_s_);
    bodies_.translate(object, after.move_world_m);
    bodies_.set_velocity_m_s(object, after.velocity_world_m_s);
  }
  return response;
}

}  // namespace fivepipe::sim
