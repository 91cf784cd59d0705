// The visual hull of the newest frame set, and collision detection against it.
#pragma once
#include <memory>
#include <optional>

#include "common/collision/response/response.h"
#include "common/config/deployment.h"
#include "common/hull/coverage/coverage_outline.h"
#include "common/hull/coverage/sparse_coverage.h"
#include "sim_node/hull/hull_history.h"

namespace fivepipe::sim {

// Needs a current OpenGL context for construction, use and destruction if config.collision is gl or
// paper.
class CurrentHull {
 public:
  // is_needed: whether the scene queries the hull. The scene's history needs it in any case, and
  // needs real_volume_world_m, the box that contains all real objects. Throws std::invalid_argument
  // if the history's box or cells are out of range.
  CurrentHull(const config::Scene& scene, const config::SimConfig& config, bool is_needed,
              const Eigen::AlignedBox3d& real_volume_world_m);

  // Sets the hull of a new frame set at time_s [s, any epoch]. Invalidates query() and all
  // detection results. outlines: of the silhouettes, or empty. Both must stay valid until the next
  // call of set().
  void set(double time_s, std::span<const hull::Silhouette> silhouettes,
           std::span<const hull::CoverageOutline> outlines = {});

  // Returns null before the first set(), or if the scene does not need the hull.
  const hull::HullQuery* query() const { return query_; }
  // The parts of the newest frame's hull: those of the history; without a history one part, the
  // whole hull at rest. Empty if query() is null.
  std::span<const HullPart> parts() const { return parts_; }
  const hull::HullRule& rule() const { return rule_; }
  // The maps of the last set(), which the caller owns.
  std::span<const hull::Silhouette> silhouettes() const { return silhouettes_; }
  // Returns these maps with their coverage; empty if the last set() had none. The first call after
  // set() makes them.
  std::span<const hull::CoverageSilhouette> coverage();
  double time_s() const { return time_s_; }  // of the last set()
  // Number of calls of set().
  std::uint64_t frames() const { return frames_; }
  HullHistory* history() { return history_ ? &*history_ : nullptr; }  // null: not in the scene
  const HullHistory* history() const { return history_ ? &*history_ : nullptr; }

  // The result is valid until the next detection, including requeries, or the next set().
  std::span<collision::ObjectCollision> detect(std::span<const collision::DetectionObject> objects);
  // Returns a query that detects the object again after a translation. Borrows this CurrentHull.
  collision::Requery requery(const collision::DetectionObject& object);
  // Summed over all queries up to the last detect().
  const collision::DetectorCounts& counts() const { return counts_; }

 private:
  bool is_needed_;
  base::WorkerPool pool_;
  std::optional<HullHistory> history_;  // holds the hulls if the scene has a history
  hull::CpuHull hull_{pool_};           // otherwise this one is used
  hull::HullRule rule_;
  std::optional<hull::HullQuery> own_query_;
  const hull::HullQuery* query_ = nullptr;
  std::vector<HullPart> parts_;
  std::span<const hull::Silhouette> silhouettes_;
  std::span<const hull::CoverageOutline> outlines_;
  std::vector<hull::CoverageSilhouette> coverage_;  // empty: not made yet, or no outlines
  double time_s_ = 0;
  std::uint64_t frames_ = 0;
  std::unique_ptr<collision::CollisionDetector> detector_;
  collision::DetectorCounts counts_;
};

}  // namespace fivepipe::sim
