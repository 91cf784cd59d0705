// Limiting cameras and normals of a view's surface, on discs, planes and hard cases; and the fit of
// the contour with its errors.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "common/hull/silhouette/contour.h"
#include "common/hull/silhouette/hull_surface.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/hull/test_pool.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

struct Scene {
  CpuHull hull;
  HullQuery query;
  Scene(std::span<const Silhouette> silhouettes, const HullRule& rule = {})
      : hull(test_pool(), silhouettes, rule), query(hull) {}
  HullSurface surface(const View& view) {
    return hull_surface(query, view, hull.depth(view, test::whole_image(view.camera)));
  }
};

ObjectPixels disc(double radius_px, const Vector2d& centre_px, int size_px) {
  ObjectPixels pixels(size_px, size_px);
  for (int v = 0; v < size_px; ++v)
    for (int u = 0; u < size_px; ++u)
      if ((Vector2d(u, v) - centre_px).norm() <= radius_px) pixels.set(u, v);
  return pixels;
}

// Angles [degrees] between the contour's normal and the disc's, at a random position on each pixel
// edge of discs with random centres.
std::vector<double> normal_errors_deg(double radius_px, int discs) {
  test::Random random(5);
  std::vector<double> errors;
  for (int i = 0; i < discs; ++i) {
    const Vector2d centre{40 + test::uniform(random, 0, 1), 40 + test::uniform(random, 0, 1)};
    SkipMap skip_map;
    skip_map.assign(disc(radius_px, centre, 80));
    test::make_all(skip_map);
    const ContourMap map{&skip_map, {0, 0, 80, 80}, Kept::object};
    for (int v = 0; v < 80; ++v)
      for (int u = 0; u < 80; ++u)
        for (const auto& [du, dv] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
          if (!map.keeps(u, v) || map.keeps(u + du, v + dv)) continue;
          const Vector2d uv = Vector2d(u + 0.5 * du, v + 0.5 * dv) +
                              test::uniform(random, -0.5, 0.5) * Vector2d(dv, du);
          const Vector2d normal = contour_fit(map, {{u, v}, {du, dv}}, uv).normal,
                         truth = (uv - centre).normalized();
          EXPECT_NEAR(normal.norm(), 1, 1e-12);
          errors.push_back(std::acos(std::clamp(normal.dot(truth), -1.0, 1.0)) / kDegree);
        }
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

TEST(Contour, NormalsOfDiscsWithinTheStatedError) {
  for (const auto& [radius_px, max_median_deg, max_p95_deg] :
       {std::tuple{20.0, 0.4, 1.2}, {3.0, 3.0, 8.0}}) {
    const auto errors = normal_errors_deg(radius_px, 200);
    const double median = errors[errors.size() / 2], p95 = errors[errors.size() * 95 / 100];
    std::cout << "radius " << radius_px << " px: median " << median << " deg, p95 " << p95
              << " deg, worst " << errors.back() << " deg, edges " << errors.size() << "\n";
    EXPECT_LT(median, max_median_deg);
    EXPECT_LT(p95, max_p95_deg);
  }
}

// Contours with fewer edges than the window of the fit: the window must not run around them.
TEST(Contour, NormalsOfDiscsSmallerThanTheWindow) {
  for (const auto& [radius_px, max_median_deg, max_worst_deg] :
       {std::tuple{1.5, 10.0, 70.0}, {2.0, 6.0, 60.0}, {2.5, 4.0, 45.0}, {3.5, 3.0, 45.0}}) {
    const auto errors = normal_errors_deg(radius_px, 400);
    EXPECT_LT(errors[errors.size() / 2], max_median_deg) << radius_px;
    EXPECT_LT(errors.back(), max_worst_deg) << radius_px;
  }
}

TEST(Contour, NormalsOfStraightBordersAreExact) {
  SkipMap skip_map;
  ObjectPixels half(64, 64);
  for (int v = 0; v < 64; ++v)
    for (int u = 30; u < 64; ++u) half.set(u, v);
  skip_map.assign(half);
  test::make_all(skip_map);
  const ContourMap map{&skip_map, {0, 0, 64, 64}, Kept::object};
  EXPECT_LT((contour_fit(map, {{30, 32}, {-1, 0}}, {29.5, 32.2}).normal - Vector2d(-1, 0)).norm(),
            1e-12);
  EXPECT_LT((contour_fit(map, {{63, 32}, {1, 0}}, {63.5, 32.2}).normal - Vector2d(1, 0)).norm(),
            1e-12);  // cut off by the image border
  ObjectPixels diagonal(64, 64);
  for (int v = 0; v < 64; ++v)
    for (int u = 0; u <= v; ++u) diagonal.set(u, v);
  skip_map.assign(diagonal);
  test::make_all(skip_map);
  EXPECT_LT(
      (contour_fit({&skip_map, {0, 0, 64, 64}, Kept::object}, {{32, 32}, {1, 0}}, {32.5, 32.0})
           .normal -
       Vector2d(1, -1).normalized())
          .norm(),
      0.02);
}

TEST(Contour, NormalsOfOnePixelAndOfNoiseAreUnit) {
  test::Random random(2);
  for (const double fraction : {0.001, 0.1, 0.5, 0.9}) {
    const ObjectPixels pixels = test::random_pixels(random, 70, 50, fraction);
    SkipMap skip_map;
    skip_map.assign(pixels);
    test::make_all(skip_map);
    for (const Kept kept : {Kept::object, Kept::not_empty}) {
      const ContourMap map{&skip_map, {0, 0, 70, 50}, kept};
      for (int v = -1; v <= 50; ++v)
        for (int u = -1; u <= 70; ++u)
          for (const auto& [du, dv] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
            if (map.keeps(u, v) && !map.keeps(u + du, v + dv)) {
              EXPECT_NEAR(
                  contour_fit(map, {{u, v}, {du, dv}}, {u + 0.5 * du, v + 0.5 * dv}).normal.norm(),
                  1, 1e-12);
            }
    }
  }
}

// Normals of a ball's hull are those of the true cone at the point's pixel.
TEST(HullSurface, NormalsOfABallAreThoseOfItsCone) {
  const std::vector<Capsule> ball{{{0, 0, 0}, {0, 0, 0}, 0.1}};
  std::vector<geometry::Camera> cameras;
  for (const double angle : {0.3, 1.5, 2.9, 4.4})
    cameras.push_back(
        {geometry::pinhole_from_fov(400, 400, 0.4),
         geometry::look_at(1.5 * Vector3d(std::cos(angle), std::sin(angle), 0.5), {0, 0, 0})});
  const auto silhouettes = test::silhouettes_of(ball, cameras, PixelRule::center);
  Scene scene(silhouettes);
  const View view{
      {geometry::pinhole_from_fov(160, 120, 0.3), geometry::look_at({0.2, -1, 0.3}, {0, 0, 0})},
      0.05,
      4.0};
  const DepthTile tile = scene.hull.depth(view, test::whole_image(view.camera));
  const HullSurface surface = hull_surface(scene.query, view, tile);
  std::vector<double> errors_deg;
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
    EXPECT_EQ(surface.limiting_camera[i] == kNoSurface, tile.depth_m[i] == kNoHull);
    if (tile.depth_m[i] == kNoHull) continue;
    ASSERT_GE(surface.limiting_camera[i], 0);
    const geometry::Camera& camera = cameras[std::size_t(surface.limiting_camera[i])];
    const geometry::Ray ray =
        geometry::ray_through(view.camera, {double(i % 160), double(i / 160)});
    const Vector3d p = ray.origin_world_m + tile.depth_m[i] * ray.direction_world,
                   eye = geometry::camera_center_world_m(camera);
    // A cone's normal is in the plane of its axis and the point, perpendicular to the line of
    // sight.
    const Vector3d sight = (p - eye).normalized(),
                   away = p - (p.dot(eye) / eye.squaredNorm()) * eye;
    const Vector3d truth = (away - away.dot(sight) * sight).normalized();
    const Vector3d n = surface.normal_world[i].cast<double>();
    EXPECT_NEAR(n.norm(), 1, 1e-6);
    EXPECT_LE(n.dot(ray.direction_world), 1e-6);
    errors_deg.push_back(std::acos(std::clamp(n.dot(truth), -1.0, 1.0)) / kDegree);
  }
  std::sort(errors_deg.begin(), errors_deg.end());
  ASSERT_GT(errors_deg.size(), 3000u);
  EXPECT_LT(errors_deg[errors_deg.size() / 2], 0.5);  // silhouettes of radius 65 px
  EXPECT_LT(errors_deg[errors_deg.size() * 95 / 100], 2.0);
}

// The limiting camera sees the surface point on the border of its silhouette: background just
// before it and object just after.
TEST(HullSurface, LimitingCameraIsTheLastSilhouetteEntered) {
  int hits = 0;
  for (int seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    const auto silhouettes = test::silhouettes_of(
        {test::random_cameras(random, 2 + seed % 4), test::random_object(random, 3)});
    Scene scene(silhouettes);
    const View view{test::random_camera(random, 64, 48, 0.8), 0.05, 5.0};
    const HullSurface surface = scene.surface(view);
    for (int i = 0; i < 64 * 48; ++i) {
      const int camera = surface.limiting_camera[std::size_t(i)];
      if (camera < 0) continue;
      const geometry::Ray ray = geometry::ray_through(view.camera, Vector2d(i % 64, i / 64));
      const double entry = scene.query.first_entry(ray, view.near_m, view.far_m).value();
      const auto one = std::span(silhouettes).subspan(std::size_t(camera), 1);
      const Vector3d p = ray.origin_world_m + entry * ray.direction_world,
                     eye = geometry::camera_center_world_m(one.front().camera);
      EXPECT_FALSE(in_hull(one, p - 1e-9 * ray.direction_world));
      const Vector3d normal = surface.normal_world[std::size_t(i)].cast<double>();
      if (normal.dot(ray.direction_world) < -1e-6) {
        EXPECT_NEAR(normal.dot(p - eye), 0, 1e-6);
      }  // the plane contains the camera, unless hull_surface() turned the normal to the eye
      ++hits;
    }
  }
  EXPECT_GT(hits, 2000);
}

TEST(HullSurface, CorrectsAnInexactDepth) {
  test::Random random(4);
  Scene scene(
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3)}));
  const View view{test::random_camera(random, 64, 48, 0.8), 0.05, 5.0};
  DepthTile tile = scene.hull.depth(view, test::whole_image(view.camera));
  const HullSurface expected = hull_surface(scene.query, view, tile);
  for (float& depth_m : tile.depth_m) depth_m *= 1.0005f;  // inside the hull, or behind it
  const HullSurface found = hull_surface(scene.query, view, tile);
  EXPECT_EQ(found.limiting_camera, expected.limiting_camera);
  EXPECT_EQ(found.normal_world, expected.normal_world);
}

TEST(HullSurface, CameraOrderChangesOnlyTheIndices) {
  for (int seed = 1; seed <= 6; ++seed) {
    test::Random random(seed);
    auto silhouettes =
        test::silhouettes_of({test::random_cameras(random, 4), test::random_object(random, 3)});
    const View view{test::random_camera(random, 64, 48, 0.8), 0.05, 5.0};
    for (const HullRule& rule : {HullRule{}, HullRule{Limits::seen, 2}}) {
      const HullSurface a = Scene(silhouettes, rule).surface(view);
      std::reverse(silhouettes.begin(), silhouettes.end());
      const HullSurface b = Scene(silhouettes, rule).surface(view);
      for (std::size_t i = 0; i < a.limiting_camera.size(); ++i) {
        EXPECT_EQ(a.normal_world[i], b.normal_world[i]);
        EXPECT_EQ(a.limiting_camera[i],
                  b.limiting_camera[i] < 0 ? b.limiting_camera[i] : 3 - b.limiting_camera[i]);
      }
    }
  }
}

// Every pixel is an object pixel, so the hull is the space in which enough images overlap.
TEST(HullSurface, LimitsSeenImageBorderLimitsTheHull) {
  test::Random random(3);
  std::vector<Silhouette> silhouettes;
  for (const geometry::Camera& camera : test::random_cameras(random, 3, 40, 30)) {
    ObjectPixels all(40, 30);
    for (int v = 0; v < 30; ++v)
      for (int u = 0; u < 40; ++u) all.set(u, v);
    silhouettes.push_back({camera, all});
  }
  Scene scene(silhouettes, {Limits::seen, 2});
  const View view{
      {geometry::pinhole_from_fov(64, 48, 0.9), geometry::look_at({0, -4, 0.4}, {0, 0, 0})},
      0.05,
      10.0};
  const DepthTile tile = scene.hull.depth(view, test::whole_image(view.camera));
  const HullSurface surface = hull_surface(scene.query, view, tile);
  int limited = 0;
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
    EXPECT_EQ(tile.depth_m[i] == kNoHull, surface.limiting_camera[i] == kNoSurface);
    if (surface.limiting_camera[i] < 0) continue;
    ++limited;
    EXPECT_NEAR(surface.normal_world[i].norm(), 1, 1e-5);
  }
  EXPECT_GT(limited, 100);
}

// The first camera has no object pixel, so its image is carved out of the others' hull.
TEST(HullSurface, LimitsSeenHullMayBeginAtAnImageBorder) {
  std::vector<Silhouette> silhouettes;
  for (const Vector3d& eye : {Vector3d(0.2, -2, 0.1), Vector3d(2, 0, 0), Vector3d(0, 2, 0)}) {
    silhouettes.push_back({{geometry::pinhole_from_fov(100, 75, eye.y() < 0 ? 0.1 : 0.5),
                            geometry::look_at(eye, {0, 0, 0})},
                           ObjectPixels(100, 75)});
    for (int v = 0; v < 75 && eye.y() >= 0; ++v)
      for (int u = 0; u < 100; ++u) silhouettes.back().pixels.set(u, v);
  }
  Scene scene(silhouettes, {Limits::seen, 2});
  const View view{{geometry::pinhole_from_fov(64, 48, 0.4),
                   geometry::look_at({0.03, -0.3, 0.015}, {1, -0.25, 0.05})},
                  0.01,
                  10.0};  // the eye is in that image
  const DepthTile tile = scene.hull.depth(view, test::whole_image(view.camera));
  const HullSurface surface = hull_surface(scene.query, view, tile);
  int by_the_first = 0;
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
    EXPECT_EQ(tile.depth_m[i] == kNoHull, surface.limiting_camera[i] == kNoSurface);
    if (surface.limiting_camera[i] != 0) continue;
    ++by_the_first;
    const geometry::Ray ray = geometry::ray_through(view.camera, Vector2d(i % 64, i / 64));
    const Vector3d normal = surface.normal_world[i].cast<double>(),
                   p = ray.origin_world_m + double(tile.depth_m[i]) * ray.direction_world;
    if (normal.dot(ray.direction_world) < -1e-6) {
      EXPECT_NEAR(normal.dot(p - geometry::camera_center_world_m(silhouettes[0].camera)), 0, 1e-5);
    }
  }
  EXPECT_GT(by_the_first, 20);
}

// The tile's depths have no effect.
TEST(HullSurface, NoViewAndNoCameraHaveNoSurface) {
  test::Random random(4);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3)});
  Scene scene(silhouettes), no_camera(std::vector<Silhouette>{});
  const View view{test::random_camera(random, 32, 24, 0.8), 0.05, 5.0};
  const DepthTile tile = scene.hull.depth(view, test::whole_image(view.camera));
  const auto with_surface = [&](Scene& of, const View& from) {
    const HullSurface surface = hull_surface(of.query, from, tile);
    for (const Eigen::Vector3f& normal : surface.normal_world) EXPECT_LT(normal.norm(), 1 + 1e-6f);
    return std::count_if(surface.limiting_camera.begin(), surface.limiting_camera.end(),
                         [](int camera) { return camera != kNoSurface; });
  };
  ASSERT_GT(with_surface(scene, view), 30);
  EXPECT_EQ(with_surface(no_camera, view), 0);
  for (const auto& [near_m, far_m] : {std::pair{0.0, 5.0},
                                      {-1.0, 5.0},
                                      {test::kNaN, 5.0},
                                      {0.05, test::kNaN},
                                      {0.05, test::kInfinity},
                                      {5.0, 0.05},
                                      {5.0, 5.0}})
    EXPECT_EQ(with_surface(scene, {view.camera, near_m, far_m}), 0) << near_m << ", " << far_m;
  View not_finite = view;
  not_finite.camera.pinhole.cy_px = test::kNaN;
  EXPECT_EQ(with_surface(scene, not_finite), 0);
}

// Two marks and the index of a camera, in one view: the near plane cuts a ball's hull.
TEST(HullSurface, MarksAreNeitherEqualNorIndices) {
  const std::vector<Capsule> ball{{{0, 0, 0}, {0, 0, 0}, 0.1}};
  std::vector<geometry::Camera> cameras;
  for (const double angle : {0.3, 1.5, 2.9})
    cameras.push_back(
        {geometry::pinhole_from_fov(100, 100, 0.4),
         geometry::look_at(1.5 * Vector3d(std::cos(angle), std::sin(angle), 0.5), {0, 0, 0})});
  Scene scene(test::silhouettes_of(ball, cameras));
  const View view{
      {geometry::pinhole_from_fov(64, 64, 0.3), geometry::look_at({0.2, -1, 0.3}, {0, 0, 0})},
      1.02,
      4.0};
  const DepthTile tile = scene.hull.depth(view, test::whole_image(view.camera));
  const HullSurface surface = hull_surface(scene.query, view, tile);
  int missed = 0, cut = 0, entered = 0;
  for (std::size_t i = 0; i < tile.depth_m.size(); ++i) {
    const int camera = surface.limiting_camera[i];
    if (tile.depth_m[i] == kNoHull) {
      ASSERT_EQ(camera, kNoSurface);
      ++missed;
    } else if (tile.depth_m[i] == float(view.near_m)) {
      ASSERT_EQ(camera, kNearPlane);
      ++cut;
    } else {
      ASSERT_TRUE(camera >= 0 && camera < 3);
      ++entered;
    }
  }
  EXPECT_GT(missed, 100);
  EXPECT_GT(cut, 100);
  EXPECT_GT(entered, 100);
  EXPECT_TRUE(kNoSurface < 0 && kNearPlane < 0 && kNoSurface != kNearPlane);
}

TEST(HullSurface, NearPlaneInsideTheHullAndNoHullAreMarked) {
  std::vector<Silhouette> silhouettes;
  for (const Vector3d& eye : {Vector3d(2, 0, 0), Vector3d(0, 2, 0)}) {
    silhouettes.push_back(
        {{geometry::pinhole_from_fov(100, 75, 0.5), geometry::look_at(eye, {0, 0, 0})},
         ObjectPixels(100, 75)});
    for (int v = 10; v < 70; ++v)
      for (int u = 10; u < 90; ++u) silhouettes.back().pixels.set(u, v);
  }
  Scene scene(silhouettes);
  const View view{
      {geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({0.01, 0, 0.02}, {1, 1, 0})},
      0.05,
      10.0};
  const HullSurface inside = scene.surface(view);
  for (std::size_t i = 0; i < inside.limiting_camera.size(); ++i) {
    EXPECT_EQ(inside.limiting_camera[i], kNearPlane);
    EXPECT_LT((inside.normal_world[i].cast<double>() +
               view.camera.camera_from_world.linear().row(2).transpose())
                  .norm(),
              1e-6);
  }
  silhouettes[1].pixels = ObjectPixels(100, 75);
  const HullSurface none = Scene(silhouettes).surface(view);
  EXPECT_TRUE(std::all_of(none.limiting_camera.begin(), none.limiting_camera.end(),
                          [](int c) { return c == kNoSurface; }));
  DepthTile nonsense{
      {0, 0, 2, 1},
      {std::numeric_limits<float>::quiet_NaN(), 3.0f}};  // these depths are not of this hull
  EXPECT_EQ(hull_surface(
                scene.query,
                {{geometry::pinhole_from_fov(64, 48, 0.5), geometry::look_at({5, 5, 5}, {9, 9, 9})},
                 0.05,
                 10},
                nonsense)
                .limiting_camera,
            (std::vector<int>{kNoSurface, kNoSurface}));
}

}  // namespace
}  // namespace fivepipe::hull
