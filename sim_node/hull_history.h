// What only history can give: the hull's parts followed over frames, and what they met between two
// of them. Keeps the frame before.
#pragma once
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "common/collision/tracking/component_tracker.h"
#include "common/collision/tracking/first_contact.h"
#include "common/config/collision_requests.h"

namespace fivepipe::sim {

class HullHistory {
 public:
  // Parts are looked for in this box of the world. Throws std::invalid_argument where it is empty,
  // not finite, or holds too many cells.
  HullHistory(const config::HistoryRequests& requests, const Eigen::AlignedBox3d& within_world_m,
              base::WorkerPool& pool);

  // One more frame. A time that is not later than the last, or later by more than kMaxGap_s,
  // starts anew. The hull is at query() until the next.
  void add(double time_s, std::span<const hull::Silhouette> silhouettes);
  const hull::HullQuery& query() const { return *frames_[now_].query; }
  const std::vector<collision::TrackedComponent>& parts() const { return tracker_.parts(); }

  // The earliest that a part that was followed met the object in the time between the last two
  // frames, and did not touch it at their beginning; and the part's number. Nothing with one frame,
  // or of parts that have just appeared, merged or split: who they were nobody knows.
  std::optional<std::pair<collision::FirstContact, std::uint64_t>> first_contact(
      const collision::MovingObject& object) const;

 private:
  struct Frame {
    explicit Frame(base::WorkerPool& pool) : hull(pool) {}
    hull::CpuHull hull;
    std::optional<hull::HullQuery> query;
    double time_s = 0;
    std::vector<collision::TrackedComponent> parts;
  };
  const collision::TrackedComponent* previous_component(std::uint64_t id) const;

  collision::HullComponentsOptions options_;
  collision::ComponentTracker tracker_;
  std::array<Frame, 2> frames_;
  std::size_t now_ = 0;
  bool has_before_ = false, has_now_ = false;
};

// What a thing did in a longer time between two frames nobody can tell.
inline constexpr double kMaxGap_s = 0.25;

}  // namespace fivepipe::sim
