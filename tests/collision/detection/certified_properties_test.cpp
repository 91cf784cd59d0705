// Properties of the certified backends of collision detection: agreement with the exact reference,
// invariances, and the collision points.
#include <algorithm>
#include <array>
#include <numbers>
#include <stdexcept>

#include "common/collision/oracle/triangle_reference.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/allocated_bytes.h"
#include "tests/support/collision/backends.h"

namespace fivepipe::test {
namespace {

using collision::CollisionVerdict;
using Eigen::Isometry3d;
using Eigen::Vector3d;

class CertifiedDetection : public BackendTest {};
INSTANTIATE_TEST_SUITE_P(Detection, CertifiedDetection, testing::Values(Backend::cpu, Backend::gl),
                         backend_name);

// Scene 0 is the hand; the others are random.
CollisionHull random_hull(Random& random, int scene, int cameras) {
  return CollisionHull(
      scene == 0 ? hand_like()
                 : silhouettes_of({random_cameras(random, cameras), random_object(random, 3)}));
}

TEST_P(CertifiedDetection, FindsEveryTriangleWithASampleInTheHull) {
  Random random(1);
  int colliding = 0, free = 0, undecided = 0;
  for (int scene = 0; scene < 12; ++scene) {
    const CollisionHull hull = random_hull(random, scene, 1 + scene % 5);
    const std::vector<collision::Triangle> triangles = random_triangles(random, 150);
    const collision::Bvh tree(mesh_of(triangles));
    const collision::ObjectCollision alone = detect(hull, tree),
                                     with_points = detect(hull, tree, kAllPoints);
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

// A free triangle has no part in the hull that is deeper than rounding, a colliding one has a part
// in the hull, and a part deeper than eps_m is found.
TEST_P(CertifiedDetection, AgreesWithTheExactReference) {
  Random random(11);
  int crossing = 0, undecided = 0;
  for (int scene = 0; scene < 5; ++scene) {
    const CollisionHull hull = random_hull(random, scene, 2 + scene);
    const collision::HullDistance distance(hull.silhouettes);
    const std::vector<collision::Triangle> triangles = random_triangles(random, 90);
    const collision::Bvh tree(mesh_of(triangles));
    const collision::ObjectCollision alone = detect(hull, tree),
                                     with_points = detect(hull, tree, kAllPoints);
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const collision::TriangleTruth truth = collision::triangle_truth(distance, triangles[i]);
      crossing += truth.crosses;
      for (const collision::ObjectCollision* found : {&alone, &with_points}) {
        const bool colliding = test::holds(found->triangles, i);
        undecided += test::holds(found->undecided, i);
        if (truth.deepest_m > 1e-9) {
          EXPECT_TRUE(colliding || test::holds(found->undecided, i))
              << scene << ' ' << i << ' ' << truth.deepest_m;
        }
        if (truth.deepest_m > kVerdictOnly.eps_m) {
          EXPECT_TRUE(colliding);
        }
        if (!truth.crosses) {
          EXPECT_FALSE(colliding) << scene << ' ' << i;
        }
      }
    }
  }
  EXPECT_GT(crossing, 100);
  EXPECT_LE(undecided, 0.02 * crossing);  // over two results per triangle
}

// The corner of a triangle enters the hull by as little as 0.1 um, far less than eps_m.
TEST_P(CertifiedDetection, FindsAPenetrationFarThinnerThanEps) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(3, 1.2, 0.6, 300, 0.5)));
  const auto pieces =
      hull::reference_intervals(hull.silhouettes, {{0.3, 0.004, 0.002}, {-1, 0, 0}}, 0, 1);
  ASSERT_FALSE(pieces.empty());
  for (const double depth_m : {1e-4, 1e-5, 1e-6, 1e-7}) {
    const double x = 0.3 - pieces.front().enter - depth_m;
    EXPECT_EQ(verdict(hull, {Vector3d(x, 0.004, 0.002), Vector3d(x + 0.02, 0.014, 0.002),
                             Vector3d(x + 0.02, -0.006, 0.002)}),
              CollisionVerdict::colliding)
        << depth_m;
  }
}

// Just before a camera, the rounding of a point's depth exceeds the depth.
TEST_P(CertifiedDetection, TrianglesJustBeforeACameraAreNotFree) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.3)}, ring(1, 1.2, 0.6, 300, 0.5)));
  const Vector3d center_m = geometry::camera_center_world_m(hull.silhouettes[0].camera);
  const Vector3d towards = (kOrigin - center_m).normalized();
  const Vector3d across = towards.unitOrthogonal(), up = towards.cross(across);
  // Makes the mesh large, and with it the rounding errors near the camera. It is free.
  const Vector3d far_m = center_m - towards;
  const collision::Triangle behind = {far_m, far_m - 0.1 * across, far_m - 0.1 * up};
  for (double distance_m = 0.1; distance_m > 1e-12; distance_m /= 2) {
    const Vector3d p = center_m + distance_m * towards;
    const double size_m = 0.1 * distance_m;
    ASSERT_TRUE(hull::in_hull(hull.silhouettes, p)) << distance_m;
    const collision::Triangle t = {p - size_m * (across + up), p + size_m * across,
                                   p + size_m * up};
    for (const auto& triangles : {std::vector{t}, std::vector{t, behind}})
      EXPECT_NE(detect(hull, collision::Bvh(mesh_of(triangles))).verdict, CollisionVerdict::free)
          << distance_m << " m before the camera, in a mesh of " << triangles.size();
  }
}

TEST_P(CertifiedDetection, IsIndependentOfVertexOrder) {
  Random random(2);
  const CollisionHull hull(hand_like());
  for (int i = 0; i < 30; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1, 0.05);
    std::array<std::size_t, 3> order = {0, 1, 2};
    const collision::ObjectCollision first = detect(hull, collision::Bvh(mesh_of({t})), kAllPoints);
    while (std::next_permutation(order.begin(), order.end())) {
      const collision::ObjectCollision again = detect(
          hull, collision::Bvh(mesh_of({{t[order[0]], t[order[1]], t[order[2]]}})), kAllPoints);
      EXPECT_EQ(again.verdict, first.verdict);
      EXPECT_EQ(again.points, first.points);
    }
  }
}

TEST_P(CertifiedDetection, IsInvariantUnderRigidMotion) {
  Random random(4);
  const std::vector<hull::Silhouette> silhouettes = hand_like();
  const collision::Bvh tree(mesh_of(random_triangles(random, 400)));
  const collision::ObjectCollision at_rest = detect(CollisionHull(silhouettes), tree);
  Isometry3d motion = Isometry3d::Identity();
  motion.linear() = Eigen::AngleAxisd(1.1, random_direction(random)).toRotationMatrix();
  motion.translation() = Vector3d(3, -2, 1);
  std::vector<hull::Silhouette> moved = silhouettes;
  for (hull::Silhouette& s : moved)
    s.camera.camera_from_world = s.camera.camera_from_world * motion.inverse();
  EXPECT_EQ(detect(CollisionHull(moved), tree, kVerdictOnly, motion).triangles, at_rest.triangles);
}

TEST_P(CertifiedDetection, VerdictIsInvariantUnderSubdivision) {
  Random random(5);
  const CollisionHull hull(hand_like());
  for (int i = 0; i < 200; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1, 0.08);
    const Vector3d a = 0.5 * (t[0] + t[1]), b = 0.5 * (t[0] + t[2]), c = 0.5 * (t[1] + t[2]);
    const collision::ObjectCollision parts = detect(
        hull, collision::Bvh(mesh_of({{t[0], a, b}, {a, t[1], c}, {b, c, t[2]}, {a, b, c}})));
    EXPECT_EQ(verdict(hull, t) == CollisionVerdict::colliding, parts.colliding());
  }
}

TEST_P(CertifiedDetection, AMergedMeshGivesTheUnionOfTheResults) {
  Random random(6);
  const CollisionHull hull(hand_like());
  const std::vector<collision::Triangle> first = random_triangles(random, 100),
                                         second = random_triangles(random, 57);
  std::vector<collision::Triangle> both = first;
  both.insert(both.end(), second.begin(), second.end());
  std::vector<std::uint32_t> expected = detect(hull, collision::Bvh(mesh_of(first))).triangles;
  for (const std::uint32_t t : detect(hull, collision::Bvh(mesh_of(second))).triangles)
    expected.push_back(t + 100);
  EXPECT_EQ(detect(hull, collision::Bvh(mesh_of(both))).triangles, expected);
}

TEST_P(CertifiedDetection, ABatchGivesTheResultsOfSingleObjects) {
  Random random(3);
  std::vector<collision::Bvh> trees;
  std::vector<collision::DetectionObject> objects;
  const CollisionHull hull(hand_like());
  for (const int triangles : {90, 1, 700, 0, 20, 16, 257})
    trees.emplace_back(mesh_of(random_triangles(random, triangles)));
  for (const collision::Bvh& tree : trees)
    objects.push_back({&tree, at(random_in_ball(random, 0.05))});
  objects.push_back({&trees[2], at({0, 0.03, 0})});  // the same BVH a second time
  const std::vector<collision::ObjectCollision> together = detect(hull, objects, kAllPoints);
  int colliding = 0;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const collision::ObjectCollision alone = detect(hull, {&objects[i], 1}, kAllPoints)[0];
    EXPECT_EQ(together[i].verdict, alone.verdict);
    EXPECT_EQ(together[i].triangles, alone.triangles);
    EXPECT_EQ(together[i].points, alone.points);
    colliding += alone.colliding();
  }
  EXPECT_GT(colliding, 3);
}

TEST_P(CertifiedDetection, ARefittedBvhGivesTheResultsOfANewOne) {
  const CollisionHull hull(hand_like());
  geometry::Mesh mesh = geometry::curtain_mesh(0.3, 0.3, 20, 18, 0.02, 3);
  collision::Bvh tree(mesh);
  EXPECT_TRUE(detect(hull, tree, kVerdictOnly, at({0, 0, 1})).triangles.empty());
  Random random(7);
  for (Vector3d& v : mesh.vertices_m) v += Vector3d(0, 0, 0.15) + random_in_ball(random, 0.01);
  tree.refit(mesh.vertices_m);
  const collision::ObjectCollision refitted = detect(hull, tree),
                                   rebuilt = detect(hull, collision::Bvh(mesh));
  EXPECT_FALSE(rebuilt.triangles.empty());
  EXPECT_EQ(refitted.triangles, rebuilt.triangles);
}

TEST_P(CertifiedDetection, PointsRespectTheSpacingAndEndWithTheFarthest) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  // The whole triangle is in the hull, so its farthest point is a vertex.
  const collision::Triangle t = {Vector3d(-0.02, -0.02, 0), Vector3d(0.03, -0.01, 0.01),
                                 Vector3d(0, 0.03, 0)};
  const Vector3d rp(0.2, 0.1, 0.3);
  double farthest_m = 0;
  for (const Vector3d& v : t) farthest_m = std::max(farthest_m, (v - rp).norm());
  for (const double spacing_m : {0.02, 5e-3, 1.1e-3}) {
    const collision::ObjectCollision found =
        detect(hull, collision::Bvh(mesh_of({t})), {.spacing_m = spacing_m, .max_points = 1u << 20},
               Isometry3d::Identity(), rp);
    for (int i = 0; i <= 40; ++i)
      for (int j = 0; i + j <= 40; ++j)
        EXPECT_TRUE(has_point_near(
            found, t[0] + i / 40.0 * (t[1] - t[0]) + j / 40.0 * (t[2] - t[0]), spacing_m));
    ASSERT_FALSE(found.points.empty());
    EXPECT_DOUBLE_EQ((found.points.back().p_world_m - rp).norm(), farthest_m);
    EXPECT_FALSE(found.truncated);
  }
}

// A point whose surroundings of spacing_m are in the hull lies in a part whose center is in the
// hull too.
TEST_P(CertifiedDetection, PointsRespectTheSpacingUpToTheHullsBorder) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::HullDistance distance(hull.silhouettes);
  const collision::Triangle t = {Vector3d(0, 0, 0), Vector3d(0.15, 0.02, 0.01),
                                 Vector3d(0.02, 0.12, -0.02)};
  for (const double spacing_m : {7e-3, 2e-3}) {
    const collision::ObjectCollision found = detect(
        hull, collision::Bvh(mesh_of({t})), {.spacing_m = spacing_m, .max_points = 1u << 20});
    int tested = 0;
    for (int i = 0; i <= 60; ++i)
      for (int j = 0; i + j <= 60; ++j) {
        const Vector3d p = t[0] + i / 60.0 * (t[1] - t[0]) + j / 60.0 * (t[2] - t[0]);
        if (!(distance.depth_m(p) > spacing_m)) continue;
        ++tested;
        EXPECT_TRUE(has_point_near(found, p, spacing_m));
      }
    EXPECT_GT(tested, 50);
  }
}

TEST_P(CertifiedDetection, SubsamplesToMaxPointsAndKeepsTheFarthest) {
  const CollisionHull hull(hand_like());
  const Isometry3d pose = at({-0.05, 0, 0});
  const Vector3d rp(1, 0.3, 0.2);
  const collision::Bvh tree(geometry::sphere_mesh(0.04, 3));
  const auto farthest_m = [&](const collision::ObjectCollision& c) {
    double m = 0;
    for (const collision::CollisionPoint& p : c.points) m = std::max(m, (p.p_world_m - rp).norm());
    return m;
  };
  const collision::ObjectCollision all = detect(hull, tree,
                                                {.spacing_m = 1e-3, .max_points = 1u << 20}, pose,
                                                rp),
                                   some = detect(hull, tree, {.spacing_m = 1e-3, .max_points = 50},
                                                 pose, rp);
  EXPECT_FALSE(all.truncated);
  EXPECT_GT(all.points.size(), 1000u);
  EXPECT_TRUE(some.truncated);
  EXPECT_EQ(some.points.size(), 50u);
  EXPECT_EQ(some.triangles, all.triangles);
  // With 50 points, those of a triangle are farther apart too.
  EXPECT_NEAR(farthest_m(some), farthest_m(all), 2e-3);
}

// With 20 um the samples would exceed any memory; no triangle may be lost.
TEST_P(CertifiedDetection, KeepsMaxPointsAndEveryTriangleForAnySpacing) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5)));
  const collision::Bvh tree(geometry::sphere_mesh(0.05, 4));
  for (const std::size_t max_points : {std::size_t{1}, std::size_t{50}, std::size_t{4096}}) {
    const collision::ObjectCollision found =
        detect(hull, tree, {.spacing_m = 2e-5, .max_points = max_points});
    EXPECT_EQ(found.triangles.size(), 5120u);
    EXPECT_EQ(found.points.size(), max_points);
    EXPECT_TRUE(found.truncated);
  }
  EXPECT_EQ(detect(hull, tree, {.spacing_m = 0, .max_points = 1}).triangles.size(), 5120u);
}

// The detector returns its own results and reuses their memory. Counts the calling thread only,
// which is the thread that would copy.
TEST_P(CertifiedDetection, ARepeatedDetectionCopiesNoPoints) {
  const CollisionHull hull(hand_like());
  const collision::Bvh tree(geometry::sphere_mesh(0.05, 3));
  const collision::DetectionObject object{&tree};
  const auto detector = make_detector({.spacing_m = 1e-3, .max_points = 1u << 20});
  detector->set_hull(hull.query, hull.silhouettes);
  const collision::CollisionPoint* points[2] = {};
  std::size_t count = 0, allocated = 0;
  for (int call = 0; call < 4; ++call) {
    const std::size_t before = allocated_bytes();
    const auto collisions = detector->detect({&object, 1});
    allocated = allocated_bytes() - before;
    count = collisions[0].points.size();
    points[call % 2] = collisions[0].points.data();
  }
  EXPECT_GT(count, 5000u);
  EXPECT_EQ(points[0], points[1]);
  EXPECT_LT(allocated, count * sizeof(collision::CollisionPoint));
}

}  // namespace
}  // namespace fivepipe::test
