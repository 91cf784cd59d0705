#include "common/collision/tracking/component_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fivepipe::collision {
namespace {

using Eigen::Vector3d;

// A part that is another one may be larger or smaller by this factor, not more: what it is seen of
// changes.
constexpr double kSameVolume = 2;
constexpr int kLeastFrames = 3;
// Of a part's volume: below it, whether something joined or left is not to be told from how the
// hull's volume changes by itself.
constexpr double kSpeck = 0.1;
// Of its volume, so much a part that joins adds at least, and one that leaves takes away.
constexpr double kAccounted = 0.5;

double distance_m(const Vector3d& a, const Vector3d& b) { return (a - b).norm(); }

// A part of volume whole_m3 that grew, or shrank, by change_m3: by another one of other_m3?
bool accounts_for(double other_m3, double change_m3, double whole_m3) {
  return other_m3 >= kSpeck * whole_m3 && change_m3 >= kAccounted * other_m3;
}

bool boxes_meet(const Eigen::AlignedBox3d& a, const Vector3d& moved_m, const Eigen::AlignedBox3d& b,
                double slack_m) {
  Eigen::AlignedBox3d moved = a;
  moved.translate(moved_m);
  const Vector3d slack = Vector3d::Constant(slack_m);
  return Eigen::AlignedBox3d(moved.min() - slack, moved.max() + slack).intersects(b);
}

// Of the line through the middles over time.
Vector3d slope_m_s(const std::deque<OutlinesAt>& window) {
  double mean_s = 0, spread_s2 = 0;
  Vector3d mean_m = Vector3d::Zero(), slope = Vector3d::Zero();
  for (const OutlinesAt& at : window)
    mean_s += at.time_s / double(window.size()),
        mean_m += at.middle_world_m / double(window.size());
  for (const OutlinesAt& at : window)
    spread_s2 += (at.time_s - mean_s) * (at.time_s - mean_s),
        slope += (at.time_s - mean_s) * (at.middle_world_m - mean_m);
  return slope / spread_s2;
}

}  // namespace

PartTracker::PartTracker(const PartTrackerOptions& options) : options_(options) {
  if (options.window_frames < kLeastFrames)
    throw std::invalid_argument("window of followed parts is shorter than three frames");
  if (!(options.fastest_m_s > 0))
    throw std::invalid_argument("fastest speed of followed parts is not positive");
  if (!(options.longest_gap_s > 0))
    throw std::invalid_argument("longest gap of followed parts is not positive");
}

void PartTracker::reset() {
  parts_.clear();
  tracks_.clear();
}

Vector3d PartTracker::expected_m(std::size_t i, double time_s) const {
  const Vector3d& middle = parts_[i].part.middle_world_m;
  return parts_[i].motion
             ? Vector3d(middle + (time_s - time_s_) * parts_[i].motion->velocity_world_m_s)
             : middle;
}

// By part of this frame, the one of the last that it clearly is.
std::vector<std::optional<std::size_t>> PartTracker::match(
    double time_s, const std::vector<HullPart>& parts) const {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double reach_m = options_.fastest_m_s * (time_s - time_s_);
  const auto apart_m = [&](std::size_t before, std::size_t now) {
    const double m = distance_m(expected_m(before, time_s), parts[now].middle_world_m);
    return distance_m(parts_[before].part.middle_world_m, parts[now].middle_world_m) <= reach_m
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
    bool clear = ratio <= kSameVolume && ratio * kSameVolume >= 1;
    for (std::size_t other = 0; other < parts_.size(); ++other)
      clear &= other == best || kClearly * m <= apart_m(other, now);
    for (std::size_t other = 0; other < parts.size(); ++other)
      clear &= other == now || kClearly * m <= apart_m(best, other);
    if (clear) matches[now] = best;
  }
  return matches;
}

const std::vector<FollowedPart>& PartTracker::add(double time_s,
                                                  const std::vector<HullPart>& parts) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("time of followed parts is not finite");
  if (!(time_s > time_s_ && time_s - time_s_ <= options_.longest_gap_s)) reset();
  const auto matches = match(time_s, parts);
  std::vector<std::optional<std::size_t>> went_on(parts_.size());  // as which one of this frame
  for (std::size_t now = 0; now < parts.size(); ++now)
    if (matches[now]) went_on[*matches[now]] = now;
  // Who of the frame before may have become part of this one, and the other way round, beside the
  // matches.
  const auto met = [&](std::size_t before, std::size_t now) {
    const Vector3d moved = expected_m(before, time_s) - parts_[before].part.middle_world_m;
    return boxes_meet(parts_[before].part.box_world_m, moved, parts[now].box_world_m,
                      0.5 * moved.norm());
  };
  // Boxes meet that have nothing to do with each other: of a part that clearly went on, the volume
  // must tell, too.
  const auto joins = [&](std::size_t before, std::size_t now) {
    if (went_on[before] || !met(before, now)) return false;
    if (!matches[now]) return true;
    const double was_m3 = parts_[*matches[now]].part.volume_m3;
    return accounts_for(parts_[before].part.volume_m3, parts[now].volume_m3 - was_m3, was_m3);
  };
  const auto leaves = [&](std::size_t before, std::size_t now) {
    if (matches[now] || !met(before, now)) return false;
    const double was_m3 = parts_[before].part.volume_m3;
    return !went_on[before] ||
           accounts_for(parts[now].volume_m3, was_m3 - parts[*went_on[before]].volume_m3, was_m3);
  };
  std::vector<FollowedPart> followed;
  std::vector<Track> tracks;
  for (std::size_t now = 0; now < parts.size(); ++now) {
    FollowedPart f{0, PartOrigin::appeared, {}, parts[now], std::nullopt};
    Track track;
    std::vector<std::size_t> joined, came_apart;
    for (std::size_t before = 0; before < parts_.size(); ++before)
      if (matches[now] == before || joins(before, now)) joined.push_back(before);
    for (std::size_t other = 0; other < parts.size() && joined.size() == 1; ++other)
      if (other != now && leaves(joined[0], other)) came_apart.push_back(other);
    for (std::size_t before = 0; before < parts_.size() && joined.empty(); ++before)
      if (leaves(before, now)) joined.push_back(before), came_apart.push_back(now);
    for (const std::size_t before : joined) f.from.push_back(parts_[before].id);
    if (joined.size() > 1)
      f.origin = PartOrigin::merged;
    else if (!came_apart.empty())
      f.origin = PartOrigin::split;
    else if (matches[now])
      f.origin = PartOrigin::followed, f.id = parts_[*matches[now]].id,
      track = tracks_[*matches[now]];
    else
      f.from.clear();
    if (f.id == 0) f.id = next_id_++;
    track.window.push_back({time_s, parts[now].middle_world_m, parts[now].outlines});
    if (int(track.window.size()) > options_.window_frames) track.window.pop_front();
    f.motion = motion_of(track, parts[now]);
    followed.push_back(std::move(f));
    tracks.push_back(std::move(track));
  }
  parts_ = std::move(followed);
  tracks_ = std::move(tracks);
  time_s_ = time_s;
  return parts_;
}

std::optional<PartMotion> PartTracker::motion_of(Track& track, const HullPart& part) const {
  if (int(track.window.size()) < kLeastFrames) return std::nullopt;
  PartMotion motion;
  motion.frames = int(track.window.size());
  motion.window_s = track.window.back().time_s - track.window.front().time_s;
  motion.velocity_world_m_s = slope_m_s(track.window);
  const double size_m = std::sqrt(part.covariance_world_m2.trace());
  const auto fit = outline_motion(
      track.window, track.guess.value_or(EvenMotion{motion.velocity_world_m_s, Vector3d::Zero()}),
      size_m);
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
