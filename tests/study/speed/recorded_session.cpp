#include "tests/study/speed/recorded_session.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "common/collision/detection/cpu/cpu_detector.h"
#include "common/collision/detection/triangle.h"
#include "common/collision/oracle/distance_reference.h"
#include "tests/support/capture/actor_silhouettes.h"
#include "tests/support/hull/test_pool.h"
#include "tests/support/recording/map_recording.h"

namespace fivepipe::test {
namespace {

constexpr double kRate_hz = 30;
constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
// Of the reference: of the distance to one cone, and how many distances to the hull it computes.
constexpr double kReferenceTolerance_m = 0.5e-3;
constexpr std::size_t kMaxPoints = 60;

bool have_same_maps(const std::vector<hull::Silhouette>& a,
                    const std::vector<hull::Silhouette>& b) {
  return std::ranges::equal(a, b, {}, &hull::Silhouette::pixels, &hull::Silhouette::pixels);
}

std::size_t count_of(const std::vector<hull::Silhouette>& silhouettes) {
  std::size_t count = 0;
  for (const hull::Silhouette& s : silhouettes) count = 1'000'003 * count + s.pixels.count();
  return count;
}

// A part of a triangle, and what is known of the distances of its points.
struct Piece {
  collision::Triangle triangle;
  double min_m;
  bool operator<(const Piece& other) const { return min_m > other.min_m; }
};

}  // namespace

void record_session(const Session& session, const std::filesystem::path& file, int frames,
                    double start_s) {
  // The person repeats the task exactly.
  const int period = int(std::lround(session.world.period_s * kRate_hz)),
            computed = std::min(frames, period);
  std::vector<std::vector<hull::Silhouette>> maps{std::size_t(computed)};
  test_pool().run(computed, [&](int i, int) {
    maps[std::size_t(i)] =
        silhouettes_of(session.parts_at(start_s + double(i) / kRate_hz), session.cameras);
  });
  MapRecording recording(file, session.deployment);
  for (int i = 0; i < frames; ++i)
    recording.add(std::uint64_t(i), kStart_ns + std::llround(1e9 * double(i) / kRate_hz),
                  maps[std::size_t(i % period)]);
}

RecordedMaps maps_of(const std::filesystem::path& file, const config::Deployment& deployment) {
  const recording::Recording recording(file);
  replay::RecordedFrames frames(recording, deployment);
  RecordedMaps found;
  std::multimap<std::size_t, std::size_t> by_count;
  while (auto frame = frames.next()) {
    const std::size_t count = count_of(frame->set.silhouettes);
    const auto [first, last] = by_count.equal_range(count);
    const auto same = std::find_if(first, last, [&](const auto& entry) {
      return have_same_maps(found.different[entry.second], frame->set.silhouettes);
    });
    found.frames.push_back(
        {same != last ? same->second : found.different.size(), frame->duration_s});
    if (same != last) continue;
    by_count.emplace(count, found.different.size());
    found.different.push_back(std::move(frame->set.silhouettes));
  }
  return found;
}

SingleReplays single_replays(const RecordedMaps& recorded, const collision::MovablePart& part,
                             std::span<const double> spacings_m, const hull::HullRule& rule,
                             double eps_m) {
  SingleReplays found;
  found.verdicts.resize(recorded.different.size());
  test_pool().run(int(recorded.different.size()), [&](int index, int) {
    const std::vector<hull::Silhouette>& silhouettes = recorded.different[std::size_t(index)];
    base::WorkerPool one(1);
    hull::CpuHull hull(one);
    hull.assign(silhouettes, rule);
    const hull::HullQuery query(hull);
    const auto detector = collision::cpu_detector({.eps_m = eps_m, .spacing_m = 0});
    detector->set_hull(query, silhouettes);
    for (const double spacing_m : spacings_m) {
      const collision::DetectionObject object{&part.tree(), part.pose(spacing_m)};
      found.verdicts[std::size_t(index)].push_back(detector->detect({&object, 1})[0].verdict);
    }
  });
  found.layouts.resize(spacings_m.size());
  for (const RecordedMaps::Frame& frame : recorded.frames)
    for (std::size_t i = 0; i < spacings_m.size(); ++i) {
      const collision::CollisionVerdict verdict = found.verdicts[frame.maps][i];
      SingleReplays::Layout& layout = found.layouts[i];
      layout.undecided_frames += verdict == collision::CollisionVerdict::undecided;
      if (verdict != collision::CollisionVerdict::colliding) continue;
      ++layout.colliding_frames;
      layout.collision_s += frame.duration_s;
    }
  return found;
}

study::Bracket reference_clearance_m(std::span<const hull::Silhouette> silhouettes,
                                     const collision::MovablePart& part, double spacing_m,
                                     double cap_m) {
  const collision::HullDistance reference(silhouettes);
  study::Bracket bracket{cap_m, cap_m};
  // Lower bound: the distance to one cone, by branch and bound.
  std::priority_queue<Piece> pieces;
  std::vector<std::pair<double, Eigen::Vector3d>> nearest_m;
  double best_m = cap_m;
  const auto push = [&](const collision::Triangle& t) {
    const Eigen::Vector3d middle_m = (t[0] + t[1] + t[2]) / 3;
    double radius_m = 0;
    for (const Eigen::Vector3d& corner_m : t)
      radius_m = std::max(radius_m, (corner_m - middle_m).norm());
    const double clear_m = reference.clear_m(middle_m, cap_m);
    if (clear_m - radius_m >= best_m) return;
    best_m = std::min(best_m, clear_m);
    nearest_m.emplace_back(clear_m, middle_m);
    pieces.push({t, std::max(0.0, clear_m - radius_m)});
  };
  for (const collision::Triangle& t :
       collision::world_triangles(part.tree().mesh(), part.pose(spacing_m)))
    push(t);
  while (!pieces.empty()) {
    const auto [t, min_m] = pieces.top();
    pieces.pop();
    if (min_m >= best_m - kReferenceTolerance_m) {
      bracket.min_m = std::min(min_m, best_m);
      break;
    }
    const auto& [a, b, c] = t;
    const Eigen::Vector3d ab = (a + b) / 2, bc = (b + c) / 2, ca = (c + a) / 2;
    for (const collision::Triangle& quarter :
         {collision::Triangle{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}})
      push(quarter);
  }
  // Upper bound: the distances of points, the nearest to a cone first.
  std::ranges::sort(nearest_m, {}, &std::pair<double, Eigen::Vector3d>::first);
  const std::size_t step = std::max<std::size_t>(1, nearest_m.size() / kMaxPoints);
  for (std::size_t i = 0; i < nearest_m.size() && nearest_m[i].first < bracket.max_m; i += step)
    bracket.max_m = std::min(
        bracket.max_m, reference.clearance_m(nearest_m[i].second, bracket.max_m, 0.5e-3).max_m);
  return bracket;
}

}  // namespace fivepipe::test
