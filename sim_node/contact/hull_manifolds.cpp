#include "sim_node/contact/hull_manifolds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/collision/response/farthest_point_sample.h"
#include "common/collision/response/recovery.h"

namespace fivepipe::sim {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Halvings of the time between two detections on an object's way: 4 mm become 0.25 mm.
constexpr int kBisections = 4;
// An object that moves less has not moved since the last detection [m]: far below the maps'
// resolution.
constexpr double kStill_m = 1e-5;

// Whether the surface moved in this direction in the frame before, too. A border pixel that appears
// moves it in one frame only.
bool continues(const SurfaceMotion& motion, const std::vector<SurfaceMotion>& before) {
  return std::any_of(before.begin(), before.end(), [&](const SurfaceMotion& other) {
    return other.part == motion.part && other.velocity_world_m_s.dot(motion.velocity_world_m_s) > 0;
  });
}

}  // namespace

struct HullManifolds::Meeting : PlacedObject {
  RigidVelocity velocity;  // of the part, now
  Vector3d relative_m_s;   // velocity of the object's centre relative to the part
};

HullManifolds::HullManifolds(const config::Scene& scene, const ObjectModels& models,
                             RigidBodies& bodies, CurrentHull& hull)
    : scene_(scene),
      models_(models),
      bodies_(bodies),
      hull_(hull),
      kept_(scene.objects.size()),
      seen_motions_(scene.objects.size()),
      surface_motions_(scene.objects.size()),
      detected_(scene.objects.size()),
      lift_m_(scene.objects.size(), Vector3d::Zero()),
      probe_(scene, models, hull) {}

std::span<HullManifold> HullManifolds::before_step(double step_s, double before_s) {
  manifolds_.clear();
  kept_of_manifold_.clear();
  if (models_.touching.empty() || !hull_.query()) return {};
  if (hull_.frames() != frame_) follow_new_hull();
  for (const std::size_t object : models_.touching) {
    lift_m_[object].setZero();
    meet(object, step_s, before_s);
  }
  return manifolds_;
}

void HullManifolds::after_step() {
  for (std::size_t m = 0; m < manifolds_.size(); ++m)
    for (std::size_t i = 0; i < kept_of_manifold_[m].size(); ++i)
      kept_[manifolds_[m].object][kept_of_manifold_[m][i]].impulse_n_s =
          manifolds_[m].points[i].impulse_n_s;
}

void HullManifolds::forget(std::size_t object) {
  kept_[object].clear();
  seen_motions_[object].clear();
  surface_motions_[object].clear();
  detected_[object].clear();
}

void HullManifolds::reset() {
  for (std::size_t object = 0; object < kept_.size(); ++object) forget(object);
}

HullContacts HullManifolds::contacts(double before_s) const {
  HullContacts contacts;
  if (hull_.frames() != frame_) return contacts;  // no step has met the newest hull
  for (const std::size_t object : models_.touching) {
    if (kept_[object].empty()) continue;
    for (const HullPart& tracked : hull_.parts()) {
      const HullPart part = local(object, tracked);
      const Meeting meeting = meeting_with(object, part, before_s);
      contacts.count += has_contact(meeting);
      for (const KeptContact& contact : kept_[object])
        if (contact.part == part.id)
          contacts.deepest_m =
              std::max(contacts.deepest_m, -distance_m(contact, meeting.world_from_object));
    }
  }
  return contacts;
}

void HullManifolds::follow_new_hull() {
  const double between_s = hull_.time_s() - frame_time_s_;
  // After a pause, the parts' motion does not reach back to the last frame.
  if (!(between_s > 0 && between_s <= kMaxGap_s)) reset();
  const double reach_m = scene_.history ? scene_.history->max_speed_m_s * between_s : 0;
  for (std::size_t object = 0; object < kept_.size(); ++object) {
    std::vector<SurfaceMotion> motions =
        follow_hull(kept_[object], hull_.parts(), between_s, *hull_.query(), reach_m);
    surface_motions_[object].clear();
    for (const SurfaceMotion& motion : motions)
      if (continues(motion, seen_motions_[object])) surface_motions_[object].push_back(motion);
    seen_motions_[object] = std::move(motions);
  }
  for (auto& detected : detected_) detected.clear();
  frame_ = hull_.frames();
  frame_time_s_ = hull_.time_s();
}

// The part as the object meets it: with the motion of the surface that it touches.
HullPart HullManifolds::local(std::size_t object, HullPart part) const {
  for (const SurfaceMotion& motion : surface_motions_[object])
    if (motion.part == part.id) part.velocity_world_m_s += motion.velocity_world_m_s;
  return part;
}

// All parts first, because each may move the object and change its kept contacts.
void HullManifolds::meet(std::size_t object, double step_s, double before_s) {
  std::vector<HullPart> parts;
  for (const HullPart& tracked : hull_.parts()) parts.push_back(local(object, tracked));
  std::vector<Meeting> near;
  for (const HullPart& part : parts) {
    const Meeting meeting = meeting_with(object, part, before_s);
    drop_left(kept_[object], part.id, meeting.world_from_object);
    if (!is_near(meeting, step_s)) continue;
    if (!is_still(meeting)) touch(meeting, step_s);
    move_out(meeting, kHullCorrection);
    near.push_back(meeting);
  }
  for (const Meeting& meeting : near) add_manifold(meeting);
}

HullManifolds::Meeting HullManifolds::meeting_with(std::size_t object, const HullPart& part,
                                                   double before_s) const {
  const Isometry3d newest_from_now = newest_from_before(part, before_s);
  const RigidVelocity velocity = velocity_before(part, before_s);
  const Vector3d center_m = bodies_.center_world_m(object);
  return {{object, part, newest_from_now, newest_from_now * bodies_.world_from_object(object),
           newest_from_now * center_m},
          velocity,
          newest_from_now.linear() * (bodies_.velocity_m_s(object) - velocity.at(center_m))};
}

bool HullManifolds::is_near(const Meeting& meeting, double step_s) const {
  const double reach_m =
      models_.objects[meeting.object].radius_m + step_s * meeting.relative_m_s.norm();
  return meeting.part.box_world_m.squaredExteriorDistance(meeting.center_world_m) <=
         reach_m * reach_m;
}

bool HullManifolds::has_contact(const Meeting& meeting) const {
  const std::vector<KeptContact>& kept = kept_[meeting.object];
  return std::any_of(kept.begin(), kept.end(),
                     [&](const KeptContact& contact) { return contact.part == meeting.part.id; });
}

bool HullManifolds::is_still(const Meeting& meeting) const {
  if (!has_contact(meeting)) return false;
  const double radius_m = models_.objects[meeting.object].radius_m;
  for (const Detected& last : detected_[meeting.object]) {
    if (last.part != meeting.part.id) continue;
    const Isometry3d &before = last.world_from_object, &now = meeting.world_from_object;
    return (now.translation() - before.translation()).norm() <= kStill_m &&
           (now.linear() - before.linear()).norm() * radius_m <= kStill_m;
  }
  return false;
}

collision::ObjectCollision HullManifolds::detect_before(const Meeting& meeting, double back_s) {
  return probe_.detect(moved(meeting, -back_s * meeting.relative_m_s));
}

HullManifolds::Touch HullManifolds::first_touch(const Meeting& meeting, double step_s,
                                                bool is_new) {
  Touch now{0, detect_before(meeting, 0)};
  const double speed_m_s = meeting.relative_m_s.norm();
  if (!is_new || (now.collision.points.empty() && !(step_s * speed_m_s > kSweep_m))) return now;
  // The hull of the last step may be that of an earlier frame and be smaller by some pixels.
  double from_s = step_s;
  if (!now.collision.points.empty()) {
    const double footprint_m =
        collision::pixel_footprint_m(*hull_.query(), now.collision.points.front().p_world_m);
    from_s += std::min(step_s, kPlaneTolerance * footprint_m / speed_m_s);
  }
  // A contact that existed before did not begin within the step.
  if (!detect_before(meeting, from_s).points.empty()) return now;
  const int sweeps =
      int(std::clamp(std::ceil(from_s * speed_m_s / kSweep_m), 1.0, double(kMaxSweeps)));
  double free_s = from_s;
  Touch first;
  for (int i = sweeps - 1; i >= 0 && first.collision.points.empty(); --i) {
    const double back_s = from_s * i / sweeps;
    collision::ObjectCollision found = i > 0 ? detect_before(meeting, back_s) : now.collision;
    if (found.points.empty())
      free_s = back_s;
    else
      first = {back_s, std::move(found)};
  }
  if (first.collision.points.empty()) return now;
  for (int i = 0; i < kBisections; ++i) {
    const double back_s = 0.5 * (free_s + first.back_s);
    collision::ObjectCollision found = detect_before(meeting, back_s);
    if (found.points.empty())
      free_s = back_s;
    else
      first = {back_s, std::move(found)};
  }
  ++counters_.impacts;
  return first;
}

std::vector<KeptContact> HullManifolds::kept_with(const Meeting& meeting) const {
  std::vector<KeptContact> contacts;
  for (const KeptContact& contact : kept_[meeting.object])
    if (contact.part == meeting.part.id) contacts.push_back(contact);
  return contacts;
}

void HullManifolds::touch(const Meeting& meeting, double step_s) {
  std::vector<Detected>& detected = detected_[meeting.object];
  std::erase_if(detected, [&](const Detected& last) { return last.part == meeting.part.id; });
  detected.push_back({meeting.part.id, meeting.world_from_object});
  const std::vector<KeptContact> kept = kept_with(meeting);
  const bool is_new = kept.empty();
  if (!is_new && probe_.is_explained(meeting, kept)) return;
  const Touch found = first_touch(meeting, step_s, is_new);
  if (found.collision.points.empty()) return;
  const PlacedObject touching = moved(meeting, -found.back_s * meeting.relative_m_s);
  std::vector<KeptContact> measured = probe_.measure(touching, found.collision);
  const Isometry3d& at_touch = touching.world_from_object;
  if (is_new) begin_at_touch(measured, at_touch);
  drop_left(measured, meeting.part.id, at_touch);
  add_contacts(kept_[meeting.object], meeting.part.id, measured, at_touch);
  if (!has_contact(meeting)) ++counters_.unrecovered;
  if (is_new && found.back_s > 0) move_out(meeting, 1);
}

// The object touches, whatever the measured planes: the hull's pixels reach further than its mean
// surface.
void HullManifolds::begin_at_touch(std::vector<KeptContact>& measured, const Isometry3d& at_touch) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const KeptContact& contact : measured)
    nearest_m = std::min(nearest_m, distance_m(contact, at_touch));
  if (!(nearest_m > 0)) return;
  for (KeptContact& contact : measured) contact.on_hull_world_m += nearest_m * contact.normal_world;
}

// Moves the object out of its deepest plane, by this fraction of the depth. It carries no velocity.
void HullManifolds::move_out(const Meeting& meeting, double fraction) {
  const Isometry3d newest_from_object =
      meeting.newest_from_now * bodies_.world_from_object(meeting.object);
  double deepest_m = 0;
  Vector3d normal = Vector3d::Zero(), point_m = Vector3d::Zero();
  // Of equally deep contacts the first: rounding must not choose, because the move turns a door.
  for (const KeptContact& contact : kept_[meeting.object])
    if (const double depth_m = -distance_m(contact, newest_from_object);
        contact.part == meeting.part.id && depth_m > deepest_m + collision::kEqual_m) {
      deepest_m = depth_m;
      normal = contact.normal_world;
      point_m = point_world_m(contact, newest_from_object);
    }
  if (!(deepest_m > 0)) return;
  const Vector3d normal_now = meeting.newest_from_now.linear().transpose() * normal;
  const Vector3d point_now_m = meeting.newest_from_now.inverse() * point_m;
  const Vector3d velocity_m_s =
      bodies_.velocity_m_s(meeting.object, point_now_m) - meeting.velocity.at(point_now_m);
  if (normal_now.dot(velocity_m_s) > kMinBounce_m_s) return;  // it leaves by itself
  lift_m_[meeting.object] +=
      bodies_.move_out(meeting.object, point_now_m, fraction * deepest_m * normal_now);
}

void HullManifolds::add_manifold(const Meeting& meeting) {
  const std::size_t object = meeting.object;
  // move_out() may have moved it since.
  const Isometry3d newest_from_object = meeting.newest_from_now * bodies_.world_from_object(object),
                   now_from_newest = meeting.newest_from_now.inverse();
  HullManifold manifold{object, meeting.velocity};
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < kept_[object].size(); ++i) {
    const KeptContact& contact = kept_[object][i];
    if (contact.part != meeting.part.id) continue;
    HullContactPoint point{
        .on_object_world_m = now_from_newest * point_world_m(contact, newest_from_object),
        .normal_world = meeting.newest_from_now.linear().transpose() * contact.normal_world,
        .distance_m = distance_m(contact, newest_from_object),
        .restitution = 0,
        .impulse_n_s = contact.impulse_n_s};
    const double approach_m_s =
        -point.normal_world.dot(bodies_.velocity_m_s(object, point.on_object_world_m) -
                                meeting.velocity.at(point.on_object_world_m));
    if (approach_m_s > kMinBounce_m_s) {
      // The move out has added the energy of its lift; the bounce takes it back.
      const double lifted = 2 * scene_.gravity_m_s2 * std::max(0.0, lift_m_[object].z()) /
                            (approach_m_s * approach_m_s);
      point.restitution = scene_.objects[object].restitution * std::sqrt(std::max(0.0, 1 - lifted));
    }
    manifold.points.push_back(point);
    indices.push_back(i);
  }
  if (manifold.points.empty()) return;
  ++counters_.contacts;
  manifolds_.push_back(std::move(manifold));
  kept_of_manifold_.push_back(std::move(indices));
}

}  // namespace fivepipe::sim
