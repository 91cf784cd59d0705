// Proximity of triangles and meshes.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/collision/proximity/proximity_queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

TEST(ProximityOfTriangles, EqualsTheDistanceOfTheNearestPoint) {
  const Queries q(hand());
  Random random(9);
  const collision::ProximityOptions options{0.05, 0.001};
  int near = 0, crossing = 0;
  for (int i = 0; i < 150; ++i) {
    const collision::Triangle t =
        random_triangle(random, 0.15, std::pow(10.0, uniform(random, -3, -0.7)));
    const collision::Proximity found = of_triangles(q.query, options, std::vector{t})[0];
    constexpr int kSamples = 16;
    std::vector<Vector3d> samples;
    for (int a = 0; a <= kSamples; ++a)
      for (int b = 0; a + b <= kSamples; ++b)
        samples.push_back(t[0] + double(a) / kSamples * (t[1] - t[0]) +
                          double(b) / kSamples * (t[2] - t[0]));
    double min_m = kInfinity, max_m = kInfinity;
    for (const collision::Proximity& p : of_points(q.query, options, samples))
      min_m = std::min(min_m, p.min_m), max_m = std::min(max_m, p.max_m);
    const double longest_m =
        std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
    ASSERT_LE(found.min_m, max_m + kRounding_m);
    ASSERT_GE(found.max_m, min_m - longest_m / kSamples - kRounding_m);
    ASSERT_TRUE(is_tight(found, options));
    near += found.min_m > 0 && found.min_m < options.cap_m;
    crossing += found == collision::Proximity{0, 0};
    collision::Triangle permuted = t;
    std::sort(permuted.begin(), permuted.end(),
              [](const Vector3d& a, const Vector3d& b) { return a.x() < b.x(); });
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(of_triangles(q.query, options, std::vector{permuted})[0], found);
      ASSERT_EQ(
          of_triangles(q.query, options,
                       std::vector{collision::Triangle{permuted[1], permuted[0], permuted[2]}})[0],
          found);
      std::rotate(permuted.begin(), permuted.begin() + 1, permuted.end());
    }
  }
  EXPECT_GT(near, 40);
  EXPECT_GT(crossing, 5);
}

TEST(ProximityOfTriangles, DegenerateTrianglesEqualPointsAndSegments) {
  const Queries q(hand());
  Random random(10);
  const collision::ProximityOptions options{0.05, 0.001};
  for (int i = 0; i < 60; ++i) {
    const Vector3d a = random_in_ball(random, 0.15), b = random_in_ball(random, 0.15);
    const auto point = of_points(q.query, options, std::vector{a})[0],
               dot = of_triangles(q.query, options, std::vector{collision::Triangle{a, a, a}})[0];
    EXPECT_LE(point.min_m, dot.max_m + kRounding_m);
    EXPECT_LE(dot.min_m, point.max_m + kRounding_m);
    EXPECT_TRUE(is_tight(dot, options));
    const Vector3d sliver = a + 0.3 * (b - a) + 1e-9 * random_direction(random);
    const auto line = of_triangles(
        q.query, options,
        std::vector<collision::Triangle>{{a, b, a + 0.3 * (b - a)}, {a, b, b}, {a, b, sliver}});
    for (const collision::Proximity& p : line) {
      for (const collision::Proximity& other : line) EXPECT_LE(p.min_m, other.max_m + 2e-9);
      EXPECT_TRUE(is_tight(p, options));
    }
  }
}

TEST(ProximityOfTriangles, TriangleMayBeMuchLargerThanTheHull) {
  const std::vector<hull::Silhouette> silhouettes = hand();
  const Queries q(silhouettes);
  const double top_m = 0.2;
  const collision::Triangle wide = {Vector3d(-10, -10, top_m), {10, -10, top_m}, {0, 10, top_m}},
                            through = {Vector3d(-10, -10, 0.01), {10, -10, 0.01}, {0, 10, 0.01}};
  const auto found = of_triangles(q.query, {0.3, 0.001}, std::vector{wide, through});
  double sampled_m = kInfinity;  // distance of the hull's points to the plane
  Random random(11);
  for (int i = 0; i < 20'000; ++i)
    if (const Vector3d p = random_in_ball(random, 0.13); hull::in_hull(silhouettes, p))
      sampled_m = std::min(sampled_m, top_m - p.z());
  EXPECT_LE(found[0].min_m, sampled_m);
  EXPECT_LE(found[0].max_m, sampled_m + 0.001);
  EXPECT_GT(found[0].min_m, sampled_m - 0.01);
  EXPECT_EQ(found[1], (collision::Proximity{0, 0}));
  EXPECT_EQ(of_triangles(q.query, {0.05, 0.001}, std::vector{wide})[0],
            (collision::Proximity{0.05, kInfinity}));
}

// Neither the vertices nor a part of the edges bound the distance of a long triangle from below.
TEST(ProximityOfMeshes, BoundsTheDistanceOfLongTriangles) {
  const Queries q(hand());
  const collision::ProximityOptions options{0.3, 0.002};
  Random random(13);
  geometry::Mesh mesh;
  std::vector<collision::Triangle> triangles;
  for (std::uint32_t i = 0; i < 150; ++i) {
    const Vector3d center = random_in_ball(random, 0.2), along = random_vector(random, 0.1, 0.2);
    triangles.push_back(
        {center - along, center - along + random_in_ball(random, 0.01), center + along});
    std::rotate(triangles.back().begin(), triangles.back().begin() + i % 3, triangles.back().end());
    for (const Vector3d& v : triangles.back()) mesh.vertices_m.push_back(v);
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const auto found =
      collision::HullProximity(q.query, options).of_mesh(mesh, Eigen::Isometry3d::Identity());
  const auto alone = of_triangles(q.query, options, triangles);
  int nearer = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    EXPECT_LE(found.triangles[i].min_m, alone[i].max_m + kRounding_m) << i;
    EXPECT_LE(alone[i].min_m, found.triangles[i].max_m + kRounding_m) << i;
    EXPECT_TRUE(is_tight(found.triangles[i], options));
    double to_vertex_m = kInfinity;
    for (std::size_t k = 0; k < 3; ++k)
      to_vertex_m = std::min(to_vertex_m, found.vertices[3 * i + k].min_m);
    nearer += alone[i].max_m + options.tolerance_m < to_vertex_m;
  }
  EXPECT_GT(nearer, 50);  // between its vertices than at each of them
}

// The lattice has exact coordinates up to 1e9 caps. Beyond, a point is in the hull, certainly free,
// or unknown, and a triangle is unknown.
TEST(ProximityOfTriangles, AVertexBeyondABillionCapsHasUnknownDistance) {
  const Queries q(hand());
  const collision::ProximityOptions options{1e-8, 1e-9};  // 1e9 caps are 10 m
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Vector3d near = side * 9.9 * Vector3d::Unit(axis), far = 1.02 * near;
      const auto found =
          of_triangles(q.query, options,
                       std::vector<collision::Triangle>{{near, near, near}, {near, far, near}});
      EXPECT_EQ(found[0], (collision::Proximity{options.cap_m, kInfinity}));
      EXPECT_EQ(found[1], (collision::Proximity{0, kInfinity}));
      EXPECT_EQ(of_points(q.query, options, std::vector{far})[0],
                (collision::Proximity{options.cap_m, kInfinity}));
    }
}

TEST(ProximityOfMeshes, EqualsPerVertexAndPerTriangleQueries) {
  const Queries q(hand());
  const collision::ProximityOptions options{0.05, 0.001};
  const geometry::Mesh mesh = geometry::sphere_mesh(0.07, 3);
  Eigen::Isometry3d world_from_object = Eigen::Isometry3d::Identity();
  world_from_object.translate(Vector3d(0.06, 0.02, 0.04))
      .rotate(Eigen::AngleAxisd(0.7, Vector3d(3, 2, 1).normalized()));
  collision::HullProximity proximity(q.query, options);
  const collision::MeshProximity found = proximity.of_mesh(mesh, world_from_object);
  std::vector<Vector3d> vertices;
  for (const Vector3d& v : mesh.vertices_m) vertices.push_back(world_from_object * v);
  EXPECT_EQ(found.vertices, of_points(q.query, options, vertices));
  const auto triangles =
      of_triangles(q.query, options, collision::world_triangles(mesh, world_from_object));
  ASSERT_EQ(found.triangles.size(), triangles.size());
  int near = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    EXPECT_LE(found.triangles[i].min_m, triangles[i].max_m);
    EXPECT_LE(triangles[i].min_m, found.triangles[i].max_m);
    for (const std::uint32_t v : mesh.triangles[i])
      EXPECT_LE(found.triangles[i].min_m, found.vertices[v].max_m);
    EXPECT_TRUE(is_tight(found.triangles[i], options));
    near += found.triangles[i].min_m > 0;
  }
  EXPECT_GT(near, 200);
  const collision::MeshProximity empty = proximity.of_mesh({}, world_from_object);
  EXPECT_TRUE(empty.vertices.empty() && empty.triangles.empty());
}

}  // namespace
}  // namespace fivepipe::test
