// The exact reference for triangles: compared with closed forms and with point membership, and its
// invariances.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tests/collision/oracle/triangle_reference_checks.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::test {
namespace {

// The hull is the region left of X = -0.21 Z, with g = -0.21 Z - X > 0. If g has its sign at one
// vertex a alone, the border cuts off g_a^2 / ((g_a - g_b) (g_a - g_c)) of the area at that vertex.
TEST(TriangleReference, AgreesWithTheClosedFormOfAStraightSilhouetteEdge) {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    hull::Silhouette s{
        {{101, 101, 50, 50, 50, 50}, random_look_at(random, random_direction(random), kOrigin)},
        hull::ObjectPixels(101, 101)};
    for (int v = 0; v < 101; ++v)
      for (int u = 0; u < 40; ++u) s.pixels.set(u, v);
    collision::Triangle t;
    std::array<double, 3> g;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p_camera{uniform(random, -0.4, 0.2), uniform(random, -0.3, 0.3),
                                     uniform(random, 0.8, 1.2)};  // in the image
      g[k] = -0.21 * p_camera.z() - p_camera.x();
      t[k] = s.camera.camera_from_world.inverse() * p_camera;
    }
    const auto positive = std::count_if(g.begin(), g.end(), [](double x) { return x > 0; });
    double expected = positive == 3 ? 1 : 0;
    for (int k = 0; k < 3; ++k) {
      const double a = g[k], b = g[(k + 1) % 3], c = g[(k + 2) % 3];
      const double corner = a * a / ((a - b) * (a - c));
      if (positive == 1 && a > 0) expected = corner;
      if (positive == 2 && a < 0) expected = 1 - corner;
    }
    EXPECT_NEAR(fraction(std::vector{s}, t), expected, 1e-9);
  }
}

// The cameras are on the horizon of a ball. In that plane the hull is a polygon with one side on
// each line of sight that touches the ball. The maps move a line outward by less than 1.5 px (the
// diagonal of a touched pixel) at a distance of at most 1.1 m.
TEST(TriangleReference, AgreesWithTheClosedFormOfABallsSection) {
  constexpr int kCameras = 7;
  constexpr double kRadius = 0.1, kDistance = 1;
  std::vector<double> tangents;
  for (int i = 0; i < kCameras; ++i)
    for (const double side : {-1, 1})
      tangents.push_back(std::fmod(
          2 * std::numbers::pi * (i / double(kCameras) + 1) + side * std::acos(kRadius / kDistance),
          2 * std::numbers::pi));
  std::sort(tangents.begin(), tangents.end());
  double per_radius2 = 0;
  for (std::size_t i = 0; i < tangents.size(); ++i)
    per_radius2 += std::tan(
        0.5 * ((i + 1 < tangents.size() ? tangents[i + 1] : tangents[0] + 2 * std::numbers::pi) -
               tangents[i]));
  for (const int size_px : {200, 801}) {
    const auto cameras = ring(kCameras, kDistance, 0, size_px, 0.4);
    const auto silhouettes = silhouettes_of({ball(kOrigin, kRadius)}, cameras);
    const collision::TriangleTruth truth =
        collision::triangle_truth(collision::HullDistance(silhouettes),
                                  {Eigen::Vector3d(-0.4, -0.3, 0), {0.4, -0.3, 0}, {0, 0.5, 0}});
    const double radius_of_pixels = kRadius + 1.5 * 1.1 * kDistance / cameras[0].pinhole.fx_px;
    EXPECT_GE(truth.area_in_hull_m2, per_radius2 * kRadius * kRadius);
    EXPECT_LE(truth.area_in_hull_m2, per_radius2 * radius_of_pixels * radius_of_pixels);
    EXPECT_GE(truth.deepest_at_most_m, kRadius);  // at the ball's center
    EXPECT_LE(truth.deepest_m, radius_of_pixels);
  }
}

TEST(TriangleReference, AFullMapGivesTheImagePyramid) {
  const std::vector<hull::Silhouette> right_angled{
      all_object({{101, 77, 50.5, 38.5, 50, 38}, Eigen::Isometry3d::Identity()})};  // |X|, |Y| < Z
  const collision::Triangle across{Eigen::Vector3d(-10, -10, 1), {10, -10, 1}, {0, 20, 1}};
  EXPECT_NEAR(
      collision::triangle_truth(collision::HullDistance(right_angled), across).area_in_hull_m2, 4,
      1e-9);
  // Through the camera's center, along its axis: an angle of 90 degrees of it, up to Z = 2.
  const collision::Triangle along{Eigen::Vector3d(-9, 0, -5), {9, 0, -5}, {0, 0, 2}};
  const double slope =
      // The edges fall from (0, 2) by Z = 2 - slope |X| and meet |X| = Z at 2 / (1 + slope).
      7.0 / 9;
  EXPECT_NEAR(
      collision::triangle_truth(collision::HullDistance(right_angled), along).area_in_hull_m2,
      2 * 2 / (1 + slope), 1e-8);
}

TEST(TriangleReference, AgreesWithInHullAtRandomPoints) {
  int inside = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    auto silhouettes =
        silhouettes_of({random_cameras(random, 1 + seed % 5), random_object(random, 3)});
    if (seed % 4 == 0)
      silhouettes[0].camera.camera_from_world.linear()(0, 1) +=
          0.4 * geometry::kMaxRotationError;  // a rotation that is slightly not orthonormal
    inside += check_samples(random, silhouettes,
                            random_triangle_in_ball(random, seed % 2 ? 0.25 : 0.05), 300);
  }
  EXPECT_GT(inside, 1000);
}

TEST(TriangleReference, AgreesWithInHullInNoise) {
  Random random(2);
  int inside = 0;
  for (int i = 0; i < 10; ++i) {
    std::vector<hull::Silhouette> silhouettes;
    for (const geometry::Camera& camera : random_cameras(random, 1 + i % 3, 43, 31))
      silhouettes.push_back({camera, random_pixels(random, 43, 31, 0.6)});
    inside += check_samples(random, silhouettes, random_triangle_in_ball(random, 0.3), 300);
  }
  EXPECT_GT(inside, 500);
}

TEST(TriangleReference, AgreesWithInHullForSixteenCameras) {
  Random random(3);
  const auto silhouettes =
      silhouettes_of({random_cameras(random, 16, 131, 77), random_object(random, 4)});
  int inside = 0;
  for (int i = 0; i < 10; ++i)
    inside += check_samples(random, silhouettes, random_triangle_in_ball(random, 0.2), 200);
  EXPECT_GT(inside, 100);
}

TEST(TriangleReference, AgreesWithInHullForVerticesBehindCameras) {
  Random random(4);
  int inside = 0;
  for (int i = 0; i < 20; ++i)
    inside += check_samples(random, hand_among(3), random_triangle_in_ball(random, 4), 300);
  const auto cameras = ring(2, 1, 0, 64, 0.2);
  const std::vector<hull::Silhouette> all{all_object(cameras[0]), all_object(cameras[1])};
  inside +=
      check_samples(random, all, {Eigen::Vector3d(-2, 0, 0), {2, 0, 0}, {0, 0.05, 0.03}}, 3000);
  EXPECT_GT(inside, 300);
}

TEST(TriangleReference, IsIndependentOfVertexOrderToTheBit) {
  Random random(5);
  const auto silhouettes = hand_among();
  const collision::HullDistance hull(silhouettes);
  for (int i = 0; i < 10; ++i) {
    const collision::Triangle t = random_triangle_in_ball(random, 0.1);
    const auto polygons = collision::hull_on_triangle(silhouettes, t);
    const collision::TriangleTruth truth = collision::triangle_truth(hull, t);
    std::array<int, 3> order = {0, 1, 2};
    while (std::next_permutation(order.begin(), order.end())) {
      const collision::Triangle permuted{t[order[0]], t[order[1]], t[order[2]]};
      EXPECT_EQ(collision::hull_on_triangle(silhouettes, permuted), polygons);
      EXPECT_EQ(collision::triangle_truth(hull, permuted).area_in_hull_m2, truth.area_in_hull_m2);
      EXPECT_EQ(collision::triangle_truth(hull, permuted).deepest_world_m, truth.deepest_world_m);
    }
  }
}

TEST(TriangleReference, AreaIsAdditiveUnderSubdivision) {
  Random random(6);
  const auto silhouettes = hand_among();
  double in_hull_m2 = 0;
  for (int i = 0; i < 100 / kSlowdown; ++i) {
    const collision::Triangle t = random_triangle_in_ball(random, 0.1);
    const Eigen::Vector3d a = 0.5 * (t[1] + t[2]), b = 0.5 * (t[2] + t[0]), c = 0.5 * (t[0] + t[1]);
    const collision::HullDistance hull(silhouettes);
    const collision::TriangleTruth whole = collision::triangle_truth(hull, t);
    double parts_m2 = 0, deepest_m = 0;
    for (const collision::Triangle& part :
         {collision::Triangle{t[0], c, b}, collision::Triangle{c, t[1], a},
          collision::Triangle{b, a, t[2]}, collision::Triangle{a, b, c}}) {
      const collision::TriangleTruth truth = collision::triangle_truth(hull, part);
      parts_m2 += truth.area_in_hull_m2;
      deepest_m = std::max(deepest_m, truth.deepest_m);
      EXPECT_LE(truth.deepest_m, whole.deepest_at_most_m);
    }
    EXPECT_NEAR(parts_m2, whole.area_in_hull_m2, 1e-9 * whole.area_m2);
    EXPECT_NEAR(
        deepest_m, whole.deepest_m,
        collision::kDepthTolerance_m + collision::kDepthToleranceFraction * whole.deepest_m);
    in_hull_m2 += parts_m2;
  }
  EXPECT_GT(in_hull_m2, 0.01 / kSlowdown);
}

TEST(TriangleReference, AnotherCameraNeverAddsArea) {
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    const auto silhouettes = silhouettes_of({random_cameras(random, 5), random_object(random, 3)});
    const collision::Triangle t = random_triangle_in_ball(random, 0.2);
    double before = 1 + 1e-12;
    for (std::size_t n = 1; n <= silhouettes.size(); ++n) {
      const double now = fraction(std::span(silhouettes).first(n), t);
      EXPECT_LE(now, before + 1e-12);
      before = now;
    }
  }
}

// No sample of a fine grid is deeper than the bound, and the reported point has the reported depth.
TEST(TriangleReference, TheDepthBoundHoldsForEverySample) {
  Random random(11);
  const auto silhouettes = hand_among();
  const collision::HullDistance hull(silhouettes);
  // The search may end this far from the deepest point: a tenth of the smallest eps_m in use.
  constexpr double kMaxExcess = 0.01, kMaxExcess_m = 10e-6;
  int crossing = 0;
  for (int i = 0; i < 30; ++i) {
    const collision::Triangle t = random_triangle_in_ball(random, 0.06);
    const collision::TriangleTruth truth = collision::triangle_truth(hull, t);
    EXPECT_EQ(hull.depth_m(truth.deepest_world_m), truth.deepest_m);
    EXPECT_LE(truth.deepest_at_most_m, (1 + kMaxExcess) * truth.deepest_m + kMaxExcess_m);
    constexpr int kGrid = 40;
    for (int a = 0; a <= kGrid; ++a)
      for (int b = 0; a + b <= kGrid; ++b)
        EXPECT_LE(hull.depth_m(t[0] + (a * (t[1] - t[0]) + b * (t[2] - t[0])) / kGrid),
                  truth.deepest_at_most_m + 1e-12);
    crossing += truth.crosses;
  }
  EXPECT_GT(crossing, 10);
}

}  // namespace
}  // namespace fivepipe::test
