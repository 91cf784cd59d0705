// What only history can give: the hull's parts followed over frames, and what they met between two of them. Keeps the frame before.
#pragma once
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "common/collision/first_contact.h"
#include "common/collision/part_tracker.h"
#include "common/scene/collision_wishes.h"

namespace fivepipe {

class HullHistory {
 public:
  // Parts are looked for in this box of the world. Throws std::invalid_argument where it is empty, not finite, or holds too many cells.
  HullHistory(const HistoryWishes& wishes, const Eigen::AlignedBox3d& within_world_m, WorkerPool& pool);

  // One more frame. A time that is not later than the last, or later by more than kLongestGapS, starts anew. The hull is at query() until the next.
  void add(double time_s, std::span<const Silhouette> silhouettes);
  const HullQuery& query() const { return *frames_[now_].query; }
  const std::vector<FollowedPart>& parts() const { return tracker_.parts(); }

  // The earliest that a part that was followed met the object in the time between the last two frames, and did not touch it at their
  // beginning; and the part's number. Nothing with one frame, or of parts that have just appeared, merged or split: who they were
  // nobody knows.
  std::optional<std::pair<FirstContact, std::uint64_t>> first_contact(const MovingObject& object) const;

 private:
  struct Frame {
    explicit Frame(WorkerPool& pool) : hull(pool) {}
    CpuHull hull;
    std::optional<HullQuery> query;
    double time_s = 0;
    std::vector<FollowedPart> parts;
  };
  const FollowedPart* part_before(std::uint64_t id) const;

  HullPartsOptions options_;
  PartTracker tracker_;
  std::array<Frame, 2> frames_;
  std::size_t now_ = 0;
  bool has_before_ = false, has_now_ = false;
};

// What a thing did in a longer time between two frames nobody can tell.
inline constexpr double kLongestGapS = 0.25;

}  // namespace fivepipe
