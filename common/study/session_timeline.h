// Collisions and clearance of virtual parts over the time of a recorded session.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "common/collision/detection/bvh.h"
#include "common/study/frame_hull.h"
#include "common/study/part_depth.h"
#include "common/study/spacing_study.h"

namespace fivepipe::study {

struct TimelinePart {
  geometry::Mesh mesh;                            // in its own frame [m]
  std::optional<PartDepth> depth = std::nullopt;  // nullopt: penetrations are not computed
};

struct TimelineFrame {
  std::vector<hull::Silhouette> silhouettes;
  double time_s, duration_s;
  std::vector<Eigen::Isometry3d> world_from_part;  // of each part
  std::vector<double> spacings_m = {};             // of each part, for its depth; empty: 0
};

// One frame of one part.
struct TimelinePoint {
  double time_s, duration_s;
  collision::CollisionVerdict verdict;
  // Minimum distance between the part's surface and the hull: {0, 0} if they collide, {cap_m,
  // infinity} if it is at least StudyOptions::clearance_cap_m, {0, infinity} if it is unknown.
  Bracket clearance;
  // Of a frame with a collision, if requested (PartDepth); else {0, 0}.
  Bracket penetration{0, 0};
};

// The results do not depend on the number of threads.
class SessionTimeline {
 public:
  // Throws std::invalid_argument as Bvh does, and if an option is out of range.
  SessionTimeline(std::vector<TimelinePart> parts, const StudyOptions& options,
                  base::WorkerPool& pool);
  ~SessionTimeline();

  // Computes a batch when it is full. Throws std::invalid_argument if the number of poses, or of
  // spacings if there are any, differs from that of the parts.
  void add(TimelineFrame frame);
  // By part and frame. Computes the frames that are still waiting.
  const std::vector<std::vector<TimelinePoint>>& results();

 private:
  void compute();
  TimelinePoint point_of(FrameHull& hull, const TimelineFrame& frame, std::size_t part) const;

  std::vector<TimelinePart> parts_;
  std::vector<collision::Bvh> trees_;  // of each part
  StudyOptions options_;
  base::WorkerPool& pool_;
  std::vector<std::unique_ptr<FrameHull>> hulls_;  // one per thread of the pool
  std::vector<TimelineFrame> waiting_;
  std::vector<std::vector<TimelinePoint>> results_;
};

// Frames in which a part collides, and those between them.
struct CollisionEvent {
  std::size_t first, last;  // positions in the timeline
};
// Two frames with a collision belong to one event if the time between the end of the first and the
// start of the second one is at most min_gap_s.
std::vector<CollisionEvent> collision_events(std::span<const TimelinePoint> timeline,
                                             double min_gap_s);
// The largest penetration of the event's frames.
Bracket max_penetration(std::span<const TimelinePoint> timeline, const CollisionEvent& event);

}  // namespace fivepipe::study
