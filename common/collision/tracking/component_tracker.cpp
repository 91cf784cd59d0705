#include "common/collision/tracking/component_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// Largest ratio of volumes between a component and its predecessor. The hull's volume changes as
// other parts of the object become visible.
constexpr double kMaxVolumeRatio = 2;
constexpr int kMinFrames = 3;
// Smallest component that can merge with or split from a tracked one, as a fraction of the latter's
// volume. The hull's own variation of volume hides a smaller one.
constexpr double kMinVolumeFraction = 0.1;
// A merge or split changes the tracked component's volume by at least this fraction of the other
// component's volume.
constexpr double kMinVolumeChange = 0.5;

double distance_m(const Vector3d& a, const Vector3d& b) { return (a - b).norm(); }

// Returns whether a component of volume other_m3 explains that one of whole_m3 grew or shrank by
// change_m3.
bool accounts_for(double other_m3, double change_m3, double whole_m3) {
  return other_m3 >= kMinVolumeFraction * whole_m3 && change_m3 >= kMinVolumeChange * other_m3;
}

bool boxes_meet(const Eigen::AlignedBox3d& a, const Vector3d& moved_m, const Eigen::AlignedBox3d& b,
                double slack_m) {
  Eigen::AlignedBox3d moved = a;
  moved.translate(moved_m);
  const Vector3d slack = Vector3d::Constant(slack_m);
  return Eigen::AlignedBox3d(moved.min() - slack, moved.max() + slack).intersects(b);
}

// Returns the slope of the least-squares line through the centroids over time.
Vector3d linear_velocity_m_s(const std::deque<OutlineSnapshot>& window) {
  double mean_s = 0, spread_s2 = 0;
  Vector3d mean_m = Vector3d::Zero(), slope = Vector3d::Zero();
  for (const OutlineSnapshot& at : window)
    mean_s += at.time_s / double(window.size()),
        mean_m += at.centroid_world_m / double(window.size());
  for (const OutlineSnapshot& at : window)
    spread_s2 += (at.time_s - mean_s) * (at.time_s - mean_s),
        slope += (at.time_s - mean_s) * (at.centroid_world_m - mean_m);
  return slope / spread_s2;
}

// Origin of a component and the indices of its predecessors.
struct Ancestry {
  ComponentOrigin origin = ComponentOrigin::appeared;
  std::vector<std::size_t> from;
};

// Relates the components of two frames: matches, merges and splits.
class FrameLink {
 public:
  // moved_m: predicted motion of each previous component. predecessors: match of each component.
  FrameLink(const std::vector<TrackedComponent>& previous,
            const std::vector<HullComponent>& components, const std::vector<Vector3d>& moved_m,
            std::vector<std::optional<std::size_t>> predecessors)
      : previous_(previous),
        components_(components),
        moved_m_(moved_m),
        predecessors_(std::move(predecessors)),
        successors_(previous.size()) {
    for (std::size_t now = 0; now < components.size(); ++now)
      if (predecessors_[now]) successors_[*predecessors_[now]] = now;
  }

  Ancestry ancestry(std::size_t now) const {
    Ancestry result;
    for (std::size_t before = 0; before < previous_.size(); ++before)
      if (predecessors_[now] == before || merges(before, now)) result.from.push_back(before);
    if (result.from.size() > 1) {
      result.origin = ComponentOrigin::merged;
      return result;
    }
    bool is_split = false;
    if (result.from.empty()) {
      for (std::size_t before = 0; before < previous_.size() && !is_split; ++before)
        if ((is_split = splits_off(before, now))) result.from = {before};
    } else {
      for (std::size_t other = 0; other < components_.size() && !is_split; ++other)
        is_split = other != now && splits_off(result.from[0], other);
    }
    if (is_split)
      result.origin = ComponentOrigin::split;
    else if (predecessors_[now])
      result.origin = ComponentOrigin::tracked;
    else
      result.from.clear();
    return result;
  }

 private:
  // A candidate for a merge or split, in addition to the matches: the predicted boxes meet.
  bool meets(std::size_t before, std::size_t now) const {
    return boxes_meet(previous_[before].component.box_world_m, moved_m_[before],
                      components_[now].box_world_m, 0.5 * moved_m_[before].norm());
  }
  // The boxes of unrelated components can meet too, so the volume of a matched component must
  // confirm a merge or split.
  bool merges(std::size_t before, std::size_t now) const {
    if (successors_[before] || !meets(before, now)) return false;
    if (!predecessors_[now]) return true;
    const double before_m3 = previous_[*predecessors_[now]].component.volume_m3;
    return accounts_for(previous_[before].component.volume_m3,
                        components_[now].volume_m3 - before_m3, before_m3);
  }
  bool splits_off(std::size_t before, std::size_t now) const {
    if (predecessors_[now] || !meets(before, now)) return false;
    const double before_m3 = previous_[before].component.volume_m3;
    return !successors_[before] ||
           accounts_for(components_[now].volume_m3,
                        before_m3 - components_[*successors_[before]].volume_m3, before_m3);
  }

  const std::vector<TrackedComponent>& previous_;
  const std::vector<HullComponent>& components_;
  const std::vector<Vector3d>& moved_m_;
  std::vector<std::optional<std::size_t>> predecessors_, successors_;
};

}  // namespace

ComponentTracker::ComponentTracker(const ComponentTrackerOptions& options) : options_(options) {
  if (options.window_frames < kMinFrames)
    throw std::invalid_argument("component tracker: window_frames is below 3");
  if (!(options.max_speed_m_s > 0))
    throw std::invalid_argument("component tracker: max_speed_m_s is not positive");
  if (!(options.max_gap_s > 0))
    throw std::invalid_argument("component tracker: max_gap_s is not positive");
}

void ComponentTracker::reset() {
  components_.clear();
  tracks_.clear();
}

Vector3d ComponentTracker::predicted_center_m(std::size_t previous, double time_s) const {
  const TrackedComponent& tracked = components_[previous];
  const Vector3d& center = tracked.component.centroid_world_m;
  return tracked.motion ? Vector3d(center + (time_s - time_s_) * tracked.motion->velocity_world_m_s)
                        : center;
}

std::vector<std::optional<std::size_t>> ComponentTracker::match(
    double time_s, const std::vector<HullComponent>& components) const {
  constexpr double kOutOfReach = std::numeric_limits<double>::infinity();
  const double reach_m = options_.max_speed_m_s * (time_s - time_s_);
  const std::vector<TrackedComponent>& previous = components_;
  const auto gap_m = [&](std::size_t before, std::size_t now) {
    const Vector3d& center = components[now].centroid_world_m;
    const double from_prediction_m = distance_m(predicted_center_m(before, time_s), center);
    return distance_m(previous[before].component.centroid_world_m, center) <= reach_m
               ? from_prediction_m
               : kOutOfReach;
  };
  std::vector<std::optional<std::size_t>> predecessors(components.size());
  for (std::size_t now = 0; now < components.size(); ++now) {
    std::size_t best = previous.size();
    for (std::size_t before = 0; before < previous.size(); ++before)
      if (best == previous.size() || gap_m(before, now) < gap_m(best, now)) best = before;
    if (best == previous.size() || gap_m(best, now) == kOutOfReach) continue;
    const double best_m = gap_m(best, now),
                 ratio = components[now].volume_m3 / previous[best].component.volume_m3;
    bool unambiguous = ratio <= kMaxVolumeRatio && ratio * kMaxVolumeRatio >= 1;
    for (std::size_t other = 0; other < previous.size(); ++other)
      unambiguous &= other == best || kMatchRatio * best_m <= gap_m(other, now);
    for (std::size_t other = 0; other < components.size(); ++other)
      unambiguous &= other == now || kMatchRatio * best_m <= gap_m(best, other);
    if (unambiguous) predecessors[now] = best;
  }
  return predecessors;
}

const std::vector<TrackedComponent>& ComponentTracker::add(
    double time_s, const std::vector<HullComponent>& components) {
  if (!std::isfinite(time_s))
    throw std::invalid_argument("component tracker: time_s is not finite");
  if (!(time_s > time_s_ && time_s - time_s_ <= options_.max_gap_s)) reset();
  std::vector<Vector3d> moved_m;
  for (std::size_t i = 0; i < components_.size(); ++i)
    moved_m.push_back(predicted_center_m(i, time_s) - components_[i].component.centroid_world_m);
  const FrameLink link(components_, components, moved_m, match(time_s, components));
  std::vector<TrackedComponent> tracked;
  std::vector<Track> tracks;
  for (std::size_t now = 0; now < components.size(); ++now) {
    const Ancestry ancestry = link.ancestry(now);
    TrackedComponent next{0, ancestry.origin, {}, components[now], std::nullopt};
    for (const std::size_t before : ancestry.from) next.from.push_back(components_[before].id);
    Track track;
    if (ancestry.origin == ComponentOrigin::tracked)
      next.id = components_[ancestry.from[0]].id, track = tracks_[ancestry.from[0]];
    else
      next.id = next_id_++;
    track.window.push_back({time_s, components[now].centroid_world_m, components[now].outlines});
    if (int(track.window.size()) > options_.window_frames) track.window.pop_front();
    next.motion = motion_of(track, components[now]);
    tracked.push_back(std::move(next));
    tracks.push_back(std::move(track));
  }
  components_ = std::move(tracked);
  tracks_ = std::move(tracks);
  time_s_ = time_s;
  return components_;
}

std::optional<ComponentMotion> ComponentTracker::motion_of(Track& track,
                                                           const HullComponent& component) const {
  if (int(track.window.size()) < kMinFrames) return std::nullopt;
  ComponentMotion motion;
  motion.frames = int(track.window.size());
  motion.window_s = track.window.back().time_s - track.window.front().time_s;
  motion.velocity_world_m_s = linear_velocity_m_s(track.window);
  const double size_m = std::sqrt(component.covariance_world_m2.trace());
  const auto fit = outline_motion(
      track.window,
      track.guess.value_or(UniformMotion{motion.velocity_world_m_s, Vector3d::Zero()}), size_m);
  track.guess.reset();
  if (!fit) return motion;
  track.guess = fit->motion;
  motion.velocity_world_m_s = fit->motion.velocity_world_m_s;
  motion.angular_velocity_world_rad_s = fit->motion.angular_velocity_world_rad_s;
  motion.determined_axes = fit->determined_axes;
  motion.residual_m = fit->residual_m;
  return motion;
}

}  // namespace fivepipe::collision
