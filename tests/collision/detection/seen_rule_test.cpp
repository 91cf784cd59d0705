// Collision detection with Limits::seen, on rigs whose cameras see only parts of the object: the
// hull then has faces on the borders of the images.
#include <algorithm>
#include <array>
#include <stdexcept>

#include "common/collision/detection/box_query.h"
#include "common/collision/oracle/triangle_reference.h"
#include "tests/support/collision/backends.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using collision::CollisionVerdict;
using Eigen::Vector3d;
using hull::HullRule;
using hull::Limits;

class SeenDetection : public BackendTest {
 protected:
  collision::ObjectCollision detect_triangles(
      const CollisionHull& hull, const std::vector<collision::Triangle>& triangles,
      const collision::DetectionOptions& options = kVerdictOnly) {
    return detect(hull, collision::Bvh(mesh_of(triangles)), options);
  }
};
class CertifiedSeenDetection : public SeenDetection {};
INSTANTIATE_TEST_SUITE_P(Detection, SeenDetection,
                         testing::Values(Backend::cpu, Backend::gl, Backend::paper), backend_name);
INSTANTIATE_TEST_SUITE_P(Detection, CertifiedSeenDetection,
                         testing::Values(Backend::cpu, Backend::gl), backend_name);

std::vector<hull::Silhouette> narrow_rig(Random& random, int cameras) {
  return silhouettes_of({narrow_cameras(random, cameras), random_object(random, 3)});
}

TEST_P(CertifiedSeenDetection, AgreesWithTheExactReference) {
  Random random(21);
  int crossing = 0, colliding = 0, free = 0, undecided = 0, only_seen = 0;
  for (int scene = 0; scene < 10; ++scene) {
    const int cameras = 1 + scene % 5;
    const std::vector<hull::Silhouette> silhouettes = narrow_rig(random, cameras);
    const std::vector<collision::Triangle> triangles = random_triangles(random, 70);
    const collision::Bvh tree(mesh_of(triangles));
    for (const int min_seen : {1, 2, 3, cameras}) {
      const HullRule rule{Limits::seen, min_seen};
      const CollisionHull hull(silhouettes, 1, rule);
      const collision::ObjectCollision alone = detect(hull, tree),
                                       with_points = detect(hull, tree, kAllPoints);
      for (std::size_t i = 0; i < triangles.size(); ++i) {
        SCOPED_TRACE(testing::Message() << scene << ' ' << min_seen << ' ' << i);
        const auto polygons = collision::hull_on_triangle(silhouettes, triangles[i], rule);
        double thickest_m = 0;
        for (const auto& polygon : polygons)
          thickest_m = std::max(thickest_m, inner_radius_m(polygon));
        const bool in_hull = sampled(silhouettes, triangles[i], 24, rule);
        crossing += !polygons.empty();
        only_seen +=
            !polygons.empty() && collision::hull_on_triangle(silhouettes, triangles[i]).empty();
        for (const collision::ObjectCollision* found : {&alone, &with_points}) {
          const bool collides = test::holds(found->triangles, i),
                     is_free = !collides && !test::holds(found->undecided, i);
          if (is_free) {
            EXPECT_FALSE(in_hull);
            EXPECT_LT(thickest_m, 1e-9);
          }
          if (collides) {
            EXPECT_FALSE(polygons.empty());
          }
          if (in_hull || thickest_m > kVerdictOnly.eps_m) {
            EXPECT_TRUE(collides);
          }
          colliding += collides, free += is_free, undecided += !collides && !is_free;
        }
      }
      for (const collision::ObjectCollision* found : {&alone, &with_points})
        for (const collision::CollisionPoint& p : found->points) {
          EXPECT_TRUE(hull::in_hull(silhouettes, p.p_world_m, rule));
          EXPECT_TRUE(test::holds(found->triangles, p.triangle));
        }
    }
  }
  EXPECT_GT(crossing, 400);
  EXPECT_GT(only_seen, 100);  // the rule matters on these rigs
  EXPECT_GT(colliding, 800);
  EXPECT_GT(free, 800);
  EXPECT_LE(undecided, 0.02 * colliding);
}

// Shapes that graze the borders of an image in which all pixels are object pixels: the hull of one
// camera is the pyramid of its image.
TEST_P(CertifiedSeenDetection, TrianglesAtAnImageBorder) {
  Random random(22);
  for (int seed = 0; seed < 6; ++seed) {
    const geometry::Camera camera = random_camera(random, 64, 48);
    std::vector<hull::Silhouette> silhouettes{{camera, random_pixels(random, 64, 48, 1)}};
    const CollisionHull hull(silhouettes, 1, {Limits::seen, 1});
    const auto at_pixel = [&](double u_px, double v_px, double depth_m) {
      const geometry::Ray ray = geometry::ray_through(camera, Eigen::Vector2d(u_px, v_px));
      return Vector3d(ray.origin_world_m + depth_m * ray.direction_world);
    };
    for (const double off_px : {1e-3, 1e-7, -1e-7, -1e-3}) {
      // From the border outward (off > 0), or with a corner inside.
      const double u_px = 63.5 + off_px;
      const collision::Triangle t = {at_pixel(u_px, 10, 1), at_pixel(u_px + 5, 12, 1.2),
                                     at_pixel(u_px + 4, 20, 0.9)};
      const bool in_hull = hull::in_hull(silhouettes, t[0], {Limits::seen, 1});
      EXPECT_EQ(in_hull, off_px < 0);
      EXPECT_EQ(verdict(hull, t) == CollisionVerdict::colliding, in_hull) << off_px;
      if (off_px > 1e-4) {  // farther than the error of float
        EXPECT_EQ(verdict(hull, t), CollisionVerdict::free);
      }
    }
    // Behind the camera, across its plane, and wholly inside.
    EXPECT_EQ(verdict(hull, {at_pixel(10, 10, -1), at_pixel(20, 10, -1), at_pixel(10, 20, -1)}),
              CollisionVerdict::free);
    EXPECT_EQ(verdict(hull, {at_pixel(30, 20, -0.5), at_pixel(31, 20, 1), at_pixel(30, 21, 1)}),
              CollisionVerdict::colliding);
    const collision::ObjectCollision solid = detect_triangles(
        hull, {{at_pixel(20, 20, 1), at_pixel(40, 20, 1), at_pixel(30, 30, 1.1)}}, kAllPoints);
    EXPECT_TRUE(solid.colliding());
    EXPECT_GT(solid.points.size(), 10u);
  }
}

// A triangle that lies in the plane of an image's border, and triangles without area.
TEST_P(CertifiedSeenDetection, DegenerateTriangles) {
  Random random(23);
  const geometry::Camera camera = random_camera(random, 64, 48);
  const std::vector<hull::Silhouette> silhouettes{{camera, random_pixels(random, 64, 48, 1)}};
  const CollisionHull hull(silhouettes, 1, {Limits::seen, 1});
  const auto at_pixel = [&](double u_px, double v_px, double depth_m) {
    const geometry::Ray ray = geometry::ray_through(camera, Eigen::Vector2d(u_px, v_px));
    return Vector3d(ray.origin_world_m + depth_m * ray.direction_world);
  };
  for (const double u_px : {-0.5, 63.5}) {
    const collision::ObjectCollision found = detect_triangles(
        hull, {{at_pixel(u_px, 10, 1), at_pixel(u_px, 30, 1), at_pixel(u_px, 20, 2)}}, kAllPoints);
    for (const collision::CollisionPoint& p : found.points)
      EXPECT_TRUE(hull::in_hull(silhouettes, p.p_world_m, {Limits::seen, 1}));
  }
  const Vector3d inside = at_pixel(30, 20, 1), outside = at_pixel(80, 20, 1);
  EXPECT_EQ(verdict(hull, {inside, inside, inside}), CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {outside, outside, outside}), CollisionVerdict::free);
  EXPECT_EQ(verdict(hull, {inside, outside, outside}), CollisionVerdict::colliding);
  EXPECT_EQ(verdict(hull, {inside, 0.5 * (inside + outside), outside}),
            CollisionVerdict::colliding);
}

TEST_P(CertifiedSeenDetection, IsIndependentOfVertexAndCameraOrder) {
  Random random(24);
  std::vector<hull::Silhouette> silhouettes = narrow_rig(random, 4);
  const HullRule rule{Limits::seen, 2};
  const CollisionHull hull(silhouettes, 1, rule);
  std::reverse(silhouettes.begin(), silhouettes.end());
  const CollisionHull reversed(silhouettes, 2, rule);
  int colliding = 0;
  for (int i = 0; i < 40; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1, 0.05);
    const collision::ObjectCollision first = detect_triangles(hull, {t}, kAllPoints);
    colliding += first.colliding();
    EXPECT_EQ(detect_triangles(reversed, {t}, kAllPoints).points, first.points);
    std::array<std::size_t, 3> order = {0, 1, 2};
    while (std::next_permutation(order.begin(), order.end())) {
      const collision::ObjectCollision again =
          detect_triangles(hull, {{t[order[0]], t[order[1]], t[order[2]]}}, kAllPoints);
      EXPECT_EQ(again.verdict, first.verdict);
      EXPECT_EQ(again.points, first.points);
    }
  }
  EXPECT_GT(colliding, 4);
}

// A camera without object pixels makes no hull empty where it does not see it.
TEST_P(SeenDetection, ACameraWithoutObjectPixelsRemovesOnlyWhatItSees) {
  Random random(25);
  std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.1)}, random_cameras(random, 3));
  const Vector3d eye(0, 0, 1);
  silhouettes.push_back({{geometry::pinhole_from_fov(64, 48, 0.8),
                          geometry::look_at(eye, {0.1, 0, 2}, Vector3d::UnitX())},
                         hull::ObjectPixels(64, 48)});
  const collision::Bvh block(geometry::box_mesh({0.05, 0.05, 0.05}));
  const HullRule rule{Limits::seen, 3};
  EXPECT_TRUE(detect(CollisionHull(silhouettes, 1, rule), block).colliding());
  EXPECT_FALSE(detect(CollisionHull(silhouettes), block).colliding());
  silhouettes.back().camera.camera_from_world =
      geometry::look_at(eye, {0, 0, 0}, Vector3d::UnitX());
  EXPECT_EQ(detect(CollisionHull(silhouettes, 1, rule), block).verdict, CollisionVerdict::free);
}

TEST_P(SeenDetection, FewerCamerasThanMinSeenHaveNoHull) {
  Random random(26);
  const std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.1)}, random_cameras(random, 2));
  const collision::Bvh block(geometry::box_mesh({0.05, 0.05, 0.05}));
  EXPECT_TRUE(detect(CollisionHull(silhouettes, 1, {Limits::seen, 2}), block).colliding());
  EXPECT_EQ(detect(CollisionHull(silhouettes, 1, {Limits::seen, 3}), block).verdict,
            CollisionVerdict::free);
}

TEST_P(SeenDetection, EveryPointIsInTheHullAndLargeContactsAreFound) {
  Random random(27);
  int points = 0, found_where_sampled = 0, sampled_objects = 0;
  for (int scene = 0; scene < 6; ++scene) {
    const std::vector<hull::Silhouette> silhouettes = narrow_rig(random, 3);
    for (const int min_seen : {1, 2}) {
      const HullRule rule{Limits::seen, min_seen};
      const CollisionHull hull(silhouettes, 1, rule);
      for (int i = 0; i < 10; ++i) {
        const collision::Triangle t = random_triangle(random, 0.1, 0.1);
        const collision::ObjectCollision found = detect_triangles(hull, {t}, kAllPoints);
        points += int(found.points.size());
        for (const collision::CollisionPoint& p : found.points)
          EXPECT_TRUE(hull::in_hull(silhouettes, p.p_world_m, rule));
        if (found.verdict == CollisionVerdict::free) {
          EXPECT_FALSE(sampled(silhouettes, t, 40, rule));
        }
        int in_hull = 0;
        for (int k = 0; k < 400; ++k)
          in_hull += hull::in_hull(
              silhouettes, t[0] + (k % 20) / 40.0 * (t[1] - t[0]) + (k / 20) / 40.0 * (t[2] - t[0]),
              rule);
        if (in_hull < 100) continue;  // smaller parts may be between the samples of backend `paper`
        ++sampled_objects;
        found_where_sampled += found.colliding();
      }
    }
  }
  EXPECT_GT(points, 200);
  EXPECT_GT(sampled_objects, 10);
  EXPECT_EQ(found_where_sampled, sampled_objects);
}

TEST_P(SeenDetection, RejectsNaN) {
  Random random(28);
  const CollisionHull hull(narrow_rig(random, 2), 1, {Limits::seen, 1});
  const collision::Bvh block(geometry::box_mesh({0.05, 0.05, 0.05}));
  EXPECT_THROW(detect(hull, block, kVerdictOnly, at({kNaN, 0, 0})), std::invalid_argument);
}

TEST(SeenBoxQuery, ACertifiedBoxHasNoHullPoint) {
  Random random(29);
  int certified = 0, by_seen_camera = 0;
  for (int scene = 0; scene < 20; ++scene) {
    const std::vector<hull::Silhouette> silhouettes = narrow_rig(random, 1 + scene % 4);
    for (int i = 0; i < 60; ++i) {
      const Vector3d center = random_in_ball(random, 0.25),
                     half = Vector3d::Constant(uniform(random, 0.005, 0.06));
      const Eigen::AlignedBox3d box(center - half, center + half);
      for (const int min_seen : {1, 2, 3}) {
        const HullRule rule{Limits::seen, min_seen};
        const bool free = collision::is_certainly_free(silhouettes, box, i % 3, rule);
        certified += free;
        by_seen_camera += free && min_seen == 1;
        if (!free) continue;
        for (int k = 0; k < 100; ++k) {
          const Vector3d p =
              center + half.x() * Vector3d{uniform(random, -1, 1), uniform(random, -1, 1),
                                           uniform(random, -1, 1)};
          ASSERT_FALSE(hull::in_hull(silhouettes, p, rule));
        }
      }
    }
  }
  EXPECT_GT(certified, 500);
  EXPECT_GT(by_seen_camera, 100);
}

// The oracle itself, against in_hull() at random points of triangles.
TEST(SeenTriangleReference, HoldsExactlyThePointsInTheHull) {
  Random random(30);
  int inside = 0;
  for (int scene = 0; scene < 12; ++scene) {
    const std::vector<hull::Silhouette> silhouettes = narrow_rig(random, 1 + scene % 4);
    for (const int min_seen : {0, 1, 2, 3}) {
      const HullRule rule{Limits::seen, min_seen};
      for (int i = 0; i < 10; ++i) {
        const collision::Triangle t = random_triangle(random, 0.1, 0.3);
        const auto polygons = collision::hull_on_triangle(silhouettes, t, rule);
        const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
        for (int k = 0; k < 40; ++k) {
          double a = uniform(random, 0, 1), b = uniform(random, 0, 1);
          if (a + b > 1) a = 1 - a, b = 1 - b;
          const Vector3d p = t[0] + a * (t[1] - t[0]) + b * (t[2] - t[0]);
          // The signed distance to the polygons' borders; a point near one is not tested.
          double deepest_m = -1;
          for (const auto& polygon : polygons) {
            double inside_m = 1e9, turn = 0;
            for (std::size_t n = 2; n < polygon.size(); ++n)
              turn += (polygon[n - 1] - polygon[0]).cross(polygon[n] - polygon[0]).dot(normal);
            for (std::size_t n = 0; n < polygon.size(); ++n) {
              const Vector3d edge = polygon[(n + 1) % polygon.size()] - polygon[n];
              if (edge.norm() < 1e-12) continue;
              const double side_m =
                  edge.cross(p - polygon[n]).dot(normal) / (edge.norm() * normal.norm());
              inside_m = std::min(inside_m, turn < 0 ? -side_m : side_m);
            }
            deepest_m = std::max(deepest_m, inside_m);
          }
          if (std::abs(deepest_m) < 1e-9) continue;
          const bool in_hull = hull::in_hull(silhouettes, p, rule);
          EXPECT_EQ(deepest_m > 0, in_hull) << scene << ' ' << min_seen << ' ' << i;
          inside += in_hull;
        }
      }
    }
  }
  EXPECT_GT(inside, 500);
}

}  // namespace
}  // namespace fivepipe::test
