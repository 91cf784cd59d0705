#include "sim_node/hull_history.h"

#include <algorithm>

namespace fivepipe::sim {
namespace {

static_assert(config::kMaxHistoryCells == double(collision::kMaxComponentCells));

// Around a ball on its way from one point to the other.
Eigen::AlignedBox3d swept(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m,
                          double radius_m) {
  const Eigen::Vector3d radius = Eigen::Vector3d::Constant(radius_m);
  return {from_m.cwiseMin(to_m) - radius, from_m.cwiseMax(to_m) + radius};
}

double radius_m(const collision::HullComponent& part) {
  const Eigen::AlignedBox3d& box = part.box_world_m;
  return (box.max() - part.centroid_world_m).cwiseMax(part.centroid_world_m - box.min()).norm();
}

// However both turn meanwhile: the part about its middle, the object about its frame's origin.
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
                         const Eigen::AlignedBox3d& within_world_m, base::WorkerPool& pool)
    : options_{.within_world_m = within_world_m, .cell_m = requests.cell_m, .outlines = true},
      tracker_({.window_frames = requests.window_frames,
                .max_speed_m_s = requests.max_speed_m_s,
                .max_gap_s = kMaxGap_s}),
      frames_{Frame(pool), Frame(pool)} {
  hull::CpuHull nothing(pool);
  collision::hull_components(hull::HullQuery(nothing), options_);  // refuses what can't be
}

void HullHistory::add(double time_s, std::span<const hull::Silhouette> silhouettes) {
  const double gap_s = time_s - frames_[now_].time_s;
  has_before_ = has_now_ && gap_s > 0 && gap_s <= kMaxGap_s;
  now_ = 1 - now_;
  Frame& now = frames_[now_];
  now.query.reset();
  now.hull.assign(silhouettes);
  now.query.emplace(now.hull);
  now.time_s = time_s;
  now.parts = tracker_.add(time_s, collision::hull_components(*now.query, options_));
  has_now_ = true;
}

const collision::TrackedComponent* HullHistory::previous_component(std::uint64_t id) const {
  for (const collision::TrackedComponent& part : frames_[1 - now_].parts)
    if (part.id == id) return &part;
  return nullptr;
}

std::optional<std::pair<collision::FirstContact, std::uint64_t>> HullHistory::first_contact(
    const collision::MovingObject& object) const {
  std::optional<std::pair<collision::FirstContact, std::uint64_t>> earliest;
  if (!has_before_) return earliest;
  const Frame &before = frames_[1 - now_], &now = frames_[now_];
  for (const collision::TrackedComponent& part : now.parts) {
    const collision::TrackedComponent* was =
        part.origin == collision::ComponentOrigin::tracked ? previous_component(part.id) : nullptr;
    if (!was || !may_collide(was->part, part.part, object)) continue;
    collision::FirstContactOptions options;
    if (part.motion)
      options.rotation_world_rad =
          (now.time_s - before.time_s) * part.motion->angular_velocity_world_rad_s;
    const auto met =
        fivepipe::collision::first_contact({&*before.query, before.time_s, was->part},
                                           {&*now.query, now.time_s, part.part}, object, options);
    if (met && met->time_s > before.time_s && (!earliest || met->time_s < earliest->first.time_s))
      earliest = {*met, part.id};
  }
  return earliest;
}

}  // namespace fivepipe::sim
