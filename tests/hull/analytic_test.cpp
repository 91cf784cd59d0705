// Closed-form silhouettes, against sampled surface points and against each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/hull/oracle/analytic.h"
#include "tests/support/hull/scenes.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

Vector3d random_surface_point(test::Random& random, const Capsule& c) {
  const Vector3d on_axis = c.a_world_m + test::uniform(random, 0, 1) * (c.b_world_m - c.a_world_m);
  const Vector3d axis = (c.b_world_m - c.a_world_m).normalized();
  const Vector3d any = test::random_direction(random);
  const Vector3d across = (any - any.dot(axis) * axis).normalized();
  switch (int(test::uniform(random, 0, 3))) {
    case 0: return c.a_world_m + c.radius_m * any * (any.dot(axis) > 0 ? -1 : 1);
    case 1: return c.b_world_m + c.radius_m * any * (any.dot(axis) < 0 ? -1 : 1);
    default: return on_axis + c.radius_m * across;
  }
}

double distance_to_axis(const Capsule& c, const Vector3d& p) {
  const Vector3d ab = c.b_world_m - c.a_world_m;
  const double s = ab.squaredNorm() > 0
                       ? std::clamp((p - c.a_world_m).dot(ab) / ab.squaredNorm(), 0.0, 1.0)
                       : 0.0;
  return (p - c.a_world_m - s * ab).norm();
}

TEST(RayEntry, LiesOnTheSurfaceAndNothingBeforeItIsInside) {
  test::Random random(1);
  int hits = 0;
  for (int i = 0; i < 3000; ++i) {
    const Capsule c = test::random_object(random, 1)[0];
    const Vector3d origin = test::random_in_ball(random, 1),
                   target = test::random_in_ball(random, 0.2);
    const geometry::Ray ray{origin, (target - origin) * test::uniform(random, 0.3, 3)};
    const auto t = ray_entry(c, ray);
    if (!t) {
      for (int k = 0; k <= 200; ++k)
        EXPECT_GT(distance_to_axis(c, ray.origin_world_m + k * 0.05 * ray.direction_world),
                  c.radius_m * (1 - 1e-9));
      continue;
    }
    ++hits;
    if (*t == 0) {
      EXPECT_LE(distance_to_axis(c, ray.origin_world_m), c.radius_m * (1 + 1e-12));
      continue;
    }
    EXPECT_NEAR(distance_to_axis(c, ray.origin_world_m + *t * ray.direction_world), c.radius_m,
                1e-9);
    for (int k = 0; k < 50; ++k)
      EXPECT_GT(distance_to_axis(c, ray.origin_world_m + *t * k / 50 * ray.direction_world),
                c.radius_m * (1 - 1e-9));
  }
  EXPECT_GT(hits, 200);
}

TEST(RayEntry, OfASphereIsTheClosedForm) {
  const Capsule sphere{{0, 0, 5}, {0, 0, 5}, 2};
  EXPECT_DOUBLE_EQ(ray_entry(sphere, {{0, 0, 0}, {0, 0, 1}}).value(), 3);
  EXPECT_DOUBLE_EQ(ray_entry(sphere, {{0, 0, 0}, {0, 0, 2}}).value(),
                   1.5);  // the parameter, not the distance
  EXPECT_EQ(ray_entry(sphere, {{0, 0, 4}, {1, 0, 0}}), 0.0);
  EXPECT_FALSE(ray_entry(sphere, {{0, 0, 8}, {0, 0, 1}}));
  EXPECT_FALSE(ray_entry(sphere, {{0, 2.0001, 0}, {0, 0, 1}}));
}

TEST(TrueObjectPixels, TouchedHoldsEveryProjectedSurfacePoint) {
  for (int seed = 1; seed <= 100; ++seed) {
    test::Random random(seed);
    const auto object = test::random_object(random, 1 + seed % 3, 0.4);
    const geometry::Camera camera = test::random_camera(random, 131, 90, 0.9);
    const ObjectPixels touched = true_object_pixels(object, camera, PixelRule::touched);
    for (int i = 0; i < 2000; ++i) {
      const auto uv =
          geometry::project(camera, random_surface_point(random, object[i % object.size()]));
      if (!uv || !(uv->x() >= -0.5 && uv->y() >= -0.5 && uv->x() < 130.5 && uv->y() < 89.5))
        continue;
      ASSERT_TRUE(touched.contains_at(uv->x(), uv->y()))
          << "seed " << seed << ", " << uv->transpose();
    }
  }
}

TEST(TrueObjectPixels, CentreIsExactlyTheCentresInTheSilhouetteAndTouchedHoldsIt) {
  for (int seed = 1; seed <= 30; ++seed) {
    test::Random random(seed);
    const auto object = test::random_object(random, 2, 0.4);
    const geometry::Camera camera = test::random_camera(random, 131, 90, 0.9);
    const ObjectPixels centre = true_object_pixels(object, camera, PixelRule::center),
                       touched = true_object_pixels(object, camera, PixelRule::touched);
    for (int v = 0; v < 90; ++v)
      for (int u = 0; u < 131; ++u) {
        ASSERT_EQ(centre.contains(u, v), in_silhouette(object, camera, Eigen::Vector2d(u, v)))
            << seed << ": " << u << ", " << v;
        if (centre.contains(u, v)) {
          ASSERT_TRUE(touched.contains(u, v));
        }
      }
  }
}

// Each set pixel has a point of the silhouette. A grid of 33 x 33 points over the pixel finds it,
// unless the silhouette only grazes the pixel.
TEST(TrueObjectPixels, TouchedPixelsMeetTheSilhouette) {
  for (int seed = 4; seed <= 12; ++seed) {
    test::Random random(seed);
    const auto object = test::random_object(random, 2, 0.3);
    const geometry::Camera camera = test::random_camera(random, 131, 90, 0.9);
    const ObjectPixels touched = true_object_pixels(object, camera, PixelRule::touched);
    int set = 0, found = 0;
    for (int v = 0; v < 90; ++v)
      for (int u = 0; u < 131; ++u) {
        if (!touched.contains(u, v)) continue;
        ++set;
        bool meets = in_silhouette(object, camera, Eigen::Vector2d(u, v));
        for (int i = 0; i <= 32 && !meets; ++i)
          for (int j = 0; j <= 32 && !meets; ++j)
            meets = in_silhouette(object, camera,
                                  Eigen::Vector2d(u - 0.5 + i / 32.0, v - 0.5 + j / 32.0));
        found += meets;
      }
    EXPECT_GT(set, 50) << seed;
    EXPECT_GE(found,
              set - 3);  // the grid misses overlaps below 1/32 px: about 1 in 1000 border pixels
  }
}

// Capsules that cover no corner of any pixel: the pixels are those of their end points and of the
// segment between these.
TEST(TrueObjectPixels, ThreadsSetThePixelsOfTheirAxis) {
  const geometry::Camera camera{{64, 48, 50, 50, 31.3, 24.2}, Eigen::Isometry3d::Identity()};
  test::Random random(5);
  for (int i = 0; i < 30; ++i) {
    const auto random_point = [&](double z_m) {
      const double u_px = test::uniform(random, -5, 68), v_px = test::uniform(random, -5, 52);
      return Vector3d((u_px - 31.3) / 50 * z_m, (v_px - 24.2) / 50 * z_m, z_m);
    };
    const Vector3d a = random_point(1), b = random_point(i % 2 ? 1 : 3);
    const ObjectPixels touched =
        true_object_pixels(std::vector<Capsule>{{a, b, 1e-9}}, camera, PixelRule::touched);
    ObjectPixels near(64, 48), on(64, 48);  // within 0.01 px of the axis; certainly on it
    for (int k = 0; k <= 20'000; ++k) {
      const auto uv = geometry::project(camera, a + k / 20'000.0 * (b - a));
      for (const double du : {-1e-2, 1e-2})
        for (const double dv : {-1e-2, 1e-2})
          if (near.holds(uv->x() + du, uv->y() + dv))
            near.set(int(uv->x() + du + 0.5), int(uv->y() + dv + 0.5));
      if (on.holds(uv->x(), uv->y())) on.set(int(uv->x() + 0.5), int(uv->y() + 0.5));
    }
    for (int v = 0; v < 48; ++v)
      for (int u = 0; u < 64; ++u) {
        if (on.contains(u, v)) {
          ASSERT_TRUE(touched.contains(u, v)) << i << ": " << u << ", " << v;
        } else if (!near.contains(u, v)) {
          ASSERT_FALSE(touched.contains(u, v)) << i << ": " << u << ", " << v;
        }
      }
  }
}

TEST(TrueObjectPixels, SphereSmallerThanAPixelSetsItsPixel) {
  const geometry::Camera camera{geometry::pinhole_from_fov(100, 80, 0.8),
                                geometry::look_at({0, -1, 0}, {0, 0, 0})};
  test::Random random(6);
  for (int i = 0; i < 200; ++i) {
    const Vector3d p = test::random_in_ball(random, 0.2);
    const auto uv = geometry::project(camera, p);
    const ObjectPixels touched =
        true_object_pixels(std::vector<Capsule>{{p, p, 1e-7}}, camera, PixelRule::touched);
    EXPECT_TRUE(touched.contains_at(uv->x(), uv->y()));
    EXPECT_LE(touched.count(), 4u);
  }
}

TEST(TrueObjectPixels, AnImageWithoutPixelsStaysEmpty) {
  geometry::Camera camera{geometry::pinhole_from_fov(100, 80, 0.8),
                          geometry::look_at({0, -1, 0}, {0, 0, 0})};
  test::Random random(7);
  for (const auto& [width_px, height_px] : {std::pair{0, 80}, {100, 0}, {0, 0}}) {
    camera.pinhole.width_px = width_px;
    camera.pinhole.height_px = height_px;
    for (int i = 0; i < 200; ++i) {
      const Vector3d p = test::random_in_ball(random, 0.6);
      EXPECT_EQ(true_object_pixels(std::vector<Capsule>{{p, p, 0.2}}, camera, PixelRule::touched),
                ObjectPixels(width_px, height_px));
    }
  }
}

TEST(TrueObjectPixels, NothingBehindTheCameraIsSet) {
  const geometry::Camera camera{geometry::pinhole_from_fov(100, 80, 0.8),
                                Eigen::Isometry3d::Identity()};
  EXPECT_EQ(true_object_pixels(std::vector<Capsule>{{{0, 0, -1}, {0.3, 0, -2}, 0.2}}, camera,
                               PixelRule::touched)
                .count(),
            0u);
  EXPECT_EQ(true_object_pixels(std::vector<Capsule>{{{0, 0, -0.3}, {0, 0, -0.3}, 0.25}}, camera,
                               PixelRule::touched)
                .count(),
            0u);  // just behind the camera
  // Beside the camera and half in front of it, but outside the field of view.
  EXPECT_EQ(true_object_pixels(std::vector<Capsule>{{{-1, 0, 0}, {-1, 0, -2}, 0.2}}, camera,
                               PixelRule::touched)
                .count(),
            0u);
}

TEST(TrueObjectPixels, CapsuleFromBehindTheCameraIsSetInFrontOfIt) {
  const geometry::Camera camera{geometry::pinhole_from_fov(100, 80, 0.8),
                                Eigen::Isometry3d::Identity()};
  const std::vector<Capsule> object{{{0.3, 0, -1}, {0.1, 0, 1}, 0.05}};
  const ObjectPixels centre = true_object_pixels(object, camera, PixelRule::center);
  EXPECT_GT(centre.count(), 100u);
  for (int v = 0; v < 80; ++v)
    for (int u = 0; u < 100; ++u)
      ASSERT_EQ(centre.contains(u, v), in_silhouette(object, camera, Eigen::Vector2d(u, v)));
}

TEST(TrueObjectPixels, CameraInsideTheCapsuleSeesItEverywhere) {
  const geometry::Camera camera{geometry::pinhole_from_fov(100, 80, 0.8),
                                Eigen::Isometry3d::Identity()};
  for (const PixelRule rule : {PixelRule::center, PixelRule::touched})
    EXPECT_EQ(true_object_pixels(std::vector<Capsule>{{{0, 0, -1}, {0, 0, 1}, 0.05}}, camera, rule)
                  .count(),
              8000u);
}

// The camera at the origin is in the ball around the end b, or just outside of it.
TEST(TrueObjectPixels, OfACapsuleBehindTheCameraItsNearestPointDecides) {
  const geometry::Camera camera{geometry::pinhole_from_fov(100, 80, 0.8),
                                Eigen::Isometry3d::Identity()};
  for (const Vector3d& a : {Vector3d(0, 0, -0.1), Vector3d(0, 0, -0.6), Vector3d(0.3, 0.2, -3)})
    for (const PixelRule rule : {PixelRule::center, PixelRule::touched}) {
      const Vector3d b(0, 0, -0.1);
      const auto count = [&](double radius_m) {
        return true_object_pixels(std::vector<Capsule>{{a, b, radius_m}}, camera, rule).count();
      };
      EXPECT_EQ(count(0.11), 8000u) << a.transpose();
      EXPECT_EQ(count(0.09), 0u) << a.transpose();
      const std::vector<Capsule> reversed{{b, a, 0.11}};
      EXPECT_EQ(true_object_pixels(reversed, camera, rule).count(), 8000u) << a.transpose();
    }
  // The line through the axis passes through the camera, the capsule does not.
  EXPECT_EQ(true_object_pixels(std::vector<Capsule>{{{0, 0, -0.8}, {0, 0, -0.3}, 0.2}}, camera,
                               PixelRule::touched)
                .count(),
            0u);
}

TEST(TrueObjectPixels, EmptyImageOrNoObjectSetsNothing) {
  EXPECT_EQ(true_object_pixels(
                {}, {geometry::pinhole_from_fov(10, 8, 0.8), Eigen::Isometry3d::Identity()},
                PixelRule::touched)
                .count(),
            0u);
  for (const auto& [width, height] : {std::pair{0, 0}, {0, 5}, {5, 0}}) {
    const geometry::Camera none{{width, height, 100, 100, 0, 0}, Eigen::Isometry3d::Identity()};
    const ObjectPixels pixels = true_object_pixels(
        std::vector<Capsule>{{{0, 0, 1}, {0, 0, 1}, 0.1}}, none, PixelRule::touched);
    EXPECT_EQ(pixels, ObjectPixels(width, height));
  }
}

TEST(AnalyticHull, ContainsTheObjectAndLiesInTheTouchedHull) {
  for (int seed = 1; seed <= 10; ++seed) {
    test::Random random(seed);
    const auto object = test::random_object(random, 3, 0.15);
    const auto cameras = test::random_cameras(random, 4);
    const auto silhouettes = test::silhouettes_of(object, cameras);
    for (int i = 0; i < 2000; ++i) {
      const Vector3d p = test::random_in_ball(random, 0.3);
      const bool in_object = std::any_of(object.begin(), object.end(), [&](const Capsule& c) {
        return distance_to_axis(c, p) < c.radius_m;
      });
      const bool in_every_image =
          std::all_of(cameras.begin(), cameras.end(), [&](const geometry::Camera& c) {
            const auto uv = geometry::project(c, p);
            return uv && uv->x() > -0.5 && uv->y() > -0.5 && uv->x() < c.pinhole.width_px - 0.5 &&
                   uv->y() < c.pinhole.height_px - 0.5;
          });
      if (in_object && in_every_image) {
        EXPECT_TRUE(in_analytic_hull(object, cameras, p));
      }
      if (in_analytic_hull(object, cameras, p)) {
        EXPECT_TRUE(in_hull(silhouettes, p));
      }
    }
  }
}

// A ball in front of a whole image of 20 x 10 pixels: only the image limits the hull.
TEST(AnalyticHull, EndsAtTheHalfOpenBordersOfTheImages) {
  const std::vector<geometry::Camera> cameras{
      {{20, 10, 16, 16, 4, 2}, Eigen::Isometry3d::Identity()}};
  const std::vector<Capsule> ball{{{0, 0, 2}, {0, 0, 2}, 50}};
  const auto inside = [&](double u_px, double v_px) {  // exact in binary
    return in_analytic_hull(ball, cameras, {(u_px - 4) / 16, (v_px - 2) / 16, 1});
  };
  const double tiny = 1.0 / (1 << 20);
  EXPECT_TRUE(inside(-0.5, -0.5) && inside(19.5 - tiny, 9.5 - tiny));
  EXPECT_FALSE(inside(-0.5 - tiny, 3) || inside(19.5, 3));
  EXPECT_FALSE(inside(3, -0.5 - tiny) || inside(3, 9.5));
  EXPECT_FALSE(in_analytic_hull(ball, cameras, {0, 0, -1}));
  EXPECT_FALSE(in_analytic_hull(ball, {}, {0, 0, 1}));
  EXPECT_FALSE(in_analytic_hull({}, cameras, {0, 0, 1}));
}

// The entry is the first of all that the side and the two balls have.
TEST(RayEntry, OfACapsuleIsTheClosedForm) {
  const Capsule along_x{{-1, 0, 0}, {1, 0, 0}, 0.5};
  const auto entry = [&](const Vector3d& from, const Vector3d& direction) {
    return ray_entry(along_x, {from, direction}).value_or(-1);
  };
  EXPECT_DOUBLE_EQ(entry({0, -3, 0}, {0, 1, 0}), 2.5);    // the side
  EXPECT_DOUBLE_EQ(entry({0, -3, 0.3}, {0, 2, 0}), 1.3);  // 3 - sqrt(0.5^2 - 0.3^2), at speed 2
  EXPECT_DOUBLE_EQ(entry({-4, 0, 0}, {1, 0, 0}), 2.5);    // the axis, from both sides
  EXPECT_DOUBLE_EQ(entry({4, 0, 0}, {-1, 0, 0}), 2.5);
  EXPECT_DOUBLE_EQ(entry({-4, 0.3, 0}, {1, 0, 0}), 2.6);  // parallel to the axis
  EXPECT_DOUBLE_EQ(entry({1.3, -3, 0}, {0, 1, 0}), 2.6);  // beyond the ends of the side
  EXPECT_DOUBLE_EQ(entry({-1.3, -3, 0}, {0, 1, 0}), 2.6);
  EXPECT_EQ(entry({0, -3, 0}, {0, -1, 0}), -1);  // away from it
  EXPECT_EQ(entry({1.6, -3, 0}, {0, 1, 0}), -1);
  EXPECT_EQ(entry({0, -3, 0.6}, {0, 1, 0}), -1);
  EXPECT_EQ(entry({-4, 0.6, 0}, {1, 0, 0}), -1);
  EXPECT_EQ(entry({0.9, 0.4, 0.1}, {1, 0, 0}), 0);  // inside
  EXPECT_EQ(entry({1.3, 0.3, 0.2}, {1, 0, 0}), 0);
}

TEST(AnalyticHull, NotANumberIsNotInside) {
  const std::vector<geometry::Camera> cameras{
      {geometry::pinhole_from_fov(10, 8, 0.8), Eigen::Isometry3d::Identity()}};
  const std::vector<Capsule> object{{{0, 0, 0}, {0, 0, 0}, 5}};
  EXPECT_TRUE(in_analytic_hull(object, cameras, {0, 0, 1}));
  EXPECT_FALSE(in_analytic_hull(object, cameras, {NAN, 0, 1}));
  EXPECT_FALSE(in_analytic_hull(object, cameras, {0, 0, NAN}));
}

}  // namespace
}  // namespace fivepipe::hull
