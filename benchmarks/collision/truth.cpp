#include "benchmarks/collision/truth.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "common/collision/oracle/triangle_reference.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

struct TriangleIndex {
  std::size_t object, triangle;
};

struct Ball {
  Vector3d center_world_m;
  double radius_m;
};

// Returns the smallest ball around the triangle among those centered on its centroid and its edges'
// midpoints.
Ball ball_around(const collision::Triangle& t) {
  Ball smallest{{}, std::numeric_limits<double>::infinity()};
  for (const Vector3d& c : {Vector3d((t[0] + t[1] + t[2]) / 3), Vector3d(0.5 * (t[0] + t[1])),
                            Vector3d(0.5 * (t[1] + t[2])), Vector3d(0.5 * (t[2] + t[0]))}) {
    const double radius_m = std::max({(t[0] - c).norm(), (t[1] - c).norm(), (t[2] - c).norm()});
    if (radius_m < smallest.radius_m) smallest = {c, radius_m};
  }
  return smallest;
}

// Smaller depths may be rounding errors.
constexpr double kRounding_m = 1e-9;

}  // namespace

Truth exact_truth(const CollisionScene& scene, std::size_t max_tests, base::WorkerPool& pool) {
  const collision::HullDistance distance(scene.silhouettes);
  Truth truth;
  std::vector<TriangleIndex> open;
  for (std::size_t o = 0; o < scene.objects_world_m.size(); ++o) {
    truth.emplace_back(scene.objects_world_m[o].size());
    for (std::size_t i = 0; i < truth[o].size(); ++i) {
      const Ball ball = ball_around(scene.objects_world_m[o][i]);
      const double near_m = ball.radius_m + kNear_m,
                   clear_m = distance.clear_m(ball.center_world_m, near_m);
      truth[o][i].near = clear_m < near_m;
      if (!(clear_m > ball.radius_m)) open.push_back({o, i});
    }
  }
  std::mt19937 random(1);
  for (std::size_t i = 0; i < open.size() && open.size() > max_tests; ++i)
    std::swap(open[i], open[i + random() % (open.size() - i)]);
  for (std::size_t i = max_tests; i < open.size(); ++i)
    truth[open[i].object][open[i].triangle].known = false;
  open.resize(std::min(max_tests, open.size()));
  pool.run(int(open.size()), [&](int i, int) {
    TriangleTruth& t = truth[open[i].object][open[i].triangle];
    const collision::TriangleTruth exact = collision::triangle_truth(
        distance, scene.objects_world_m[open[i].object][open[i].triangle]);
    t.crosses = exact.deepest_m > kRounding_m;
    t.leaves = !exact.inside;
    t.deepest_m = exact.deepest_m;
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

VerdictErrors wrong_of(const std::vector<collision::ObjectCollision>& found, const Truth& truth,
                       const CollisionScene& scene) {
  VerdictErrors wrong;
  for (std::size_t o = 0; o < truth.size(); ++o) {
    std::vector<char> colliding(truth[o].size()), undecided(truth[o].size()),
        proven(truth[o].size());
    for (const std::uint32_t i : found[o].triangles) colliding[i] = true;
    for (const std::uint32_t i : found[o].undecided) undecided[i] = true;
    for (const collision::CollisionPoint& p : found[o].points)
      if (!proven[p.triangle]) proven[p.triangle] = hull::in_hull(scene.silhouettes, p.p_world_m);
    for (std::size_t i = 0; i < truth[o].size(); ++i) {
      const TriangleTruth& t = truth[o][i];
      wrong.undecided += undecided[i] != 0;
      if (!t.known) continue;
      if (t.crosses && !colliding[i] && !undecided[i]) {
        ++wrong.missed;
        wrong.missed_inside += !t.leaves;
        wrong.deepest_missed_m = std::max(wrong.deepest_missed_m, t.deepest_m);
        if (t.leaves)
          wrong.deepest_missed_border_m = std::max(wrong.deepest_missed_border_m, t.deepest_m);
      }
      wrong.invented += !t.crosses && colliding[i] && !proven[i];
    }
  }
  return wrong;
}

}  // namespace fivepipe::collision_bench
