// Backend `cpu` of the collision detection, and the hard cases of triangles and meshes.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "common/collision/detection/contact_points.h"
#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/oracle/triangle_reference.h"
#include "tests/support/collision_triangles.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr collision::DetectionOptions kVerdictAlone{.eps_m = 0.5e-3, .spacing_m = 0};

// A hull, and what is asked of it.
struct Hull {
  std::vector<hull::Silhouette> silhouettes;
  base::WorkerPool pool;
  hull::CpuHull hull;
  hull::HullQuery query;
  explicit Hull(std::vector<hull::Silhouette> s, int threads = 1)
      : silhouettes(std::move(s)), pool(threads), hull(pool, silhouettes), query(hull) {}

  collision::ObjectCollision ask(const collision::Bvh& tree,
                                 const collision::DetectionOptions& options = kVerdictAlone,
                                 const Isometry3d& pose = Isometry3d::Identity(),
                                 const Vector3d& rp = kOrigin) const {
    const collision::DetectionObject object{&tree, pose, rp};
    return collision::detect(query, {&object, 1}, options)[0];
  }
  collision::CollisionVerdict ask(
      const collision::Triangle& t,
      const collision::DetectionOptions& options = kVerdictAlone) const {
    return ask(collision::Bvh(mesh_of({t})), options).verdict;
  }
};

TEST(CpuDetection, AgreesWithDenseSamplingAndItsPointsAreInTheHull) {
  Random random(1);
  int colliding = 0, free = 0, undecided = 0;
  for (int scene = 0; scene < 12; ++scene) {
    const Hull hull(scene == 0 ? hand_like()
                               : silhouettes_of(random_object(random, 3),
                                                random_cameras(random, 1 + scene % 5)));
    const std::vector<collision::Triangle> triangles = random_triangles(random, 150);
    const collision::Bvh tree(mesh_of(triangles));
    const collision::ObjectCollision alone = hull.ask(tree),
                                     with_points = hull.ask(tree, {.eps_m = 1e-3,
                                                                   .spacing_m = 2e-3,
                                                                   .max_points = 1u << 20});
    for (const collision::ObjectCollision* found : {&alone, &with_points}) {
      for (const collision::CollisionPoint& p : found->points) {
        EXPECT_TRUE(hull::in_hull(hull.silhouettes, p.p_world_m));
        EXPECT_TRUE(test::holds(found->triangles, p.triangle));
      }
      for (std::size_t i = 0; i < triangles.size(); ++i)
        if (sampled(hull.silhouettes, triangles[i], 24)) {
          EXPECT_TRUE(test::holds(found->triangles, i)) << scene << ' ' << i;
        }
      for (const std::uint32_t t : found->triangles)
        EXPECT_TRUE(
            std::any_of(found->points.begin(), found->points.end(),
                        [&](const collision::CollisionPoint& p) { return p.triangle == t; }));
    }
    colliding += int(alone.triangles.size()), undecided += int(alone.undecided.size());
    free += int(triangles.size() - alone.triangles.size() - alone.undecided.size());
  }
  EXPECT_GT(colliding, 300);
  EXPECT_GT(free, 300);
  EXPECT_LT(undecided, 0.01 * colliding);
}

// What is free has no part in the hull that is more than rounding; what collides has one.
TEST(CpuDetection, AgreesWithTheExactReference) {
  Random random(11);
  int crossing = 0, undecided = 0;
  for (int scene = 0; scene < 5; ++scene) {
    const Hull hull(
        scene == 0 ? hand_like()
                   : silhouettes_of(random_object(random, 3), random_cameras(random, 2 + scene)));
    const collision::HullDistance distance(hull.silhouettes);
    const std::vector<collision::Triangle> triangles = random_triangles(random, 90);
    const collision::ObjectCollision found = hull.ask(collision::Bvh(mesh_of(triangles)));
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const collision::TriangleTruth truth = collision::triangle_truth(distance, triangles[i]);
      crossing += truth.crosses, undecided += test::holds(found.undecided, i);
      if (truth.deepest_m > 1e-9) {
        EXPECT_FALSE(!test::holds(found.triangles, i) && !test::holds(found.undecided, i))
            << scene << ' ' << i << ' ' << truth.deepest_m;
      }
      if (truth.deepest_m > kVerdictAlone.eps_m) {
        EXPECT_TRUE(test::holds(found.triangles, i));
      }
      if (!truth.crosses) {
        EXPECT_FALSE(test::holds(found.triangles, i)) << scene << ' ' << i;
      }
    }
  }
  EXPECT_GT(crossing, 100);
  EXPECT_LE(undecided, 0.01 * crossing);
}

// The part of a triangle that a thin wedge of one camera's pixels cuts out, however thin, is found:
// no depth is too small to be missed.
TEST(CpuDetection, FindsAPenetrationFarThinnerThanEps) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(3, 1.2, 0.6, 300, 0.5)));
  const auto entry = hull.query.first_entry({{0.3, 0.004, 0.002}, {-1, 0, 0}}, 0, 1);
  ASSERT_TRUE(entry);
  for (const double into_m : {1e-4, 1e-5, 1e-6, 1e-7}) {
    const double x = 0.3 - *entry - into_m;
    EXPECT_EQ(
        hull.ask(collision::Triangle{Vector3d(x, 0.004, 0.002), Vector3d(x + 0.02, 0.014, 0.002),
                                     Vector3d(x + 0.02, -0.006, 0.002)}),
        collision::CollisionVerdict::colliding)
        << into_m;
  }
}

TEST(CpuDetection, IsIndependentOfVertexOrder) {
  Random random(2);
  const Hull hull(hand_like());
  for (int i = 0; i < 60; ++i) {
    collision::Triangle t = random_triangle(random, 0.1, 0.05);
    std::array<int, 3> order = {0, 1, 2};
    const collision::DetectionOptions options{.spacing_m = 4e-3};
    const collision::ObjectCollision first = hull.ask(collision::Bvh(mesh_of({t})), options);
    while (std::next_permutation(order.begin(), order.end())) {
      const collision::ObjectCollision again = hull.ask(
          collision::Bvh(mesh_of(
              {{t[std::size_t(order[0])], t[std::size_t(order[1])], t[std::size_t(order[2])]}})),
          options);
      EXPECT_EQ(again.verdict, first.verdict);
      EXPECT_EQ(again.points, first.points);
    }
  }
}

TEST(CpuDetection, IsIndependentOfThreadsAndObjectOrder) {
  Random random(3);
  std::vector<collision::Bvh> trees;
  std::vector<collision::DetectionObject> objects;
  for (int i = 0; i < 7; ++i) trees.emplace_back(mesh_of(random_triangles(random, 90)));
  for (const collision::Bvh& tree : trees) objects.push_back({&tree});
  const Hull one(hand_like(), 1), three(hand_like(), 3);
  const collision::DetectionOptions options{.spacing_m = 3e-3};
  const auto first = collision::detect(one.query, objects, options),
             second = collision::detect(three.query, objects, options);
  std::reverse(objects.begin(), objects.end());
  const auto turned = collision::detect(three.query, objects, options);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    EXPECT_EQ(first[i].points, second[i].points);
    EXPECT_EQ(first[i].triangles, second[i].triangles);
    EXPECT_EQ(first[i].points, turned[objects.size() - 1 - i].points);
  }
}

TEST(CpuDetection, IsInvariantUnderRigidMotion) {
  Random random(4);
  const std::vector<hull::Silhouette> silhouettes = hand_like();
  const collision::Bvh tree(mesh_of(random_triangles(random, 400)));
  const collision::ObjectCollision at_rest = Hull(silhouettes).ask(tree);
  Isometry3d motion = Isometry3d::Identity();
  motion.linear() = Eigen::AngleAxisd(1.1, random_direction(random)).toRotationMatrix();
  motion.translation() = Vector3d(3, -2, 1);
  std::vector<hull::Silhouette> moved = silhouettes;
  for (hull::Silhouette& s : moved)
    s.camera.camera_from_world = s.camera.camera_from_world * motion.inverse();
  EXPECT_EQ(Hull(moved).ask(tree, kVerdictAlone, motion).triangles, at_rest.triangles);
}

TEST(CpuDetection, VerdictIsInvariantUnderSubdivision) {
  Random random(5);
  const Hull hull(hand_like());
  for (int i = 0; i < 200; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1, 0.08);
    const Vector3d a = 0.5 * (t[0] + t[1]), b = 0.5 * (t[0] + t[2]), c = 0.5 * (t[1] + t[2]);
    const collision::ObjectCollision parts =
        hull.ask(collision::Bvh(mesh_of({{t[0], a, b}, {a, t[1], c}, {b, c, t[2]}, {a, b, c}})));
    EXPECT_EQ(hull.ask(t) == collision::CollisionVerdict::colliding, parts.colliding());
  }
}

TEST(CpuDetection, MergedMeshGivesTheUnionOfResults) {
  Random random(6);
  const Hull hull(hand_like());
  const std::vector<collision::Triangle> first = random_triangles(random, 100),
                                         second = random_triangles(random, 57);
  std::vector<collision::Triangle> both = first;
  both.insert(both.end(), second.begin(), second.end());
  const auto a = hull.ask(collision::Bvh(mesh_of(first))).triangles,
             b = hull.ask(collision::Bvh(mesh_of(second))).triangles;
  std::vector<std::uint32_t> expected = a;
  for (const std::uint32_t t : b) expected.push_back(t + 100);
  EXPECT_EQ(hull.ask(collision::Bvh(mesh_of(both))).triangles, expected);
}

TEST(CpuDetection, PointsRespectTheSpacingAndIncludeTheFarthest) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Triangle t = {Vector3d(-0.02, -0.02, 0), Vector3d(0.03, -0.01, 0.01),
                                 Vector3d(0, 0.03, 0)};
  const Vector3d rp(0.2, 0.1, 0.3);
  for (const double spacing_m : {0.02, 5e-3, 1.1e-3}) {
    const collision::ObjectCollision found =
        hull.ask(collision::Bvh(mesh_of({t})), {.spacing_m = spacing_m, .max_points = 1u << 20},
                 Isometry3d::Identity(), rp);
    for (int i = 0; i <= 40; ++i)
      for (int j = 0; i + j <= 40; ++j) {
        const Vector3d p = t[0] + i / 40.0 * (t[1] - t[0]) + j / 40.0 * (t[2] - t[0]);
        EXPECT_TRUE(std::any_of(found.points.begin(), found.points.end(),
                                [&](const collision::CollisionPoint& q) {
                                  return (q.p_world_m - p).norm() <= spacing_m;
                                }));
      }
    double farthest_m = 0, corner_m = 0;
    for (const collision::CollisionPoint& p : found.points)
      farthest_m = std::max(farthest_m, (p.p_world_m - rp).norm());
    for (const Vector3d& v : t) corner_m = std::max(corner_m, (v - rp).norm());
    EXPECT_DOUBLE_EQ(farthest_m, corner_m);  // of a triangle in the hull
    EXPECT_FALSE(found.truncated);
  }
}

TEST(CpuDetection, KeepsAtMostMaxPointsAndTheFarthest) {
  const Hull hull(hand_like());
  const Isometry3d pose = at({-0.05, 0, 0});
  const Vector3d rp(1, 0.3, 0.2);
  const collision::Bvh tree(geometry::sphere_mesh(0.04, 3));
  const auto farthest_m = [&](const collision::ObjectCollision& c) {
    double m = 0;
    for (const collision::CollisionPoint& p : c.points) m = std::max(m, (p.p_world_m - rp).norm());
    return m;
  };
  const collision::ObjectCollision all = hull.ask(tree, {.spacing_m = 1e-3, .max_points = 1u << 20},
                                                  pose, rp),
                                   some = hull.ask(tree, {.spacing_m = 1e-3, .max_points = 50},
                                                   pose, rp);
  EXPECT_FALSE(all.truncated);
  EXPECT_GT(all.points.size(), 1000u);
  EXPECT_TRUE(some.truncated);
  EXPECT_EQ(some.points.size(), 50u);
  EXPECT_EQ(some.triangles, all.triangles);
  EXPECT_NEAR(farthest_m(some), farthest_m(all),
              2e-3);  // 50 points: those of a triangle are farther apart, too
}

// However fine the spacing: what would be found is not all kept, and no triangle is lost.
TEST(CpuDetection, ManyPointsDoNotGrowMemory) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Bvh tree(geometry::sphere_mesh(0.05, 4));
  const collision::DetectionObject object{&tree};
  for (const std::size_t max_points : {std::size_t{1}, std::size_t{50}, std::size_t{4096}}) {
    collision::CpuDetectionCounts counts;
    const collision::ObjectCollision found = collision::detect(
        hull.query, {&object, 1}, {.spacing_m = 2e-5, .max_points = max_points}, &counts)[0];
    EXPECT_EQ(found.triangles.size(), 5120u);
    EXPECT_EQ(found.points.size(), max_points);
    EXPECT_TRUE(found.truncated);
  }
  EXPECT_EQ(hull.ask(tree, {.spacing_m = 0, .max_points = 1}).triangles.size(), 5120u);
}

// Far beside a camera, and just in front of its plane: its image is further off than float can
// tell, and plainly nowhere near the object.
TEST(CpuDetection, ObjectsBesideACameraAreFree) {
  hull::ObjectPixels block(640, 480), all(640, 480);
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      all.set(u, v);
      if (u > 280 && u < 360 && v > 200 && v < 280) block.set(u, v);
    }
  const geometry::Pinhole pinhole{640, 480, 500, 500, 319.5, 239.5};
  const geometry::Camera ahead{pinhole, geometry::look_at(kOrigin, {1, 0, 0})},
      other{pinhole, geometry::look_at({0, 1, 0}, {0, 4, 0})};
  const Hull hull({{ahead, block}, {other, all}});
  for (const double in_front_m : {0.07, 0.05, 0.02, 1e-4, 0.0}) {
    const Vector3d p(in_front_m, 4, 0);
    const collision::Bvh tree(mesh_of({{p, p + Vector3d(0, 0.01, 0), p + Vector3d(0, 0, 0.01)}}));
    const collision::DetectionObject object{&tree};
    for (const double spacing_m : {0.0, 3e-3}) {
      collision::CpuDetectionCounts counts;
      const collision::ObjectCollision found =
          collision::detect(hull.query, {&object, 1}, {.spacing_m = spacing_m}, &counts)[0];
      if (in_front_m > 0) {
        EXPECT_EQ(found.verdict, collision::CollisionVerdict::free) << in_front_m;
      }
      EXPECT_LT(counts.points_in_double, 20000u);
    }
  }
}

// A triangle that is a point on a pixel's corner: lanes and in_hull() may round it into different
// pixels, and then it is not free.
TEST(CpuDetection, PixelCornerPointsAgreeWithInHull) {
  Random random(12);
  int in = 0, wrong = 0;
  for (int scene = 0; scene < 40; ++scene) {
    const geometry::Camera camera = random_camera(random, 160, 121);
    const Hull hull({{camera, random_pixels(random, 160, 121, 0.5)}});
    const Vector3d eye = geometry::camera_center_world_m(camera);
    for (int i = 0; i < 60; ++i) {
      const double u = std::floor(uniform(random, 1, 159)) - 0.5,
                   v = std::floor(uniform(random, 1, 120)) - 0.5;
      const Vector3d sight = camera.camera_from_world.linear().transpose() *
                             Vector3d((u - camera.pinhole.cx_px) / camera.pinhole.fx_px,
                                      (v - camera.pinhole.cy_px) / camera.pinhole.fy_px, 1);
      const Vector3d p = eye + uniform(random, 0.5, 2) * sight;
      if (!hull::in_hull(hull.silhouettes, p)) continue;
      ++in;
      wrong += hull.ask(collision::Triangle{p, p, p}) == collision::CollisionVerdict::free;
    }
  }
  EXPECT_GT(in, 500);
  EXPECT_EQ(wrong, 0);
}

TEST(CpuDetection, RefitsADeformedMesh) {
  const Hull hull(hand_like());
  geometry::Mesh mesh = geometry::curtain_mesh(0.3, 0.3, 20, 18, 0.02, 3);
  collision::Bvh tree(mesh);
  Random random(7);
  for (Vector3d& v : mesh.vertices_m) v += Vector3d(0, 0, 0.15) + random_in_ball(random, 0.01);
  tree.refit(mesh.vertices_m);
  const collision::ObjectCollision refitted = hull.ask(tree), anew = hull.ask(collision::Bvh(mesh));
  EXPECT_FALSE(anew.triangles.empty());
  EXPECT_EQ(refitted.triangles, anew.triangles);
  mesh.vertices_m.pop_back();
  EXPECT_THROW(tree.refit(mesh.vertices_m), std::invalid_argument);
}

// Its memory is kept, and none of what was in it.
TEST(CpuDetection, ReusedDetectionEqualsAFreshOne) {
  const Hull hull(hand_like()),
      other(silhouettes_of({ball({0.05, 0, 0}, 0.03)}, ring(4, 1.2, 0.6, 300, 0.5)), 3), none({});
  const collision::Bvh large(geometry::sphere_mesh(0.05, 4)), small(geometry::sphere_mesh(0.02, 2));
  const std::vector<std::vector<collision::DetectionObject>> asked{
      {{&large}, {&small}},
      {{&small}, {&large, at({1, 0, 0})}},
      {{&small, at({0, 1, 0})}},
      {{&large, at({0.03, 0, 0})}}};
  collision::CpuDetection kept;
  for (const double spacing_m : {5e-4, 0.0, 2e-3})
    for (const std::size_t max_points : {std::size_t{1} << 20, std::size_t{100}})
      for (const Hull* h : {&hull, &other, &none})
        for (const auto& objects : asked) {
          const collision::DetectionOptions options{.spacing_m = spacing_m,
                                                    .max_points = max_points};
          const auto found = kept.detect(h->query, objects, options);
          const auto anew = collision::detect(h->query, objects, options);
          ASSERT_EQ(found.size(), anew.size());
          for (std::size_t i = 0; i < anew.size(); ++i) {
            EXPECT_EQ(found[i].points, anew[i].points);
            EXPECT_EQ(found[i].triangles, anew[i].triangles);
            EXPECT_EQ(found[i].verdict, anew[i].verdict);
          }
        }
}

// All samples of a part, one after the other as it is divided.
TEST(ContactPoints, SamplesAreTheCellCenters) {
  const collision::Triangle t{Vector3d(1, 2, 3), Vector3d(1.4, 2, 3.1), Vector3d(0.9, 2.5, 3)};
  for (const int n : {1, 2, 3, 12}) {
    const double step = 1.0 / n;
    const Vector3d u = t[1] - t[0], v = t[2] - t[0];
    collision::ContactPoints points;
    points.add(Vector3d(7, 7, 7));
    points.begin_triangle();
    points.add(
        collision::SampledPart{t[0] + step / 3 * u, v, 0, step, step * u, step * (u + v) / 3, n});
    const Vector3d top = points.back();
    points.add(Vector3d(8, 8, 8));
    const auto count = std::size_t(n * n + 1);
    ASSERT_EQ(points.size(), count + 1);
    std::vector<collision::CollisionPoint> written(count + 1, {Vector3d::Zero(), 5});
    points.write(points.first_run(), 3, written.data(), count);
    std::size_t i = 0;
    for (int row = 0; row < n; ++row)
      for (int column = 0; column + row < n; ++column)
        for (const double off : {1.0 / 3, 2.0 / 3}) {
          if (off > 0.5 && column + row + 1 == n) continue;
          EXPECT_LT(
              (written[i].p_world_m - (t[0] + (column + off) * step * u + (row + off) * step * v))
                  .norm(),
              1e-14);
          EXPECT_EQ(written[i++].triangle, 3u);
        }
    EXPECT_EQ(top, written[i - 1].p_world_m);
    EXPECT_EQ(written[i], (collision::CollisionPoint{Vector3d(8, 8, 8), 3}));
    EXPECT_EQ(written[i + 1].triangle, 5u);  // and no more
  }
}

TEST(CpuDetection, EmptyHullOrEmptyMeshIsFree) {
  const Hull hull(hand_like()), none({});
  EXPECT_EQ(hull.ask(collision::Bvh()).verdict, collision::CollisionVerdict::free);
  EXPECT_EQ(hull.ask(collision::Bvh(geometry::Mesh{})).verdict, collision::CollisionVerdict::free);
  const collision::Bvh box(geometry::box_mesh({1, 1, 1}));
  EXPECT_EQ(none.ask(box).verdict, collision::CollisionVerdict::free);
  auto empty = hand_like();
  empty[2].pixels = hull::ObjectPixels(300, 300);
  EXPECT_EQ(Hull(empty).ask(box).verdict, collision::CollisionVerdict::free);
  EXPECT_TRUE(collision::detect(hull.query, {}).empty());
}

TEST(CpuDetection, RejectsInvalidArguments) {
  const Hull hull(hand_like());
  geometry::Mesh mesh = geometry::box_mesh({0.1, 0.1, 0.1});
  const collision::Bvh tree(mesh);
  EXPECT_THROW(hull.ask(tree, {.eps_m = 0}), std::invalid_argument);
  EXPECT_THROW(hull.ask(tree, {.eps_m = kNaN}), std::invalid_argument);
  EXPECT_THROW(hull.ask(tree, {.eps_m = 1e-9}), std::invalid_argument);
  EXPECT_THROW(hull.ask(tree, {.spacing_m = -1}), std::invalid_argument);
  EXPECT_THROW(hull.ask(tree, {.max_points = 0}), std::invalid_argument);
  EXPECT_THROW(hull.ask(tree, {}, at({kNaN, 0, 0})), std::invalid_argument);
  mesh.triangles.push_back({0, 1, 99});
  EXPECT_THROW(collision::Bvh{mesh}, std::invalid_argument);
  base::WorkerPool pool(1);
  const auto silhouettes = hand_like();
  hull::CpuHull seen(pool, silhouettes, {hull::Limits::seen, 2});
  const hull::HullQuery query(seen);
  const collision::DetectionObject object{&tree};
  EXPECT_THROW(collision::detect(query, {&object, 1}), std::invalid_argument);
}

// --- hard cases: triangles and meshes
// --------------------------------------------------------------------------------

TEST(HardTriangle, Degenerate) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const Vector3d in(0.01, 0, 0), also_in(-0.02, 0.01, 0), out(0.3, 0, 0), farther(0.5, 0, 0);
  for (const collision::DetectionOptions& options :
       {kVerdictAlone, collision::DetectionOptions{}}) {
    EXPECT_EQ(hull.ask(collision::Triangle{in, in, in}, options),
              collision::CollisionVerdict::colliding);  // a point
    EXPECT_EQ(hull.ask(collision::Triangle{in, in, also_in}, options),
              collision::CollisionVerdict::colliding);  // a zero edge
    EXPECT_EQ(hull.ask(collision::Triangle{out, farther, -out}, options),
              collision::CollisionVerdict::colliding);  // collinear, through it
    EXPECT_EQ(hull.ask(collision::Triangle{out, out, out}, options),
              collision::CollisionVerdict::free);
    EXPECT_EQ(hull.ask(collision::Triangle{out, farther, 0.5 * (out + farther)}, options),
              collision::CollisionVerdict::free);
  }
}

TEST(HardTriangle, SliverOfAMetreByAMicrometre) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.005)}, ring(4, 1.2, 0.6, 300, 0.5)));
  for (const double z : {0.0, 0.2}) {
    const collision::Triangle sliver = {Vector3d(-0.5, 0.001, z), Vector3d(0.5, 0.001, z),
                                        Vector3d(0.1, 0.001001, z)};
    EXPECT_EQ(hull.ask(sliver),
              z == 0 ? collision::CollisionVerdict::colliding : collision::CollisionVerdict::free);
  }
}

TEST(HardTriangle, OfTenMetresAroundAHullOfOneCentimetre) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.005)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const auto triangle = [](double z) {
    return collision::Triangle{Vector3d(-5, -3, z), Vector3d(5, -2, z), Vector3d(0.3, 6, z)};
  };
  EXPECT_EQ(hull.ask(triangle(0.001)), collision::CollisionVerdict::colliding);
  EXPECT_EQ(hull.ask(triangle(0.1)), collision::CollisionVerdict::free);
  EXPECT_EQ(
      hull.ask(collision::Bvh(mesh_of({triangle(0.001)})), {.spacing_m = 1e-3, .max_points = 10000})
          .verdict,
      collision::CollisionVerdict::colliding);
}

TEST(HardTriangle, WhollyInsideTheHull) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::ObjectCollision found =
      hull.ask(collision::Bvh(geometry::sphere_mesh(0.03, 2)), {.spacing_m = 2e-3});
  EXPECT_EQ(found.triangles.size(), 320u);
}

TEST(HardTriangle, TheHullWhollyInsideABox) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.02)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::ObjectCollision around = hull.ask(
                                       collision::Bvh(geometry::box_mesh({0.2, 0.2, 0.2}))),
                                   beside =
                                       hull.ask(collision::Bvh(geometry::box_mesh({0.2, 0.2, 0.2})),
                                                {}, at({0.3, 0.2, 0}));
  EXPECT_EQ(around.verdict,
            collision::CollisionVerdict::free);  // no point of its surface is in it,
  EXPECT_TRUE(around.hull_in_box);               // and this is said
  EXPECT_EQ(beside.verdict, collision::CollisionVerdict::free);
  EXPECT_FALSE(beside.hull_in_box);
}

TEST(HardTriangle, SeenEdgeOnByEveryCamera) {
  const Hull hull(
      silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0, 300, 0.5)));  // all in the plane z = 0
  EXPECT_EQ(hull.ask(collision::Triangle{Vector3d(-0.2, -0.1, 0), Vector3d(0.2, -0.1, 0),
                                         Vector3d(0, 0.3, 0)}),
            collision::CollisionVerdict::colliding);
  EXPECT_EQ(hull.ask(collision::Triangle{Vector3d(0.2, -0.1, 0), Vector3d(0.4, -0.1, 0),
                                         Vector3d(0.3, 0.3, 0)}),
            collision::CollisionVerdict::free);
}

// Closed pixels: the hull's border belongs to it, to rounding. Either verdict will do, in either
// order, but nothing else.
TEST(HardTriangle, EdgeExactlyOnTheHullsSurface) {
  hull::ObjectPixels half(64, 64);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u < 32; ++u) half.set(u, v);
  const geometry::Camera camera{{64, 64, 64, 64, 31.5, 31.5},
                                Isometry3d::Identity()};  // pixel 32 begins at x = 0
  const Hull hull({{camera, half}});
  const collision::Triangle beside = {Vector3d(0, -0.1, 1), Vector3d(0, 0.1, 1),
                                      Vector3d(0.1, 0, 1)},
                            inside = {Vector3d(0, -0.1, 1), Vector3d(0, 0.1, 1),
                                      Vector3d(-0.1, 0, 1)};
  const collision::CollisionVerdict verdict = hull.ask(beside);
  EXPECT_TRUE(verdict == collision::CollisionVerdict::free ||
              verdict == collision::CollisionVerdict::undecided);
  EXPECT_EQ(hull.ask(collision::Triangle{beside[2], beside[1], beside[0]}), verdict);
  EXPECT_EQ(hull.ask(inside), collision::CollisionVerdict::colliding);
}

TEST(HardTriangle, DuplicateAndNonManifoldFaces) {
  const Hull hull(hand_like());
  geometry::Mesh mesh = geometry::sphere_mesh(0.04, 2);
  const std::size_t once = mesh.triangles.size();
  const std::size_t colliding = hull.ask(collision::Bvh(mesh)).triangles.size();
  for (std::size_t i = 0; i < once; ++i) mesh.triangles.push_back(mesh.triangles[i]);
  EXPECT_EQ(hull.ask(collision::Bvh(mesh)).triangles.size(), 2 * colliding);
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}, {0, 1, 5}};  // four on one edge
  for (const std::uint32_t t : hull.ask(collision::Bvh(mesh)).triangles) EXPECT_LT(t, 4u);
}

TEST(HardTriangle, VertexThatIsNotANumberIsRefused) {
  geometry::Mesh mesh = geometry::box_mesh({0.1, 0.1, 0.1});
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
    geometry::Mesh broken = mesh;
    broken.vertices_m[3].y() = bad;
    EXPECT_THROW(collision::Bvh{broken}, std::invalid_argument);
    collision::Bvh tree(mesh);
    EXPECT_THROW(tree.refit(broken.vertices_m), std::invalid_argument);
    EXPECT_TRUE(tree.mesh().vertices_m[3].allFinite());  // refused, it changes nothing
  }
}

TEST(HardTriangle, FingerOfTwoMillimetresAgainstTrianglesOfTwoCentimetres) {
  const Hull hull(
      silhouettes_of({{{0, 0, -0.05}, {0.01, 0.02, 0.05}, 0.001}}, ring(4, 1.2, 0.6, 480, 0.4)));
  Random random(8);
  int pierced = 0;
  for (int i = 0; i < 300; ++i) {  // through a random point of the finger's axis
    const Vector3d p = Vector3d(0, 0, -0.045) + uniform(random, 0, 0.9) * Vector3d(0.01, 0.02, 0.1);
    const Vector3d a = random_direction(random), b = random_direction(random), c = -a - b;
    if (a.cross(b).norm() < 0.2) continue;
    ++pierced;
    EXPECT_EQ(hull.ask(collision::Triangle{p + 0.01 * a, p + 0.01 * b, p + 0.01 * c}),
              collision::CollisionVerdict::colliding);
  }
  EXPECT_GT(pierced, 200);
}

TEST(HardTriangle, OneKilometreAway) {
  const Vector3d far(1000, -700, 300);
  const Hull near(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const Hull away(silhouettes_of({ball(far, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5, far)));
  const collision::Bvh tree(geometry::sphere_mesh(0.05, 2));
  const std::size_t colliding = near.ask(tree, kVerdictAlone, at({0.06, 0, 0})).triangles.size();
  EXPECT_GT(colliding, 10u);
  EXPECT_NEAR(
      double(away.ask(tree, kVerdictAlone, at(far + Vector3d(0.06, 0, 0))).triangles.size()),
      double(colliding), 0.05 * double(colliding));
  EXPECT_EQ(near.ask(tree, kVerdictAlone, at(far)).verdict, collision::CollisionVerdict::free);
}

TEST(HardTriangle, ReachesBehindTheCameras) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  Random random(9);
  for (int i = 0; i < 40; ++i) {
    const Vector3d a = 20 * random_direction(random), b = 20 * random_direction(random);
    EXPECT_EQ(hull.ask(collision::Triangle{a, b, -a - b}),
              collision::CollisionVerdict::colliding);  // through the origin
    const Vector3d off = a.cross(b).normalized() * 0.2;
    const collision::Triangle beside = {off + a, off + b, off - a - b};
    if (!sampled(hull.silhouettes, beside, 400)) {
      EXPECT_NE(hull.ask(beside), collision::CollisionVerdict::colliding);
    }
  }
}

// Cut, for a camera's plane and for its size: each part has samples of its own, however few points
// are allowed.
TEST(HardTriangle, CutAtACamerasPlaneWithHardlyAPointAllowed) {
  std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.05)}, ring(2, 1.2, 0.6, 300, 0.5));
  for (hull::Silhouette& s : silhouettes)  // all of both images: the hull reaches up to the cameras
    for (int v = 0; v < 300; ++v)
      for (int u = 0; u < 300; ++u) s.pixels.set(u, v);
  const Hull hull(silhouettes);
  const Vector3d eye = geometry::camera_center_world_m(silhouettes[0].camera);
  const collision::ObjectCollision found = hull.ask(
      collision::Bvh(
          mesh_of({{1.5 * eye, -1.5 * eye + Vector3d(0, 2, 0), -1.5 * eye - Vector3d(0, 2, 0)}})),
      {.eps_m = 1e-6, .spacing_m = 1e-5, .max_points = 1});
  EXPECT_EQ(found.verdict, collision::CollisionVerdict::colliding);
  EXPECT_EQ(found.points.size(), 1u);
}

TEST(HardTriangle, ThroughACamerasCentre) {
  const Hull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const Vector3d eye = geometry::camera_center_world_m(hull.silhouettes[0].camera);
  EXPECT_EQ(hull.ask(collision::Triangle{eye, -0.2 * eye, Vector3d(0, 0, 0.3)}),
            collision::CollisionVerdict::colliding);
  EXPECT_NE(hull.ask(collision::Triangle{eye, 1.1 * eye, eye + Vector3d(0.1, 0, 0)}),
            collision::CollisionVerdict::colliding);
}

// A sheet of 2 m by 2 m, flat, through the hand.
Isometry3d lying_flat() {
  Isometry3d flat = at({0, 1, 0.002});
  flat.linear() = Eigen::AngleAxisd(-std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
  return flat;
}

TEST(HardTriangle, AMillionOfThem) {
  const Hull hull(hand_like());
  const collision::ObjectCollision found = hull.ask(
      collision::Bvh(geometry::curtain_mesh(2, 2, 1000, 500, 0, 1)), kVerdictAlone, lying_flat());
  EXPECT_GT(found.triangles.size(), 500u);
  EXPECT_LT(found.undecided.size(), 20u);
}

std::size_t resident_mb() {
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages >> pages;
  return pages * std::size_t(sysconf(_SC_PAGESIZE)) >> 20;
}

// The same sheet; a triangle is 0.6 by 1.3 mm, less than a pixel. Measured: the tree 390 MB beside
// the mesh, 0.86 GB at the most in all; built in 3.1 s, asked in 10 ms on one thread, 4.4 s
// together.
TEST(HardTriangle, TenMillionOfThem) {
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  const Hull hull(hand_like());
  geometry::Mesh mesh = geometry::curtain_mesh(2, 2, 3200, 1600, 0, 1);
  const std::size_t count = mesh.triangles.size(), before_mb = resident_mb();
  ASSERT_GT(count, 10'000'000u);
  const auto start = Clock::now();
  const collision::Bvh tree(std::move(mesh));
  const double built_s = seconds_since(start);
  const std::size_t tree_mb = resident_mb() - before_mb;
  collision::CpuDetection detection;
  const collision::DetectionObject object{&tree, lying_flat()};
  collision::ObjectCollision found;
  double asked_s = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 5; ++run) {
    const auto asking = Clock::now();
    const auto result = detection.detect(hull.query, {&object, 1}, kVerdictAlone);
    asked_s = std::min(asked_s, seconds_since(asking));
    found = result[0];
  }
  std::printf(
      "%zu triangles: tree %zu MB beside the mesh, built in %.1f s, asked in %.2f ms; %zu collide, "
      "%zu touch\n",
      count, tree_mb, built_s, 1e3 * asked_s, found.triangles.size(), found.undecided.size());
  EXPECT_LT(tree_mb, 1024u);
  EXPECT_GT(found.triangles.size(), 5000u);
  EXPECT_LT(found.undecided.size(), found.triangles.size() / 100);
  // By every triangle's middle: where that is in the hull, the triangle collides; and nearly only
  // there, as small as they are.
  std::size_t middles = 0, missed = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Vector3d middle = Vector3d::Zero();
    for (const std::uint32_t v : tree.mesh().triangles[i]) middle += tree.mesh().vertices_m[v] / 3;
    middle = object.world_from_object * middle;
    if (std::abs(middle.x()) > 0.2 || std::abs(middle.y()) > 0.2 || !hull.query.contains(middle))
      continue;
    ++middles;
    missed += !test::holds(found.triangles, std::uint32_t(i));
  }
  EXPECT_EQ(missed, 0u);
  EXPECT_GT(middles, found.triangles.size() / 2);
}

// Salt and pepper, where nothing is smooth.
TEST(HardTriangle, AgainstNoise) {
  Random random(10);
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : random_cameras(random, 3))
    silhouettes.push_back(
        {camera, random_pixels(random, camera.pinhole.width_px, camera.pinhole.height_px, 0.3)});
  const Hull hull(silhouettes);
  const std::vector<collision::Triangle> triangles = random_triangles(random, 60);
  const collision::ObjectCollision found = hull.ask(collision::Bvh(mesh_of(triangles)));
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (sampled(silhouettes, triangles[i], 30)) {
      EXPECT_TRUE(test::holds(found.triangles, i));
    }
}

}  // namespace
}  // namespace fivepipe::test
