// Distances to the borders of maps, and to the hull's surface, against brute force and balls.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/hull/silhouette/hull_distance.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The definition of BorderDistance::at() at a pixel's centre. `around`: pixels outside the image
// that are searched too.
double distance_by_definition_px(const ObjectPixels& pixels, int u_px, int v_px) {
  const bool is_object = pixels.contains(u_px, v_px);
  constexpr int kAround_px = kMaxInside_px + 1;
  double nearest_px = kAround_px;
  for (int dv = -kAround_px; dv <= kAround_px; ++dv)
    for (int du = -kAround_px; du <= kAround_px; ++du)
      if (pixels.contains(u_px + du, v_px + dv) != is_object)
        nearest_px = std::min(nearest_px, std::hypot(du, dv));
  return is_object ? nearest_px - 0.5 : 0.5 - nearest_px;
}

TEST(BorderDistance, IsThatOfTheDefinitionOnRandomMaps) {
  test::Random random(3);
  for (const double fraction : {0.02, 0.5, 0.98}) {
    const ObjectPixels pixels = test::random_pixels(random, 70, 41, fraction);
    const BorderDistance distance(pixels);
    for (int v = -12; v < 53; ++v)
      for (int u = -12; u < 82; ++u) {
        const double expected_px = distance_by_definition_px(pixels, u, v);
        const auto found = distance.at({double(u), double(v)});
        if (expected_px >= -kMaxOutside_px && found)
          EXPECT_NEAR(*found, std::min(expected_px, kMaxInside_px - 0.5), 1e-6) << u << " " << v;
        else
          EXPECT_FALSE(found && *found > -kMaxOutside_px) << u << " " << v;
      }
  }
}

TEST(BorderDistance, IsBoundedInTheMiddleOfALargeObject) {
  ObjectPixels pixels(200, 200);
  for (int v = 40; v < 160; ++v) pixels.set_run(40, 160, v);
  const BorderDistance distance(pixels);
  EXPECT_EQ(distance.at({100, 100}), kMaxInside_px - 0.5);
  EXPECT_EQ(distance.at({45, 100}), 5.5);
  EXPECT_EQ(distance.at({39, 100}), -0.5);
  EXPECT_DOUBLE_EQ(distance.at({39.5, 100}).value(), 0);
  EXPECT_LT((distance.gradient({45, 100}) - Vector2d(1, 0)).norm(), 1e-6);
  EXPECT_EQ(distance.gradient({100, 100}), Vector2d(0, 0));
}

// A pixel outside the image is no object pixel, so the image's edge is a border.
TEST(BorderDistance, AnObjectAtTheImagesEdgeEndsThere) {
  ObjectPixels pixels(20, 20);
  for (int v = 0; v < 20; ++v) pixels.set_run(0, 20, v);
  const BorderDistance distance(pixels);
  EXPECT_EQ(distance.at({0, 10}), 0.5);
  EXPECT_EQ(distance.at({-1, 10}), -0.5);
}

TEST(BorderDistance, IsUndefinedFarOutsideAndForAnEmptyMap) {
  ObjectPixels pixels(50, 50);
  pixels.set(25, 25);
  const BorderDistance distance(pixels);
  EXPECT_TRUE(distance.at({25.0 + kMaxOutside_px, 25}));
  EXPECT_FALSE(distance.at({25.0 + kMaxOutside_px + 2, 25}));
  for (const double bad : {test::kNaN, test::kInfinity, -test::kInfinity}) {
    EXPECT_FALSE(distance.at({bad, 25}));
    EXPECT_FALSE(distance.at({25, bad}));
  }
  EXPECT_FALSE(BorderDistance(ObjectPixels(50, 50)).at({25, 25}));
  EXPECT_FALSE(BorderDistance().at({0, 0}));
}

std::vector<geometry::Camera> ring_of(int count) {
  std::vector<geometry::Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.3) / count;
    cameras.push_back(
        {geometry::pinhole_from_fov(300, 280, 0.4),
         geometry::look_at({1.5 * std::cos(angle), 1.5 * std::sin(angle), i % 2 ? 0.5 : -0.4},
                           Vector3d::Zero())});
  }
  return cameras;
}

struct Errors {
  std::vector<double> distance_m, normal_deg;
};

// At points up to 3 mm in front of the hull of a ball, against the planes that touch the ball
// through the centre of the camera that limits the hull most.
Errors errors_on_ball(double radius_m) {
  const std::vector<geometry::Camera> cameras = ring_of(6);
  test::Random random(7);
  Errors errors;
  for (int i = 0; i < 400; ++i) {
    const Vector3d center_m = test::random_in_ball(random, 0.02);
    const std::vector<Capsule> ball = {{center_m, center_m, radius_m}};
    const HullDistance distance(test::silhouettes_of(ball, cameras, PixelRule::center));
    const Vector3d p_m = center_m + test::random_vector(random, radius_m, radius_m + 0.003);
    // The tangent cone of a camera: the angle between axis and ray less that of the cone.
    double nearest_m = -1;
    Vector3d normal = Vector3d::Zero();
    for (const geometry::Camera& camera : cameras) {
      const Vector3d eye_m = geometry::camera_center_world_m(camera),
                     axis = (center_m - eye_m).normalized(), to_p_m = p_m - eye_m;
      const double cone_rad = std::asin(radius_m / (center_m - eye_m).norm());
      const Vector3d across = (to_p_m - axis.dot(to_p_m) * axis).normalized(),
                     plane = std::cos(cone_rad) * across - std::sin(cone_rad) * axis;
      if (plane.dot(to_p_m) > nearest_m) nearest_m = plane.dot(to_p_m), normal = plane;
    }
    const auto surface = distance.near(p_m, 0.006);
    if (!surface) {
      ADD_FAILURE() << "no surface at " << p_m.transpose();
      continue;
    }
    errors.distance_m.push_back(std::abs(surface->distance_m - nearest_m));
    errors.normal_deg.push_back(std::acos(std::min(1.0, surface->normal_world.dot(normal))) * 180 /
                                std::numbers::pi);
  }
  std::sort(errors.distance_m.begin(), errors.distance_m.end());
  std::sort(errors.normal_deg.begin(), errors.normal_deg.end());
  return errors;
}

// A pixel is 2 mm. At an edge of the hull, where two planes are equally near, either may be found.
TEST(HullDistance, IsThatToTheTangentPlanesOfABall) {
  for (const double radius_m : {0.02, 0.05}) {
    const Errors errors = errors_on_ball(radius_m);
    const std::size_t half = errors.normal_deg.size() / 2, most = errors.normal_deg.size() * 9 / 10;
    std::printf(
        "ball of %.0f mm (%.0f px): distance to %.2f mm (p90 %.2f), normal to %.1f degrees (p90 "
        "%.1f)\n",
        1e3 * radius_m, radius_m / 0.002, 1e3 * errors.distance_m[half],
        1e3 * errors.distance_m[most], errors.normal_deg[half], errors.normal_deg[most]);
    EXPECT_LT(errors.distance_m[half], 0.0005);
    EXPECT_LT(errors.distance_m[most], 0.002);
    EXPECT_LT(errors.normal_deg[half], 7);
    EXPECT_LT(errors.normal_deg[most], 20);
  }
}

TEST(HullDistance, DoesNotDependOnTheOrderOfTheCameras) {
  const std::vector<Capsule> arm = {{{-0.1, 0, 0}, {0.1, 0.02, 0.03}, 0.03}};
  std::vector<Silhouette> silhouettes = test::silhouettes_of(arm, ring_of(5));
  const HullDistance first(silhouettes);
  std::reverse(silhouettes.begin(), silhouettes.end());
  const HullDistance second(silhouettes);
  test::Random random(11);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p_m = test::random_in_ball(random, 0.12);
    const auto a = first.near(p_m, 0.005), b = second.near(p_m, 0.005);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    ++found;
    EXPECT_EQ(a->distance_m, b->distance_m);
    EXPECT_EQ(a->normal_world, b->normal_world);
  }
  EXPECT_GT(found, 200);
}

TEST(HullDistance, HasNoSurfaceBehindACameraFarAwayOrWithoutAHull) {
  const std::vector<geometry::Camera> cameras = ring_of(4);
  std::vector<Silhouette> silhouettes =
      test::silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.05}}, cameras);
  const HullDistance distance(silhouettes);
  EXPECT_TRUE(distance.near({0.05, 0, 0}, 0.005));
  EXPECT_FALSE(distance.near({0.08, 0, 0}, 0.005));
  EXPECT_FALSE(distance.near(2 * geometry::camera_center_world_m(cameras[0]), 1));
  for (const double bad : {test::kNaN, test::kInfinity, -test::kInfinity})
    EXPECT_FALSE(distance.near({0.05, bad, 0}, 0.005));
  silhouettes[2].pixels = ObjectPixels(300, 280);
  EXPECT_FALSE(HullDistance(silhouettes).near({0.05, 0, 0}, 0.005));
  EXPECT_FALSE(HullDistance({}).near({0.05, 0, 0}, 0.005));
}

// At a point that enough cameras see, the hull is that of these cameras.
TEST(HullDistance, OnlyTheCamerasThatSeeThePointLimitTheHullIfTheRuleSaysSo) {
  int found = 0, refused = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    test::Random random(seed);
    std::vector<Silhouette> silhouettes = test::silhouettes_of(
        {test::narrow_cameras(random, 5, 80, 61), test::random_object(random, 3)});
    silhouettes[4].pixels = ObjectPixels(80, 61);  // sees no object
    const HullDistance distance(silhouettes, {Limits::seen, 2});
    for (int i = 0; i < 1500; ++i) {
      const Vector3d p_m = test::random_in_ball(random, 0.3);
      std::vector<Silhouette> seeing;
      for (const Silhouette& silhouette : silhouettes)
        if (const auto uv_px = geometry::project(silhouette.camera, p_m);
            uv_px && silhouette.pixels.holds(uv_px->x(), uv_px->y()))
          seeing.push_back(silhouette);
      const auto surface = distance.near(p_m, 0.006);
      refused += seeing.size() == 1 && HullDistance(seeing).near(p_m, 0.006);
      if (seeing.size() < 2) {
        EXPECT_FALSE(surface);
        continue;
      }
      const auto expected = HullDistance(seeing).near(p_m, 0.006);
      ASSERT_EQ(surface.has_value(), expected.has_value());
      if (!surface) continue;
      ++found;
      EXPECT_EQ(surface->distance_m, expected->distance_m);
      EXPECT_EQ(surface->normal_world, expected->normal_world);
    }
  }
  EXPECT_GT(found, 100);
  EXPECT_GT(refused, 10);
}

TEST(HullDistance, HasNoSurfaceOutsideTheBoxOfTheRule) {
  const std::vector<Silhouette> silhouettes =
      test::silhouettes_of({{{0, 0, 0}, {0, 0, 0}, 0.05}}, ring_of(4));
  HullRule rule;
  rule.within_world_m = {Vector3d(-1, -1, -1), Vector3d(0.0505, 1, 1)};
  const HullDistance distance(silhouettes, rule);
  EXPECT_TRUE(distance.near({0.05, 0, 0}, 0.005));
  EXPECT_FALSE(distance.near({0.051, 0, 0}, 0.005));
  EXPECT_TRUE(HullDistance(silhouettes).near({0.051, 0, 0}, 0.005));
}

// Particles must be the same on every machine.
TEST(HullDistance, IsTheSameWithEveryInstructionSet) {
  test::Random random(13);
  const std::vector<Silhouette> silhouettes =
      test::silhouettes_of(test::random_object(random, 6), ring_of(5));
  std::vector<Vector3d> points_m;
  for (int i = 0; i < 1003; ++i) points_m.push_back(test::random_in_ball(random, 0.25));
  for (const HullRule& rule : {HullRule{}, HullRule{Limits::seen, 4}}) {
    const HullDistance distance(silhouettes, rule);
    std::vector<std::vector<std::optional<SurfaceNearby>>> results;
    hwy::SetSupportedTargetsForTest(0);
    for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
      hwy::SetSupportedTargetsForTest(left & -left);
      distance.near(points_m, 0.006, results.emplace_back(points_m.size()));
    }
    hwy::SetSupportedTargetsForTest(0);
    std::size_t found = 0;
    for (std::size_t i = 0; i < points_m.size(); ++i)
      for (const auto& result : results) {
        ASSERT_EQ(result[i].has_value(), results[0][i].has_value()) << i;
        if (!result[i]) continue;
        ++found;
        EXPECT_EQ(result[i]->distance_m, results[0][i]->distance_m) << i;
        EXPECT_EQ(result[i]->normal_world, results[0][i]->normal_world) << i;
        EXPECT_EQ(result[i]->distance_m, distance.near(points_m[i], 0.006)->distance_m);
      }
    EXPECT_GT(found, 50 * results.size());
  }
}

}  // namespace
}  // namespace fivepipe::hull
