#include "common/study/session_timeline.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "common/collision/proximity/proximity.h"

namespace fivepipe::study {

using collision::CollisionVerdict;

namespace {

// Of sums of times and durations.
constexpr double kTimeRounding_s = 1e-6;

}  // namespace

SessionTimeline::SessionTimeline(std::vector<TimelinePart> parts, const StudyOptions& options,
                                 base::WorkerPool& pool)
    : parts_(std::move(parts)), options_(options), pool_(pool), results_(parts_.size()) {
  check(options);
  for (const TimelinePart& part : parts_) trees_.emplace_back(part.mesh);
  for (int i = 0; i < pool.threads(); ++i)
    hulls_.push_back(std::make_unique<FrameHull>(options.rule, options.eps_m));
}

SessionTimeline::~SessionTimeline() = default;

void SessionTimeline::add(TimelineFrame frame) {
  if (frame.world_from_part.size() != parts_.size())
    throw std::invalid_argument("session timeline: one pose per part");
  if (frame.spacings_m.empty()) frame.spacings_m.resize(parts_.size());
  if (frame.spacings_m.size() != parts_.size())
    throw std::invalid_argument("session timeline: one spacing per part");
  waiting_.push_back(std::move(frame));
  if (waiting_.size() == kFramesPerBatch) compute();
}

const std::vector<std::vector<TimelinePoint>>& SessionTimeline::results() {
  compute();
  return results_;
}

void SessionTimeline::compute() {
  std::vector<std::vector<TimelinePoint>> found(waiting_.size());
  run_frames(pool_, waiting_.size(), [&](std::size_t frame, std::size_t thread) {
    FrameHull& hull = *hulls_[thread];
    hull.set(waiting_[frame].silhouettes);
    for (std::size_t part = 0; part < parts_.size(); ++part)
      found[frame].push_back(point_of(hull, waiting_[frame], part));
  });
  for (const std::vector<TimelinePoint>& of_parts : found)
    for (std::size_t part = 0; part < parts_.size(); ++part)
      results_[part].push_back(of_parts[part]);
  waiting_.clear();
}

TimelinePoint SessionTimeline::point_of(FrameHull& hull, const TimelineFrame& frame,
                                        std::size_t part) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  TimelinePoint point{frame.time_s, frame.duration_s, CollisionVerdict::undecided, {0, kInfinity}};
  if (hull.is_unknown()) return point;
  const Eigen::Isometry3d& world_from_part = frame.world_from_part[part];
  const collision::DetectionObject object{&trees_[part], world_from_part};
  point.verdict = hull.detector->detect({&object, 1})[0].verdict;
  if (point.verdict == CollisionVerdict::colliding) {
    point.clearance = {0, 0};
    if (const auto& depth = parts_[part].depth)
      point.penetration = (*depth)(hull, frame.spacings_m[part]);
  } else if (hull.is_empty()) {
    point.clearance = {options_.clearance_cap_m, kInfinity};
  } else {
    collision::HullProximity proximity(*hull.query,
                                       {options_.clearance_cap_m, options_.tolerance_m});
    const collision::Proximity found = proximity.of_part(trees_[part], world_from_part);
    point.clearance = {std::min(found.min_m, options_.clearance_cap_m), found.max_m};
  }
  return point;
}

std::vector<CollisionEvent> collision_events(std::span<const TimelinePoint> timeline,
                                             double min_gap_s) {
  std::vector<CollisionEvent> events;
  for (std::size_t i = 0; i < timeline.size(); ++i) {
    if (timeline[i].verdict != CollisionVerdict::colliding) continue;
    const auto end_s = [&](std::size_t frame) {
      return timeline[frame].time_s + timeline[frame].duration_s;
    };
    const bool continues = !events.empty() && timeline[i].time_s - end_s(events.back().last) <=
                                                  min_gap_s + kTimeRounding_s;
    if (continues)
      events.back().last = i;
    else
      events.push_back({i, i});
  }
  return events;
}

Bracket max_penetration(std::span<const TimelinePoint> timeline, const CollisionEvent& event) {
  Bracket largest{0, 0};
  for (std::size_t i = event.first; i <= event.last; ++i)
    largest = {std::max(largest.min_m, timeline[i].penetration.min_m),
               std::max(largest.max_m, timeline[i].penetration.max_m)};
  return largest;
}

}  // namespace fivepipe::study
