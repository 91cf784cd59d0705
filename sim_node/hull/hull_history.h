// Results that need more than one frame: tracked hull components, and first contacts between the
// last two frames. Keeps the hulls of both frames.
#pragma once
#include <array>
#include <optional>
#include <vector>

#include "common/collision/tracking/component_tracker.h"
#include "common/collision/tracking/first_contact.h"
#include "common/config/collision_requests.h"
#include "sim_node/hull/hull_part.h"

namespace fivepipe::sim {

struct ComponentContact {
  collision::FirstContact contact;
  std::uint64_t component;  // TrackedComponent::id
};

class HullHistory {
 public:
  // Searches for components in this box. Throws std::invalid_argument if it is empty, not finite or
  // contains more than kMaxComponentCells cells, or if a request is out of range. `objects`: number
  // of objects in the scene.
  HullHistory(const config::HistoryRequests& requests, const Eigen::AlignedBox3d& within_world_m,
              base::WorkerPool& pool, std::size_t objects, const hull::HullRule& rule = {});

  // Adds a frame. The tracking of components restarts if time_s is not after the last frame's time
  // or more than kMaxGap_s after it. query() stays valid until the next call of add().
  void add(double time_s, std::span<const hull::Silhouette> silhouettes);
  const hull::HullQuery& query() const { return *frames_[now_].query; }
  const std::vector<collision::TrackedComponent>& components() const {
    return tracker_.components();
  }

  // Returns a part per component of the newest frame, in the order of components(). A tracked one
  // moves as its centroid has moved since the previous frame, and rotates with its motion's angular
  // velocity. A motion that the maps do not resolve counts as rest: one that is shorter than a
  // pixel's footprint over the time for which the component is observed.
  std::vector<HullPart> parts() const;

  // Stores an object's pose at the newest frame, for the first contacts of the next one.
  void keep_pose(std::size_t object, const Eigen::Isometry3d& world_from_object);
  // Forgets an object's stored pose. An object without a pose at the previous frame has no first
  // contact. Call forget_pose() if the object jumped.
  void forget_pose(std::size_t object);
  void forget_poses();

  // Returns the earliest contact between the last two frames of an object, which moved from its
  // kept pose to world_from_object, with a tracked component. Returns nullopt if there are fewer
  // than two frames, if object and component touched at the previous frame already, or if the
  // component appeared, merged or split at the last frame, so that its previous position is
  // unknown.
  std::optional<ComponentContact> first_contact(std::size_t object, const collision::Bvh& bvh,
                                                const Eigen::Isometry3d& world_from_object) const;

 private:
  struct Frame {
    explicit Frame(base::WorkerPool& pool) : hull(pool) {}
    hull::CpuHull hull;
    std::optional<hull::HullQuery> query;
    double time_s = 0;
    std::vector<collision::TrackedComponent> components;
  };
  const collision::TrackedComponent* previous_component(std::uint64_t id) const;

  collision::HullComponentsOptions options_;
  hull::HullRule rule_;
  collision::ComponentTracker tracker_;
  std::array<Frame, 2> frames_;
  std::size_t now_ = 0;
  std::vector<std::optional<Eigen::Isometry3d>> world_from_objects_before_;  // by object
};

// Maximum time between frames over which motion is interpolated: see
// ComponentTrackerOptions::max_gap_s.
inline constexpr double kMaxGap_s = 0.25;

}  // namespace fivepipe::sim
