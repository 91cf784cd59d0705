#include "common/collision/part_tracker.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace fivepipe {
namespace {

using Eigen::Vector3d;

// Two variances that differ by less than this part of their sum don't tell which way a part lies about the third axis. Of a hand's hull, which
// is thicker than the hand where no camera looks in, they say little about its roll: with 0.2 the rotation is off by 16 % instead of 5.
constexpr double kRound = 0.6;
// A part that is another one may be larger or smaller by this factor, not more: what it is seen of changes.
constexpr double kSameVolume = 2;
constexpr int kLeastSamples = 3;

double distance_m(const Vector3d& a, const Vector3d& b) { return (a - b).norm(); }

bool boxes_meet(const Eigen::AlignedBox3d& a, const Vector3d& moved_m, const Eigen::AlignedBox3d& b, double slack_m) {
  Eigen::AlignedBox3d moved = a;
  moved.translate(moved_m);
  const Vector3d slack = Vector3d::Constant(slack_m);
  return Eigen::AlignedBox3d(moved.min() - slack, moved.max() + slack).intersects(b);
}

// Slopes over time of the line through the samples.
template <class Samples, class Value>
Vector3d slope_of(const Samples& samples, const Value& value) {
  double mean_s = 0, spread = 0;
  Vector3d mean = Vector3d::Zero(), slope = Vector3d::Zero();
  for (const auto& s : samples) mean_s += s.time_s / double(samples.size()), mean += value(s) / double(samples.size());
  for (const auto& s : samples) spread += (s.time_s - mean_s) * (s.time_s - mean_s), slope += (s.time_s - mean_s) * (value(s) - mean);
  return slope / spread;
}

}  // namespace

PartTracker::PartTracker(const PartTrackerOptions& options) : options_(options) {
  if (options.window_frames < kLeastSamples) throw std::invalid_argument("window of followed parts is shorter than three frames");
  if (!(options.fastest_m_s > 0)) throw std::invalid_argument("fastest speed of followed parts is not positive");
}

void PartTracker::reset() {
  parts_.clear();
  tracks_.clear();
}

Vector3d PartTracker::expected_m(std::size_t i, double time_s) const {
  const Vector3d& middle = parts_[i].part.middle_world_m;
  return parts_[i].motion ? Vector3d(middle + (time_s - time_s_) * parts_[i].motion->velocity_world_m_s) : middle;
}

// By part of this frame, the one of the last that it clearly is.
std::vector<std::optional<std::size_t>> PartTracker::match(double time_s, const std::vector<HullPart>& parts) const {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const double reach_m = options_.fastest_m_s * (time_s - time_s_);
  const auto apart_m = [&](std::size_t before, std::size_t now) {
    const double m = distance_m(expected_m(before, time_s), parts[now].middle_world_m);
    return distance_m(parts_[before].part.middle_world_m, parts[now].middle_world_m) <= reach_m ? m : kNone;
  };
  std::vector<std::optional<std::size_t>> matches(parts.size());
  for (std::size_t now = 0; now < parts.size(); ++now) {
    std::size_t best = parts_.size();
    for (std::size_t before = 0; before < parts_.size(); ++before)
      if (best == parts_.size() || apart_m(before, now) < apart_m(best, now)) best = before;
    if (best == parts_.size() || apart_m(best, now) == kNone) continue;
    const double m = apart_m(best, now), ratio = parts[now].volume_m3 / parts_[best].part.volume_m3;
    bool clear = ratio <= kSameVolume && ratio * kSameVolume >= 1;
    for (std::size_t other = 0; other < parts_.size(); ++other) clear &= other == best || kClearly * m <= apart_m(other, now);
    for (std::size_t other = 0; other < parts.size(); ++other) clear &= other == now || kClearly * m <= apart_m(best, other);
    if (clear) matches[now] = best;
  }
  return matches;
}

const std::vector<FollowedPart>& PartTracker::add(double time_s, const std::vector<HullPart>& parts) {
  if (!std::isfinite(time_s)) throw std::invalid_argument("time of followed parts is not finite");
  if (!(time_s > time_s_)) reset();
  const auto matches = match(time_s, parts);
  std::vector<bool> taken(parts_.size(), false);
  for (const auto& m : matches)
    if (m) taken[*m] = true;
  // Who of the frame before may have become part of this one, and the other way round, beside the matches.
  const auto met = [&](std::size_t before, std::size_t now) {
    const Vector3d moved = expected_m(before, time_s) - parts_[before].part.middle_world_m;
    return boxes_meet(parts_[before].part.box_world_m, moved, parts[now].box_world_m, 0.5 * moved.norm());
  };
  std::vector<FollowedPart> followed;
  std::vector<Track> tracks;
  for (std::size_t now = 0; now < parts.size(); ++now) {
    FollowedPart f{0, PartOrigin::appeared, {}, parts[now], std::nullopt};
    Track track;
    std::vector<std::size_t> joined, came_apart;
    for (std::size_t before = 0; before < parts_.size(); ++before)
      if (matches[now] == before || (!taken[before] && met(before, now))) joined.push_back(before);
    for (std::size_t other = 0; other < parts.size() && joined.size() == 1; ++other)
      if (other != now && !matches[other] && met(joined[0], other)) came_apart.push_back(other);
    for (std::size_t before = 0; before < parts_.size() && joined.empty(); ++before)
      if (met(before, now)) joined.push_back(before), came_apart.push_back(now);
    for (const std::size_t before : joined) f.from.push_back(parts_[before].id);
    if (joined.size() > 1) f.origin = PartOrigin::merged;
    else if (!came_apart.empty()) f.origin = PartOrigin::split;
    else if (matches[now]) f.origin = PartOrigin::followed, f.id = parts_[*matches[now]].id, track = tracks_[*matches[now]];
    else f.from.clear();
    if (f.id == 0) f.id = next_id_++;
    extend(track, time_s, parts[now]);
    f.motion = motion_of(track);
    followed.push_back(std::move(f));
    tracks.push_back(std::move(track));
  }
  parts_ = std::move(followed);
  tracks_ = std::move(tracks);
  time_s_ = time_s;
  return parts_;
}

void PartTracker::extend(Track& track, double time_s, const HullPart& part) const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(part.covariance_world_m2);
  Sample sample{time_s, part.middle_world_m, Vector3d::Zero(), principal.eigenvectors(), Eigen::Array3d::Zero()};
  const Vector3d& l = principal.eigenvalues();
  const auto differ = [&](int a, int b) { return std::abs(l[a] - l[b]) > kRound * (l[a] + l[b]); };
  for (int k = 0; k < 3; ++k) sample.defined[k] = differ(k, (k + 1) % 3) && differ(k, (k + 2) % 3);
  if (!track.samples.empty()) {
    const Sample& last = track.samples.back();
    Vector3d turn = Vector3d::Zero();
    const Eigen::Array3d defined = sample.defined * last.defined;
    for (int k = 0; k < 3; ++k) {
      if (sample.axes.col(k).dot(last.axes.col(k)) < 0) sample.axes.col(k) *= -1;
      const Vector3d across = last.axes.col(k).cross(sample.axes.col(k));
      const double sine = across.norm();
      if (sine > 0) turn += defined[k] * std::atan2(sine, last.axes.col(k).dot(sample.axes.col(k))) / sine * across;
    }
    // Each axis tells of the two turns across it: three of them tell everything twice.
    sample.turned_rad = last.turned_rad + (defined.sum() > 1 ? 0.5 : 1.0) * turn;
  }
  track.samples.push_back(sample);
  if (int(track.samples.size()) > options_.window_frames) track.samples.pop_front();
}

std::optional<PartMotion> PartTracker::motion_of(const Track& track) const {
  if (int(track.samples.size()) < kLeastSamples) return std::nullopt;
  PartMotion motion;
  motion.velocity_world_m_s = slope_of(track.samples, [](const Sample& s) { return s.middle_world_m; });
  motion.angular_velocity_world_rad_s = slope_of(track.samples, [](const Sample& s) { return s.turned_rad; });
  Eigen::Array3d defined = Eigen::Array3d::Ones();
  for (const Sample& s : track.samples) defined *= s.defined;
  motion.determined_axes = defined.sum() > 1 ? 3 : defined.sum() > 0 ? 2 : 0;
  motion.frames = int(track.samples.size());
  motion.window_s = track.samples.back().time_s - track.samples.front().time_s;
  return motion;
}

}  // namespace fivepipe
