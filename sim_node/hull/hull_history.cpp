#include "sim_node/hull/hull_history.h"

#include <algorithm>

#include "common/collision/response/recovery.h"

namespace fivepipe::sim {
namespace {

using Eigen::Vector3d;

static_assert(config::kMaxHistoryCells == double(collision::kMaxComponentCells));

// Returns the box around a ball that moves on a line between two points.
Eigen::AlignedBox3d swept(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                          double radius_m) {
  const Eigen::Vector3d radius = Eigen::Vector3d::Constant(radius_m);
  return {from_m.cwiseMin(to_m) - radius, from_m.cwiseMax(to_m) + radius};
}

double radius_m(const collision::HullComponent& component) {
  const Eigen::AlignedBox3d& box = component.box_world_m;
  return (box.max() - component.centroid_world_m)
      .cwiseMax(component.centroid_world_m - box.min())
      .norm();
}

// Conservative for any rotation of the component about its centroid and of the object about the
// origin of its frame.
bool may_collide(const collision::HullComponent& before, const collision::HullComponent& now,
                 const collision::MovingObject& object) {
  const double object_radius_m = object.tree->origin_m().norm() + object.tree->radius_m();
  return swept(before.centroid_world_m, now.centroid_world_m,
               std::max(radius_m(before), radius_m(now)))
      .intersects(swept(object.world_from_object_before.translation(),
                        object.world_from_object_after.translation(), object_radius_m));
}

}  // namespace

HullHistory::HullHistory(const config::HistoryRequests& requests,
                         const Eigen::AlignedBox3d& within_world_m, base::WorkerPool& pool,
                         std::size_t objects, const hull::HullRule& rule)
    : options_{.within_world_m = within_world_m, .cell_m = requests.cell_m, .outlines = true},
      rule_(rule),
      tracker_({.window_frames = requests.window_frames,
                .max_speed_m_s = requests.max_speed_m_s,
                .max_gap_s = kMaxGap_s}),
      frames_{Frame(pool), Frame(pool)},
      world_from_objects_before_(objects) {
  hull::CpuHull empty(pool);
  collision::hull_components(hull::HullQuery(empty), options_);  // throws if options_ are invalid
}

void HullHistory::add(double time_s, std::span<const hull::Silhouette> silhouettes) {
  now_ = 1 - now_;
  Frame& now = frames_[now_];
  now.hull.assign(silhouettes, rule_);
  now.query.emplace(now.hull);
  now.time_s = time_s;
  now.components = tracker_.add(time_s, collision::hull_components(*now.query, options_));
}

void HullHistory::keep_pose(std::size_t object, const Eigen::Isometry3d& world_from_object) {
  world_from_objects_before_[object] = world_from_object;
}

void HullHistory::forget_pose(std::size_t object) { world_from_objects_before_[object].reset(); }

void HullHistory::forget_poses() {
  std::fill(world_from_objects_before_.begin(), world_from_objects_before_.end(), std::nullopt);
}

std::vector<HullPart> HullHistory::parts() const {
  const Frame &before = frames_[1 - now_], &now = frames_[now_];
  std::vector<HullPart> parts;
  for (const collision::TrackedComponent& tracked : now.components) {
    const collision::HullComponent& component = tracked.component;
    HullPart& part = parts.emplace_back();
    part.id = tracked.id;
    // The component's smallest cells are in it if their centres are in the hull.
    const Vector3d cell_m = Vector3d::Constant(options_.cell_m);
    part.box_world_m = {component.box_world_m.min() - cell_m, component.box_world_m.max() + cell_m};
    part.center_world_m = component.centroid_world_m;
    // Null unless the component is tracked: others have new ids.
    const collision::TrackedComponent* previous = previous_component(tracked.id);
    if (!previous) continue;
    const double between_s = now.time_s - before.time_s;
    const Vector3d velocity_m_s =
        (component.centroid_world_m - previous->component.centroid_world_m) / between_s;
    const double footprint_m = collision::pixel_footprint_m(*now.query, component.centroid_world_m);
    const auto& motion = tracked.motion;
    const bool moves = motion ? motion->velocity_world_m_s.norm() * motion->window_s > footprint_m
                              : velocity_m_s.norm() * between_s > footprint_m;
    if (moves) part.velocity_world_m_s = velocity_m_s;
    if (motion &&
        motion->angular_velocity_world_rad_s.norm() * motion->window_s * radius_m(component) >
            footprint_m)
      part.angular_velocity_world_rad_s = motion->angular_velocity_world_rad_s;
  }
  return parts;
}

const collision::TrackedComponent* HullHistory::previous_component(std::uint64_t id) const {
  for (const collision::TrackedComponent& tracked : frames_[1 - now_].components)
    if (tracked.id == id) return &tracked;
  return nullptr;
}

std::optional<ComponentContact> HullHistory::first_contact(
    std::size_t object, const collision::Bvh& bvh,
    const Eigen::Isometry3d& world_from_object) const {
  const auto& world_from_object_before = world_from_objects_before_[object];
  if (!world_from_object_before) return std::nullopt;
  const collision::MovingObject moving{&bvh, *world_from_object_before, world_from_object};
  const Frame &before = frames_[1 - now_], &now = frames_[now_];
  std::optional<ComponentContact> earliest;
  for (const collision::TrackedComponent& tracked : now.components) {
    // Null unless the component is tracked: others have new ids.
    const collision::TrackedComponent* previous = previous_component(tracked.id);
    if (!previous || !may_collide(previous->component, tracked.component, moving)) continue;
    collision::FirstContactOptions options;
    if (tracked.motion)
      options.rotation_world_rad =
          (now.time_s - before.time_s) * tracked.motion->angular_velocity_world_rad_s;
    const auto contact =
        collision::first_contact({&*before.query, before.time_s, previous->component},
                                 {&*now.query, now.time_s, tracked.component}, moving, options);
    if (contact && contact->time_s > before.time_s &&
        (!earliest || contact->time_s < earliest->contact.time_s))
      earliest = {*contact, tracked.id};
  }
  return earliest;
}

}  // namespace fivepipe::sim
