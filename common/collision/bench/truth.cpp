#include "common/collision/bench/truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/hull/hull_query.h"
#include "common/hull/point_lanes.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

struct Asked {
  std::size_t object, triangle;
};

struct Ball {
  Vector3d center_world_m;
  double radius_m;
};

// About the middle of the longest edge or the centroid, whichever is smaller.
Ball ball_around(const Triangle& t) {
  Ball smallest{{}, std::numeric_limits<double>::infinity()};
  for (const Vector3d& c :
       {Vector3d((t[0] + t[1] + t[2]) / 3), Vector3d(0.5 * (t[0] + t[1])), Vector3d(0.5 * (t[1] + t[2])), Vector3d(0.5 * (t[2] + t[0]))}) {
    const double radius_m = std::max({(t[0] - c).norm(), (t[1] - c).norm(), (t[2] - c).norm()});
    if (radius_m < smallest.radius_m) smallest = {c, radius_m};
  }
  return smallest;
}

struct Hull {
  CpuHull cpu;
  HullQuery query{cpu};
  std::vector<PointLaneCamera> lanes{point_lane_cameras(cpu)};
  Hull(WorkerPool& pool, std::span<const Silhouette> silhouettes) : cpu(pool, silhouettes) {}
};

// One row of samples parallel to the longest edge.
void take_row(std::span<const Vector3d> row_world_m, bool with_depth, const Hull& hull, std::vector<InHull>& verdicts, TriangleTruth& truth) {
  verdicts.resize(row_world_m.size());
  contains_in_lanes(hull.lanes, row_world_m, verdicts.data());
  for (std::size_t i = 0; i < row_world_m.size(); ++i) {
    if (!(verdicts[i] == InHull::unsettled ? hull.query.contains(row_world_m[i]) : verdicts[i] == InHull::yes)) {
      truth.leaves = true;
      continue;
    }
    truth.crosses = true;
    // Neighbours' depths differ by less than their distance: one in sixteen is asked, and each until one is deep.
    if (truth.deepest_m == 0 || (with_depth && i % 4 == 0)) truth.deepest_m = std::max(truth.deepest_m, hull.query.solid_radius_m(row_world_m[i]));
  }
}

// Border included.
TriangleTruth sampled(const Triangle& triangle, const Hull& hull) {
  const TriangleView view = view_of(triangle);
  const Vector3d base_m = view.base1_world_m - view.base0_world_m, side_m = view.apex_world_m - view.base0_world_m;
  const double height_m = base_m.norm() > 0 ? base_m.cross(side_m).norm() / base_m.norm() : 0;
  const int rows = std::max(2, int(std::ceil(height_m / kTruthSpacing_m)));
  TriangleTruth truth{.leaves = false};
  std::vector<Vector3d> row_world_m;
  std::vector<InHull> verdicts;
  for (int r = 0; r <= rows; ++r) {
    const double y = double(r) / rows;
    const int columns = std::max(2, int(std::ceil((1 - y) * base_m.norm() / kTruthSpacing_m)));
    row_world_m.clear();
    for (int c = 0; c <= columns; ++c) row_world_m.push_back(view.base0_world_m + y * side_m + (1 - y) * c / columns * base_m);
    take_row(row_world_m, r % 4 == 0, hull, verdicts, truth);
  }
  return truth;
}

}  // namespace

Truth sampled_truth(const CollisionScene& scene, std::size_t most, WorkerPool& pool) {
  const Hull hull(pool, scene.silhouettes);
  Truth truth;
  std::vector<Asked> asked;
  for (std::size_t o = 0; o < scene.objects_world_m.size(); ++o) {
    truth.emplace_back(scene.objects_world_m[o].size());
    for (std::size_t i = 0; i < truth[o].size(); ++i) {
      const Ball ball = ball_around(scene.objects_world_m[o][i]);
      const double free_m = hull.query.free_radius_m(ball.center_world_m);
      truth[o][i].near = !(free_m >= ball.radius_m + kNear_m);
      if (!(free_m > ball.radius_m)) asked.push_back({o, i});
    }
  }
  std::mt19937 random(1);
  for (std::size_t i = 0; i < asked.size() && asked.size() > most; ++i) std::swap(asked[i], asked[i + random() % (asked.size() - i)]);
  for (std::size_t i = most; i < asked.size(); ++i) truth[asked[i].object][asked[i].triangle].known = false;
  asked.resize(std::min(most, asked.size()));
  pool.run(int(asked.size()), [&](int i, int) {
    TriangleTruth& t = truth[asked[i].object][asked[i].triangle];
    const bool near = t.near;
    t = sampled(scene.objects_world_m[asked[i].object][asked[i].triangle], hull);
    t.near = near;
  });
  return truth;
}

TruthCounts counts_of(const Truth& truth) {
  TruthCounts counts;
  for (const auto& object : truth)
    for (const TriangleTruth& t : object) {
      ++counts.triangles;
      counts.near += t.near;
      counts.known += t.known;
      counts.crossing += t.known && t.crosses;
      counts.crossing_border += t.known && t.crosses_border();
    }
  return counts;
}

Wrong wrong_of(const std::vector<ObjectCollision>& said, const Truth& truth, const CollisionScene& scene) {
  Wrong wrong;
  for (std::size_t o = 0; o < truth.size(); ++o) {
    std::vector<char> colliding(truth[o].size()), touching(truth[o].size()), proven(truth[o].size());
    for (const std::uint32_t i : said[o].triangles) colliding[i] = true;
    for (const std::uint32_t i : said[o].touching) touching[i] = true;
    for (const CollisionPoint& p : said[o].points)
      if (!proven[p.triangle]) proven[p.triangle] = in_hull(scene.silhouettes, p.p_world_m);
    for (std::size_t i = 0; i < truth[o].size(); ++i) {
      const TriangleTruth& t = truth[o][i];
      wrong.touching += touching[i] != 0;
      if (!t.known) continue;
      if (t.crosses && !colliding[i] && !touching[i]) {
        ++wrong.missed;
        wrong.missed_inside += !t.leaves;
        wrong.deepest_missed_m = std::max(wrong.deepest_missed_m, t.deepest_m);
        if (t.leaves) wrong.deepest_missed_border_m = std::max(wrong.deepest_missed_border_m, t.deepest_m);
      }
      wrong.invented += !t.crosses && colliding[i] && !proven[i];
    }
  }
  return wrong;
}

}  // namespace fivepipe::collision_bench
