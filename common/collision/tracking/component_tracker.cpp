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
  parts_.clear();
  tracks_.clear();
}

Vector3d ComponentTracker::predicted_center_m(std::size_t i, double time_s) const {
  const Vector3d& middle = parts_[i].part.centroid_world_m;
  return parts_[i].motion
             ? Vector3d(middle + (time_s - time_s_) * parts_[i].motion->velocity_world_m_s)
             : middle;
}

// Returns for each component of this frame the index of its unambiguous predecessor.
std::vector<std::optional<std::size_t>> ComponentTracker::match(
    double time_s, const std::vector<HullComponent>& parts) const {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double reach_m = options_.max_speed_m_s * (time_s - time_s_);
  const auto apart_m = [&](std::size_t before, std::size_t now) {
    const double m = distance_m(predicted_center_m(before, time_s), parts[now].centroid_world_m);
    return distance_m(parts_[before].part.centroid_world_m, parts[now].centroid_world_m) <= reach_m
               ? m
               : kNone;
  };
  std::vector<std::optional<std::size_t>> matches(parts.size());
  for (std::size_t now = 0; now < parts.size(); ++now) {
    std::size_t best = parts_.size();
    for (std::size_t before = 0; before < parts_.size(); ++before)
      if (best == parts_.size() || apart_m(before, now) < apart_m(best, now)) best = before;
    if (best == parts_.size() || apart_m(best, now) == kNone) continue;
    const double m = apart_m(best, now), ratio = parts[now].volume_m3 / parts_[best].part.volume_m3;
    bool clear = ratio <= kMaxVolumeRatio && ratio * kMaxVolumeRatio >= 1;
    for (std::size_t other = 0; other < parts_.size(); ++other)
      clear &= other == best || kMatchRatio * m <= apart_m(other, now);
    for (std::size_t other = 0; other < parts.size(); ++other)
      clear &= other == now || kMatchRatio * m <= apart_m(best, other);
    if (clear) matches[now] = best;
  }
  return matches;
}

const std::vector<TrackedComponent>& ComponentTracker::add(
    double time_s, const std::vector<HullComponent>& parts) {
  if (!std::isfinite(time_s))
    throw std::invalid_argument("component tracker: time_s is not finite");
  if (!(time_s > time_s_ && time_s - time_s_ <= options_.max_gap_s)) reset();
  const auto matches = match(time_s, parts);
  std::vector<std::optional<std::size_t>> successor(parts_.size());  // index in `parts`
  for (std::size_t now = 0; now < parts.size(); ++now)
    if (matches[now]) successor[*matches[now]] = now;
  // Candidates for merges and splits, in addition to the matches: predicted boxes meet.
  const auto met = [&](std::size_t before, std::size_t now) {
    const Vector3d moved =
        predicted_center_m(before, time_s) - parts_[before].part.centroid_world_m;
    return boxes_meet(parts_[before].part.box_world_m, moved, parts[now].box_world_m,
                      0.5 * moved.norm());
  };
  // The boxes of unrelated components can meet too, so the volume of a matched component must
  // confirm a merge or split.
  const auto joins = [&](std::size_t before, std::size_t now) {
    if (successor[before] || !met(before, now)) return false;
    if (!matches[now]) return true;
    const double was_m3 = parts_[*matches[now]].part.volume_m3;
    return accounts_for(parts_[before].part.volume_m3, parts[now].volume_m3 - was_m3, was_m3);
  };
  const auto leaves = [&](std::size_t before, std::size_t now) {
    if (matches[now] || !met(before, now)) return false;
    const double was_m3 = parts_[before].part.volume_m3;
    return !successor[before] ||
           accounts_for(parts[now].volume_m3, was_m3 - parts[*successor[before]].volume_m3, was_m3);
  };
  std::vector<TrackedComponent> tracked;
  std::vector<Track> tracks;
  for (std::size_t now = 0; now < parts.size(); ++now) {
    TrackedComponent f{0, ComponentOrigin::appeared, {}, parts[now], std::nullopt};
    Track track;
    std::vector<std::size_t> joined, split_off;
    for (std::size_t before = 0; before < parts_.size(); ++before)
      if (matches[now] == before || joins(before, now)) joined.push_back(before);
    for (std::size_t other = 0; other < parts.size() && joined.size() == 1; ++other)
      if (other != now && leaves(joined[0], other)) split_off.push_back(other);
    for (std::size_t before = 0; before < parts_.size() && joined.empty(); ++before)
      if (leaves(before, now)) joined.push_back(before), split_off.push_back(now);
    for (const std::size_t before : joined) f.from.push_back(parts_[before].id);
    if (joined.size() > 1)
      f.origin = ComponentOrigin::merged;
    else if (!split_off.empty())
      f.origin = ComponentOrigin::split;
    else if (matches[now])
      f.origin = ComponentOrigin::tracked, f.id = parts_[*matches[now]].id,
      track = tracks_[*matches[now]];
    else
      f.from.clear();
    if (f.id == 0) f.id = next_id_++;
    track.window.push_back({time_s, parts[now].centroid_world_m, parts[now].outlines});
    if (int(track.window.size()) > options_.window_frames) track.window.pop_front();
    f.motion = motion_of(track, parts[now]);
    tracked.push_back(std::move(f));
    tracks.push_back(std::move(track));
  }
  parts_ = std::move(tracked);
  tracks_ = std::move(tracks);
  time_s_ = time_s;
  return parts_;
}

std::optional<ComponentMotion> ComponentTracker::motion_of(Track& track,
                                                           const HullComponent& part) const {
  if (int(track.window.size()) < kMinFrames) return std::nullopt;
  ComponentMotion motion;
  motion.frames = int(track.window.size());
  motion.window_s = track.window.back().time_s - track.window.front().time_s;
  motion.velocity_world_m_s = linear_velocity_m_s(track.window);
  const double size_m = std::sqrt(part.covariance_world_m2.trace());
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
