#include "benchmarks/collision/truth.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "common/collision/oracle/triangle_reference.h"

namespace fivepipe::collision_bench {
namespace {

using Eigen::Vector3d;

struct Ball {
  Vector3d center_world_m;
  double radius_m;
};

// Returns a ball around the triangles: the center of their bounds, and the farthest vertex.
Ball ball_around(std::span<const collision::Triangle> triangles) {
  Eigen::AlignedBox3d bounds;
  for (const collision::Triangle& t : triangles)
    for (const Vector3d& vertex : t) bounds.extend(vertex);
  Ball ball{bounds.center(), 0};
  for (const collision::Triangle& t : triangles)
    for (const Vector3d& vertex : t)
      ball.radius_m = std::max(ball.radius_m, (vertex - ball.center_world_m).norm());
  return ball;
}

// Smaller depths may be rounding errors.
constexpr double kRounding_m = 1e-9;

// Consecutive triangles that share a ball, so that a mesh of a million triangles takes seconds.
constexpr std::size_t kGroup = 64;

TriangleTruth truth_of(const collision::HullDistance& hull, const collision::Triangle& triangle) {
  TriangleTruth truth;
  const Ball ball = ball_around({&triangle, 1});
  const double near_m = ball.radius_m + kNear_m,
               clear_m = hull.clear_m(ball.center_world_m, near_m);
  truth.near = clear_m < near_m;
  if (clear_m > ball.radius_m) return truth;
  const collision::TriangleTruth exact = collision::triangle_truth(hull, triangle);
  truth.leaves = !exact.inside;
  truth.deepest_m = exact.deepest_m;
  // The search for the deepest point ends within 10 um, so a part of the triangle that is less deep
  // has no point of the search in it.
  for (const std::vector<Vector3d>& polygon :
       collision::hull_on_triangle(hull.silhouettes(), triangle)) {
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& corner : polygon) sum += corner;
    truth.deepest_m = std::max(truth.deepest_m, hull.signed_m(sum / double(polygon.size())));
  }
  truth.crosses = truth.deepest_m > kRounding_m;
  return truth;
}

}  // namespace

Truth exact_truth(const CollisionScene& scene, base::WorkerPool& pool) {
  const collision::HullDistance hull(scene.silhouettes);
  Truth truth;
  for (const std::vector<collision::Triangle>& triangles : scene.objects_world_m) {
    std::vector<TriangleTruth>& of_object = truth.emplace_back(triangles.size());
    pool.run(int((triangles.size() + kGroup - 1) / kGroup), [&](int piece, int) {
      const std::size_t first = std::size_t(piece) * kGroup,
                        end = std::min(triangles.size(), first + kGroup);
      const Ball ball = ball_around({&triangles[first], end - first});
      const double near_m = ball.radius_m + kNear_m;
      if (hull.clear_m(ball.center_world_m, near_m) >= near_m) return;
      for (std::size_t i = first; i < end; ++i) of_object[i] = truth_of(hull, triangles[i]);
    });
  }
  return truth;
}

TruthCounts counts_of(const Truth& truth) {
  TruthCounts counts;
  for (const auto& object : truth)
    for (const TriangleTruth& t : object) {
      ++counts.triangles;
      counts.near += t.near;
      counts.crossing += t.crosses;
      counts.crossing_border += t.crosses_border();
    }
  return counts;
}

VerdictErrors wrong_of(const std::vector<collision::ObjectCollision>& found, const Truth& truth) {
  VerdictErrors wrong;
  for (std::size_t o = 0; o < truth.size(); ++o) {
    std::vector<char> colliding(truth[o].size()), undecided(truth[o].size());
    for (const std::uint32_t i : found[o].triangles) colliding[i] = true;
    for (const std::uint32_t i : found[o].undecided) undecided[i] = true;
    for (std::size_t i = 0; i < truth[o].size(); ++i) {
      const TriangleTruth& t = truth[o][i];
      wrong.undecided += undecided[i] != 0;
      wrong.invented += !t.crosses && colliding[i];
      if (!t.crosses || colliding[i] || undecided[i]) continue;
      ++wrong.missed;
      wrong.missed_inside += !t.leaves;
      wrong.deepest_missed_m = std::max(wrong.deepest_missed_m, t.deepest_m);
      if (t.leaves)
        wrong.deepest_missed_border_m = std::max(wrong.deepest_missed_border_m, t.deepest_m);
    }
  }
  return wrong;
}

}  // namespace fivepipe::collision_bench
