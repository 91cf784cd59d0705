// The baselines of the collision benchmark compute what they claim. Otherwise the benchmark would
// compare with wrong results.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <map>

#include "benchmarks/collision/baselines/brute_force.h"
#include "benchmarks/collision/baselines/hull_fcl.h"
#include "benchmarks/collision/baselines/hull_polygons.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/optional_package.h"

namespace fivepipe::baselines {
namespace {

using Eigen::Vector3d;

collision::ObjectCollision by_scalar_loop(const std::vector<collision::Triangle>& triangles,
                                          std::span<const hull::Silhouette> silhouettes,
                                          int across) {
  collision::ObjectCollision object;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const collision::TriangleView view = collision::view_of(triangles[i]);
    for (const TriangleSample& sample : triangle_samples(view, across)) {
      const Vector3d p_world_m = point_at(view, sample);
      if (!hull::in_hull(silhouettes, p_world_m)) continue;
      object.points.push_back({p_world_m, std::uint32_t(i)});
      if (object.triangles.empty() || object.triangles.back() != i)
        object.triangles.push_back(std::uint32_t(i));
    }
  }
  return object;
}

std::vector<collision::Triangle> random_triangles(test::Random& random, int count) {
  std::vector<collision::Triangle> triangles;
  for (int i = 0; i < count; ++i) {
    const Vector3d center = test::random_in_ball(random, 0.4);
    // Triangles of up to 5 m extend behind cameras.
    const double size_m = std::pow(10, test::uniform(random, -3, 0.7));
    triangles.push_back({center + test::random_in_ball(random, size_m),
                         center + test::random_in_ball(random, size_m),
                         center + test::random_in_ball(random, size_m)});
  }
  triangles[0][1] = triangles[0][0];                                   // degenerate
  triangles[1][2] = 0.5 * (triangles[1][0] + triangles[1][1]);         // collinear
  triangles[2] = {triangles[2][0], triangles[2][0], triangles[2][0]};  // a point
  return triangles;
}

TEST(BruteForce, EqualsAScalarLoopOverTheSameSamples) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    std::size_t points = 0;
    for (const int across : {1, 3, 10, 37}) {
      test::Random random(std::uint64_t(100 + across));
      const auto silhouettes =
          test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 5)});
      const std::vector<std::vector<collision::Triangle>> objects{
          random_triangles(random, 150), {}, random_triangles(random, 300)};
      BruteForce brute(across);
      brute.set_silhouettes(silhouettes);
      base::WorkerPool one(1), three(3);
      const auto found = brute.detect(objects, one), threaded = brute.detect(objects, three);
      for (std::size_t o = 0; o < objects.size(); ++o) {
        const collision::ObjectCollision expected = by_scalar_loop(objects[o], silhouettes, across);
        EXPECT_EQ(found[o].triangles, expected.triangles) << across;
        EXPECT_EQ(found[o].points, expected.points) << across;
        EXPECT_EQ(found[o].points, threaded[o].points);
        EXPECT_EQ(found[o].colliding(), !expected.points.empty());
        points += expected.points.size();
      }
    }
    EXPECT_GT(points, 1000u);
  }
  hwy::SetSupportedTargetsForTest(0);
}

// Random maps have a border at almost every pixel, and the triangles extend beyond the image and
// behind the camera, where rounding in float would fail.
TEST(BruteForce, IsExactAtPixelBordersAndBehindTheCamera) {
  test::Random random(42);
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : test::random_cameras(random, 1))
    silhouettes.push_back({camera, test::random_pixels(random, 160, 121, 0.5)});
  struct Case {
    int across, triangles;
    double size_m;
  };
  for (const Case& c : {Case{300, 60, 0.4}, {300, 30, 6}, {3, 20000, 0.003}}) {
    std::vector<std::vector<collision::Triangle>> objects(1);
    for (int i = 0; i < c.triangles; ++i) {
      const Vector3d center = test::random_in_ball(random, 0.6);
      const auto corner = [&] { return Vector3d(center + test::random_in_ball(random, c.size_m)); };
      objects[0].push_back({corner(), corner(), corner()});
    }
    const collision::ObjectCollision expected = by_scalar_loop(objects[0], silhouettes, c.across);
    ASSERT_GT(expected.points.size(), 10000u);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      base::WorkerPool pool(1);
      BruteForce brute(c.across);
      brute.set_silhouettes(silhouettes);
      EXPECT_TRUE(brute.detect(objects, pool)[0].points == expected.points)
          << hwy::TargetName(target) << " " << c.size_m;
    }
    hwy::SetSupportedTargetsForTest(0);
  }
}

TEST(BruteForce, SamplesLieInTheTriangleAndCoverHalfTheViewport) {
  test::Random random(7);
  for (const collision::Triangle& t : random_triangles(random, 200)) {
    const collision::TriangleView view = collision::view_of(t);
    const auto samples = triangle_samples(view, 60);
    for (const TriangleSample& s : samples)
      EXPECT_TRUE(s.base >= 0 && s.side > 0 && s.base + s.side <= 1 + 1e-6f);
    EXPECT_NEAR(double(samples.size()), 1800,
                60);  // tolerance: half of the two border pixels per row
  }
}

TEST(BruteForce, FindsNothingWithoutMapsOrObjectPixels) {
  test::Random random(3);
  auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 2), test::random_object(random, 5)});
  const std::vector<std::vector<collision::Triangle>> objects{random_triangles(random, 50)};
  base::WorkerPool pool(1);
  BruteForce brute(10);
  brute.set_silhouettes({});
  EXPECT_FALSE(brute.detect(objects, pool)[0].colliding());
  silhouettes[1].pixels =
      hull::ObjectPixels(silhouettes[1].pixels.width_px(), silhouettes[1].pixels.height_px());
  brute.set_silhouettes(silhouettes);
  EXPECT_FALSE(brute.detect(objects, pool)[0].colliding());
}

const Eigen::AlignedBox3d kVolume(Vector3d::Constant(-0.6), Vector3d::Constant(0.6));

struct Polygonised {
  std::vector<hull::Silhouette> silhouettes;
  geometry::Mesh mesh;
};
Polygonised random_polygons(std::uint64_t seed, double cell_m, int threads = 1) {
  test::Random random(seed);
  Polygonised p{
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 4, 0.15)}),
      {}};
  base::WorkerPool pool(threads);
  hull::CpuHull hull(pool, p.silhouettes);
  p.mesh = HullPolygons(cell_m).polygonise(hull::HullQuery(hull), kVolume);
  return p;
}

// Returns the winding number of the surface around p: above p, upward minus downward crossings.
int winding(const geometry::Mesh& mesh, const Vector3d& p_m) {
  int count = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d v[3] = {mesh.vertices_m[a] - p_m, mesh.vertices_m[b] - p_m,
                           mesh.vertices_m[c] - p_m};
    const auto cross = [&](int i, int j) { return v[i].x() * v[j].y() - v[i].y() * v[j].x(); };
    const double ab = cross(0, 1), bc = cross(1, 2), ca = cross(2, 0), area = ab + bc + ca;
    if (!((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0))) continue;
    if ((bc * v[0].z() + ca * v[1].z() + ab * v[2].z()) / area > 0) count += area > 0 ? 1 : -1;
  }
  return count;
}

TEST(HullPolygons, AreClosedAndOrientedOutward) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const geometry::Mesh mesh = random_polygons(seed, 0.011).mesh;
    ASSERT_GT(mesh.triangles.size(), 500u);
    // A closed mesh traverses each edge equally often in both directions.
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
    double volume_m3 = 0;
    for (const auto& t : mesh.triangles) {
      for (int i = 0; i < 3; ++i) ++directed[{t[i], t[(i + 1) % 3]}];
      volume_m3 +=
          mesh.vertices_m[t[0]].dot(mesh.vertices_m[t[1]].cross(mesh.vertices_m[t[2]])) / 6;
    }
    for (const auto& [edge, count] : directed)
      EXPECT_EQ(count, (directed[{edge.second, edge.first}]));
    EXPECT_GT(volume_m3, 0);
  }
}

TEST(HullPolygons, ClassifyPointsFartherThanACellFromTheBorder) {
  constexpr double kCell_m = 0.006;
  const double diagonal_m = std::sqrt(3.0) * kCell_m;
  for (const std::uint64_t seed : {11, 12, 13}) {
    const Polygonised p = random_polygons(seed, kCell_m);
    base::WorkerPool pool(1);
    hull::CpuHull hull(pool, p.silhouettes);
    const hull::HullQuery query(hull);
    HullPolygons polygons(kCell_m);
    polygons.polygonise(query, kVolume);
    test::Random random(seed);
    int inside = 0, outside = 0;
    for (int i = 0; i < 1000; ++i) {
      const Vector3d& vertex = p.mesh.vertices_m[random() % p.mesh.vertices_m.size()];
      const Vector3d q = vertex + test::random_in_ball(random, 5 * diagonal_m);
      const bool deep = query.solid_radius_m(q) > diagonal_m,
                 clear = query.free_radius_m(q) > diagonal_m;
      if (!deep && !clear) continue;
      (deep ? inside : outside)++;
      EXPECT_EQ(winding(p.mesh, q), deep ? 1 : 0) << q.transpose();
      EXPECT_EQ(polygons.contains(q), deep) << q.transpose();
    }
    EXPECT_GT(inside, 10);
    EXPECT_GT(outside, 100);
    for (const Vector3d& v : p.mesh.vertices_m)
      EXPECT_TRUE(query.solid_radius_m(v) <= diagonal_m && query.free_radius_m(v) <= diagonal_m);
  }
}

// The interpolation along an edge of the grid is linear, so its border is the edge's midpoint.
TEST(HullPolygons, ContainTheHalfOfACrossedEdgeAtItsPointInTheHull) {
  constexpr double kCell_m = 0.006;
  test::Random random(21);
  // Thick enough for whole bricks in the hull.
  const auto silhouettes = test::silhouettes_of(
      {{Vector3d(-0.1, 0, 0), Vector3d(0.1, 0.1, 0), 0.25}}, test::random_cameras(random, 3));
  base::WorkerPool pool(1);
  hull::CpuHull hull(pool, silhouettes);
  const hull::HullQuery query(hull);
  HullPolygons polygons(kCell_m);
  const geometry::Mesh& mesh = polygons.polygonise(query, kVolume);
  int inside = 0, crossed = 0;
  for (int i = 0; i < 2000; ++i) {
    // A grid point within 24 cells of the surface. The grid has a point at the volume's corner.
    const Vector3d& vertex = mesh.vertices_m[random() % mesh.vertices_m.size()];
    const Vector3d near = vertex + test::random_in_ball(random, 24 * kCell_m);
    const Vector3d cells = ((near - kVolume.min()) / kCell_m).array().round();
    const Vector3d a = kVolume.min() + kCell_m * cells,
                   b = a + kCell_m * Vector3d::Unit(Eigen::Index(random() % 3));
    const bool a_in = query.contains(a), b_in = query.contains(b);
    inside += a_in && b_in;
    crossed += a_in != b_in;
    EXPECT_EQ(polygons.contains(a + 0.45 * (b - a)), a_in) << a.transpose();
    EXPECT_EQ(polygons.contains(a + 0.55 * (b - a)), b_in) << a.transpose();
  }
  EXPECT_GT(crossed, 20);
  EXPECT_GT(inside, 200);
}

TEST(HullPolygons, AreIndependentOfThreadsAndEmptyWithoutAHull) {
  const geometry::Mesh one = random_polygons(5, 0.01).mesh,
                       three = random_polygons(5, 0.01, 3).mesh;
  EXPECT_EQ(one.triangles, three.triangles);
  EXPECT_EQ(one.vertices_m, three.vertices_m);
  base::WorkerPool pool(1);
  hull::CpuHull empty(pool, {});
  HullPolygons polygons(0.01);
  EXPECT_TRUE(polygons.polygonise(hull::HullQuery(empty), kVolume).triangles.empty());
  EXPECT_FALSE(polygons.contains(Vector3d::Zero()));
}

// The surface of a hull that extends beyond the volume is cut off there, and still closed.
TEST(HullPolygons, AreClippedToTheVolume) {
  test::Random random(8);
  const auto silhouettes = test::silhouettes_of(
      {{Vector3d(-0.5, 0, 0), Vector3d(0.5, 0.1, 0), 0.06}}, test::random_cameras(random, 3));
  base::WorkerPool pool(1);
  hull::CpuHull hull(pool, silhouettes);
  const hull::HullQuery query(hull);
  const Eigen::AlignedBox3d volume(Vector3d(0, -0.5, -0.5), Vector3d(0.2, 0.5, 0.5));
  HullPolygons polygons(0.01);
  EXPECT_FALSE(polygons.contains({0.1, 0.06, 0.001}));  // nothing is polygonised yet
  const geometry::Mesh mesh = polygons.polygonise(query, volume);
  ASSERT_FALSE(mesh.triangles.empty());
  // The surface extends at most 1.5 grid points beyond the volume.
  EXPECT_GT(geometry::bounds_m(mesh).min().x(), -0.015);
  EXPECT_LT(geometry::bounds_m(mesh).max().x(), 0.215);
  for (const double x_m : {0.01, 0.1, 0.19}) {
    EXPECT_EQ(winding(mesh, {x_m, 0.05 + 0.1 * x_m, 0.001}), 1) << x_m;
    EXPECT_TRUE(polygons.contains({x_m, 0.05 + 0.1 * x_m, 0.001})) << x_m;
  }
  for (const double x_m : {-0.03, 0.23, -100.0, 100.0, std::nan("")}) {
    EXPECT_FALSE(polygons.contains({x_m, 0.05 + 0.1 * x_m, 0.001})) << x_m;
    EXPECT_EQ(winding(mesh, {x_m, 0.05 + 0.1 * x_m, 0.001}), 0) << x_m;
  }
}

#ifdef FIVEPIPE_FCL
bool nowhere(const Vector3d&) { return false; }
bool in_box(const Vector3d& p_m) { return p_m.cwiseAbs().maxCoeff() < 0.1; }

TEST(HullFcl, FindsCrossingTrianglesAndTheirPoints) {
  HullFcl fcl;
  fcl.set_hull(geometry::box_mesh({0.2, 0.2, 0.2}));
  // A plane sheet of 10 cm cells through the box. The cells' borders are at 0.05 + 0.1 k, so the
  // cell from -0.05 to 0.05 is wholly inside.
  geometry::Mesh sheet = geometry::curtain_mesh(0.6, 0.6, 6, 6, 0, 0);
  for (Vector3d& v : sheet.vertices_m) v += Vector3d(0.05, 0.01, 0.35);
  const std::size_t object = fcl.add(sheet);
  const collision::ObjectCollision found = fcl.query(object, nowhere);
  ASSERT_TRUE(found.colliding());
  const auto triangles = collision::world_triangles(sheet, Eigen::Isometry3d::Identity());
  std::vector<std::uint32_t> crossing, colliding;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    Eigen::AlignedBox2d box;
    for (const Vector3d& v : triangles[i]) box.extend(Eigen::Vector2d(v.x(), v.z()));
    // Samples of the triangle, because only a corner of some cells is in the square from -0.1 to
    // 0.1.
    bool in = false, out = false;
    for (int a = 0; a <= 50; ++a)
      for (int b = 0; a + b <= 50; ++b) {
        const Vector3d p = triangles[i][0] + a / 50.0 * (triangles[i][1] - triangles[i][0]) +
                           b / 50.0 * (triangles[i][2] - triangles[i][0]);
        (p.cwiseAbs().maxCoeff() < 0.1 ? in : out) = true;
      }
    if (in && out) crossing.push_back(i);
    if (in) colliding.push_back(i);
  }
  EXPECT_EQ(found.triangles, crossing);
  EXPECT_EQ(fcl.query(object, in_box).triangles, colliding);
  EXPECT_GT(colliding.size(), crossing.size());
  EXPECT_LT(crossing.size(), 30u);
  EXPECT_GT(crossing.size(), 10u);
  for (const collision::CollisionPoint& p : found.points) {
    EXPECT_NEAR(p.p_world_m.cwiseAbs().maxCoeff(), 0.1, 1e-9);
    EXPECT_NEAR(p.p_world_m.y(), 0.01, 1e-9);
    const collision::Triangle& t = triangles[p.triangle];
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    for (int i = 0; i < 3; ++i)
      EXPECT_GE((t[(i + 1) % 3] - t[i]).cross(p.p_world_m - t[i]).dot(normal), -1e-12);
  }
}

// A surface has no inside, so the point-in-volume test finds the triangles that cross no surface.
TEST(HullFcl, RefitsADeformedMeshAndFindsEnclosedTriangles) {
  HullFcl fcl;
  fcl.set_hull(geometry::box_mesh({0.2, 0.2, 0.2}));
  geometry::Mesh sheet = geometry::curtain_mesh(0.05, 0.05, 2, 2, 0, 0);
  const std::size_t object = fcl.add(sheet), triangles = sheet.triangles.size();
  EXPECT_FALSE(fcl.query(object, nowhere).colliding());
  const collision::ObjectCollision enclosed = fcl.query(object, in_box);
  ASSERT_EQ(enclosed.triangles.size(), triangles);
  for (std::uint32_t i = 0; i < triangles; ++i) {
    EXPECT_EQ(enclosed.triangles[i], i);
    EXPECT_EQ(enclosed.points[i].triangle, i);
    EXPECT_TRUE(in_box(enclosed.points[i].p_world_m));
  }
  for (Vector3d& v : sheet.vertices_m) v *= 10;
  fcl.refit(object, sheet.vertices_m);
  EXPECT_TRUE(fcl.query(object, nowhere).colliding());
  for (Vector3d& v : sheet.vertices_m) v.x() += 3;
  fcl.refit(object, sheet.vertices_m);
  EXPECT_FALSE(fcl.query(object, in_box).colliding());
  fcl.set_hull({});
  EXPECT_FALSE(fcl.query(object, nowhere).colliding());
}
#else
TEST(HullFcl, IsInThisBuild) {
  FIVEPIPE_SKIP_WITHOUT_PACKAGE(
      "built without the Flexible Collision Library (Debian: libfcl-dev)");
}
#endif

}  // namespace
}  // namespace fivepipe::baselines
