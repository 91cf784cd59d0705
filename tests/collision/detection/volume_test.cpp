// Collisions with a hull that a box limits (HullRule::within_world_m), with both rules: objects
// beside, across and inside the box.
#include <algorithm>

#include "common/collision/detection/box_query.h"
#include "common/collision/oracle/triangle_reference.h"
#include "common/collision/proximity/lazy_octree.h"
#include "common/collision/tracking/hull_components.h"
#include "tests/support/collision/backends.h"

namespace fivepipe::test {
namespace {

using collision::CollisionVerdict;
using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using hull::HullRule;
using hull::Limits;

class BoxedDetection : public BackendTest {};
class CertifiedBoxedDetection : public BackendTest {};
INSTANTIATE_TEST_SUITE_P(Detection, BoxedDetection,
                         testing::Values(Backend::cpu, Backend::gl, Backend::paper), backend_name);
INSTANTIATE_TEST_SUITE_P(Detection, CertifiedBoxedDetection,
                         testing::Values(Backend::cpu, Backend::gl), backend_name);

const HullRule kBothRules[] = {{}, {Limits::seen, 2}};

HullRule boxed(HullRule rule, const AlignedBox3d& box) {
  rule.within_world_m = box;
  return rule;
}
AlignedBox3d random_box(Random& random) {
  const Vector3d center = random_in_ball(random, 0.1);
  const Vector3d half{uniform(random, 0.03, 0.12), uniform(random, 0.03, 0.12),
                      uniform(random, 0.03, 0.12)};
  return {center - half, center + half};
}

TEST_P(CertifiedBoxedDetection, AgreesWithTheExactReference) {
  Random random(41);
  int colliding = 0, free_of_box = 0, undecided = 0;
  for (int scene = 0; scene < 12; ++scene) {
    const auto silhouettes =
        silhouettes_of({random_cameras(random, 1 + scene % 4), random_object(random, 3)});
    const std::vector<collision::Triangle> triangles = random_triangles(random, 80);
    const collision::Bvh tree(mesh_of(triangles));
    for (const HullRule& of_cameras : kBothRules) {
      const HullRule rule = boxed(of_cameras, random_box(random));
      const CollisionHull hull(silhouettes, 1, rule);
      const collision::ObjectCollision alone = detect(hull, tree),
                                       with_points = detect(hull, tree, kAllPoints);
      for (const collision::ObjectCollision* found : {&alone, &with_points})
        for (const collision::CollisionPoint& p : found->points)
          EXPECT_TRUE(hull::in_hull(silhouettes, p.p_world_m, rule));
      for (std::size_t i = 0; i < triangles.size(); ++i) {
        SCOPED_TRACE(testing::Message() << scene << ' ' << i);
        const auto polygons = collision::hull_on_triangle(silhouettes, triangles[i], rule);
        double thickest_m = 0;
        for (const auto& polygon : polygons)
          thickest_m = std::max(thickest_m, inner_radius_m(polygon));
        const bool in_hull = sampled(silhouettes, triangles[i], 24, rule);
        for (const collision::ObjectCollision* found : {&alone, &with_points}) {
          const bool collides = test::holds(found->triangles, i),
                     is_free = !collides && !test::holds(found->undecided, i);
          if (is_free) {
            EXPECT_FALSE(in_hull);
            EXPECT_LT(thickest_m, 1e-9);
            free_of_box += sampled(silhouettes, triangles[i], 10, of_cameras);
          }
          if (collides) {
            EXPECT_FALSE(polygons.empty());
          }
          if (in_hull || thickest_m > kVerdictOnly.eps_m) {
            EXPECT_TRUE(collides);
          }
          colliding += collides, undecided += !collides && !is_free;
        }
      }
    }
  }
  EXPECT_GT(colliding, 500);
  EXPECT_GT(free_of_box, 200);
  EXPECT_LE(undecided, 0.02 * colliding);
}

// A triangle on the face belongs to the closed box; one beyond it does not.
TEST_P(CertifiedBoxedDetection, TheBoxIsClosed) {
  const std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5));
  const HullRule rule = boxed({}, {Vector3d(-0.03, -0.03, -0.03), Vector3d(0.03, 0.03, 0.03)});
  const CollisionHull hull(silhouettes, 1, rule);
  const auto at_z = [](double z) {
    return collision::Triangle{Vector3d(-0.01, -0.01, z), Vector3d(0.01, -0.01, z),
                               Vector3d(0, 0.01, z)};
  };
  EXPECT_EQ(verdict(hull, at_z(0)), CollisionVerdict::colliding);
  for (const double face : {-0.03, 0.03}) {
    EXPECT_EQ(verdict(hull, at_z(face)), CollisionVerdict::colliding);
    EXPECT_EQ(verdict(hull, at_z(face * (1 + 1e-12))), CollisionVerdict::free);
    EXPECT_EQ(verdict(hull, at_z(face * 1.5)), CollisionVerdict::free);
  }
  // It touches the box at a vertex, along an edge, and crosses all of it.
  EXPECT_EQ(verdict(hull, {Vector3d(0, 0, 0.03), Vector3d(0.01, 0, 0.05), Vector3d(0, 0.01, 0.05)}),
            CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {Vector3d(0, 0, 0.03), Vector3d(0.01, 0, 0.03), Vector3d(0, 0.01, 0.05)}),
            CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {Vector3d(-5, -5, 0.01), Vector3d(5, -5, 0.01), Vector3d(0, 9, 0.01)}),
            CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {Vector3d(0.04, 0, -5), Vector3d(0.04, 5, 5), Vector3d(0.04, -5, 5)}),
            CollisionVerdict::free);
}

// The spacing of the points holds up to the face.
TEST_P(CertifiedBoxedDetection, PointsReachTheFace) {
  const std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.08)}, ring(4, 1.2, 0.6, 300, 0.5));
  const HullRule rule = boxed({}, {Vector3d(-0.03, -0.03, -0.03), Vector3d(0.02, 0.03, 0.03)});
  const CollisionHull hull(silhouettes, 1, rule);
  const collision::Triangle t = {Vector3d(-0.02, -0.01, 0), Vector3d(0.06, -0.01, 0.001),
                                 Vector3d(0.01, 0.02, 0)};
  const collision::ObjectCollision found =
      detect(hull, collision::Bvh(mesh_of({t})), {.spacing_m = 2e-3, .max_points = 1u << 20});
  double farthest_x = -1;
  for (const collision::CollisionPoint& p : found.points) {
    EXPECT_TRUE(hull::in_hull(silhouettes, p.p_world_m, rule));
    farthest_x = std::max(farthest_x, p.p_world_m.x());
  }
  EXPECT_GT(farthest_x, 0.018);
  EXPECT_GT(found.points.size(), 200u);
}

TEST_P(BoxedDetection, ObjectsCollideOnlyInsideTheBox) {
  const std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.1)}, ring(4, 1.2, 0.6, 300, 0.6));
  const collision::Bvh block(geometry::box_mesh({0.04, 0.04, 0.04}));
  for (const HullRule& of_cameras : kBothRules) {
    const CollisionHull everywhere(silhouettes, 1, of_cameras),
        hull(silhouettes, 1,
             boxed(of_cameras, {Vector3d(-0.2, -0.2, -0.2), Vector3d(0.03, 0.2, 0.2)}));
    for (const double x : {-0.03, 0.02, 0.045}) {
      EXPECT_TRUE(detect(everywhere, block, kAllPoints, at({x, 0, 0})).colliding());
      EXPECT_TRUE(detect(hull, block, kAllPoints, at({x, 0, 0})).colliding()) << x;
    }
    EXPECT_TRUE(detect(everywhere, block, kAllPoints, at({0.06, 0, 0})).colliding());
    const collision::ObjectCollision outside = detect(hull, block, kAllPoints, at({0.06, 0, 0}));
    EXPECT_EQ(outside.verdict, CollisionVerdict::free);
    EXPECT_FALSE(outside.hull_in_box);
    EXPECT_TRUE(outside.points.empty());
  }
}

TEST_P(CertifiedBoxedDetection, ABoxAroundTheObjectChangesNoBit) {
  Random random(44);
  const auto silhouettes = silhouettes_of({random_cameras(random, 4), random_object(random, 3)});
  const collision::Bvh tree(mesh_of(random_triangles(random, 200)));
  const AlignedBox3d box(Vector3d::Constant(-3), Vector3d::Constant(3));
  for (const HullRule& rule : kBothRules) {
    const collision::ObjectCollision free = detect(CollisionHull(silhouettes, 1, rule), tree,
                                                   kAllPoints),
                                     in_box =
                                         detect(CollisionHull(silhouettes, 1, boxed(rule, box)),
                                                tree, kAllPoints);
    EXPECT_EQ(in_box.triangles, free.triangles);
    EXPECT_EQ(in_box.points, free.points);
  }
}

TEST(BoxedQueries, BoxesAndCubesOutsideAreFree) {
  Random random(45);
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.1)}, ring(4, 1.2, 0.6, 300, 0.6));
  int free = 0, centers = 0;
  for (const HullRule& of_cameras : kBothRules)
    for (int scene = 0; scene < 10; ++scene) {
      const HullRule rule = boxed(of_cameras, random_box(random));
      const CollisionHull hull(silhouettes, 1, rule);
      const collision::CubeQuery cubes(hull.query);
      for (int i = 0; i < 100; ++i) {
        const Vector3d center = random_in_ball(random, 0.12);
        const double half_m = uniform(random, 0.001, 0.03);
        const Vector3d half = Vector3d::Constant(half_m);
        const collision::CubeVerdict verdict = cubes.test(center, half_m);
        const bool certified =
            collision::is_certainly_free(silhouettes, {center - half, center + half}, 0, rule);
        EXPECT_EQ(verdict.center_in_hull, hull::in_hull(silhouettes, center, rule));
        centers += verdict.center_in_hull;
        if (AlignedBox3d(center - half, center + half)
                .intersection(rule.within_world_m)
                .isEmpty()) {
          EXPECT_TRUE(verdict.free);
          EXPECT_TRUE(certified);
        }
        free += verdict.free && hull::in_hull(silhouettes, center, of_cameras);
        if (!verdict.free && !certified) continue;
        for (int k = 0; k < 50; ++k)
          EXPECT_FALSE(hull::in_hull(
              silhouettes,
              center + half_m * Vector3d{uniform(random, -1, 1), uniform(random, -1, 1),
                                         uniform(random, -1, 1)},
              rule));
      }
    }
  EXPECT_GT(free, 100);
  EXPECT_GT(centers, 100);
}

TEST(BoxedQueries, ComponentsHaveTheCellsInTheBox) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.1)}, ring(4, 1.2, 0.6, 300, 0.6));
  const AlignedBox3d space(Vector3d(-0.2, -0.2, -0.2), Vector3d(0.2, 0.2, 0.2));
  for (const HullRule& of_cameras : kBothRules) {
    const HullRule rule =
        boxed(of_cameras, {Vector3d(-0.2, -0.033, -0.2), Vector3d(0.041, 0.2, 0.0615)});
    const CollisionHull hull(silhouettes, 1, rule);
    double expected = 0, found = 0;
    for (int z = 0; z < 40; ++z)
      for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 40; ++x)
          expected += hull::in_hull(silhouettes,
                                    space.min() + 0.01 * Vector3d(x + 0.5, y + 0.5, z + 0.5), rule);
    for (const collision::HullComponent& c :
         collision::hull_components(hull.query, {.within_world_m = space, .cell_m = 0.01}))
      found += double(c.cells);
    EXPECT_EQ(found, expected);
    EXPECT_GT(found, 300);
  }
}

}  // namespace
}  // namespace fivepipe::test
