// The exact reference of triangles itself: against silhouettes in closed form, against point
// membership, and by what must not change it.
#include <algorithm>
#include <limits>
#include <stdexcept>

#include "common/collision/oracle/triangle_reference.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/collision_scene.h"

namespace fivepipe::test {
namespace {

// Rounding of a border's place on a triangle, in weights, where cameras, hull and triangle are
// metres apart: some 1e-14.
constexpr double kMarginOfWeights = 1e-11;

hull::Silhouette all_object(const geometry::Camera& camera) {
  hull::Silhouette s{camera, hull::ObjectPixels(camera.pinhole.width_px, camera.pinhole.height_px)};
  for (int v = 0; v < s.pixels.height_px(); ++v)
    for (int u = 0; u < s.pixels.width_px(); ++u) s.pixels.set(u, v);
  return s;
}

collision::Triangle random_triangle(Random& random, double extent_m) {
  return {random_in_ball(random, extent_m), random_in_ball(random, extent_m),
          random_in_ball(random, extent_m)};
}

double fraction(std::span<const hull::Silhouette> silhouettes, const collision::Triangle& t) {
  return collision::triangle_truth(collision::HullDistance(silhouettes), t).fraction_in_hull;
}

// How many polygons hold the weights, and stay `margin` clear of them; fewer by a margin below
// zero.
int holders(const std::vector<collision::WeightPolygon>& polygons, const Eigen::Vector3d& w,
            double margin) {
  constexpr double kNoEdge = 1e-13;  // shorter: two cuts that rounding alone tells apart
  return int(
      std::count_if(polygons.begin(), polygons.end(), [&](const collision::WeightPolygon& polygon) {
        bool any_edge = false;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
          const Eigen::Vector2d a = polygon[i].tail<2>(),
                                edge = polygon[(i + 1) % polygon.size()].tail<2>() - a,
                                to = w.tail<2>() - a;
          if (!(edge.norm() > kNoEdge)) continue;
          if (!(edge.x() * to.y() - edge.y() * to.x() > margin * edge.norm())) return false;
          any_edge = true;
        }
        return any_edge;
      }));
}

// Every one of the samples is in one polygon or in none, as in_hull() says. How many are in the
// hull.
int check_samples(Random& random, std::span<const hull::Silhouette> silhouettes,
                  const collision::Triangle& triangle, int samples,
                  double margin = kMarginOfWeights) {
  const collision::Triangle t = collision::sorted(triangle);
  const auto polygons = collision::weights_in_hull(silhouettes, triangle);
  int inside = 0;
  for (int i = 0; i < samples; ++i) {
    const double a = std::sqrt(uniform(random, 0, 1)), b = uniform(random, 0, 1);
    const Eigen::Vector3d w(1 - a, a * (1 - b), a * b);
    const bool expected =
        hull::in_hull(silhouettes, t[0] + w.y() * (t[1] - t[0]) + w.z() * (t[2] - t[0]));
    EXPECT_LE(holders(polygons, w, margin), expected ? 1 : 0);
    if (expected) {
      EXPECT_GE(holders(polygons, w, -margin), 1);
    }
    inside += expected;
  }
  return inside;
}

// What is left of X = -0.21 Z: of a corner whose g is alone in its sign, g_a^2 / ((g_a - g_b) (g_a
// - g_c)) of the area is cut off.
TEST(TriangleReference, OneStraightSilhouetteEdgeInClosedForm) {
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    hull::Silhouette s{
        {{101, 101, 50, 50, 50, 50},
         geometry::look_at(random_direction(random), kOrigin, random_direction(random))},
        hull::ObjectPixels(101, 101)};
    for (int v = 0; v < 101; ++v)
      for (int u = 0; u < 40; ++u) s.pixels.set(u, v);
    collision::Triangle t;
    std::array<double, 3> g;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p_camera(uniform(random, -0.4, 0.2), uniform(random, -0.3, 0.3),
                                     uniform(random, 0.8, 1.2));  // in the image
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

// A ball among cameras on its horizon: what they leave of that plane is a polygon with a side on
// each line of sight that touches the ball. Maps move each line outward by less than a pixel and a
// half (a diagonal of the touched pixel), seen 1.1 m away at most.
TEST(TriangleReference, SectionOfABallInClosedForm) {
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
    EXPECT_GE(truth.deepest_at_most_m, kRadius);  // the ball's centre
    EXPECT_LE(truth.deepest_m, radius_of_pixels);
  }
}

TEST(TriangleReference, FullMaskGivesTheImagePyramid) {
  const std::vector<hull::Silhouette> right_angled{
      all_object({{101, 77, 50.5, 38.5, 50, 38}, Eigen::Isometry3d::Identity()})};  // |X|, |Y| < Z
  const collision::Triangle across{Eigen::Vector3d(-10, -10, 1), {10, -10, 1}, {0, 20, 1}};
  EXPECT_NEAR(
      collision::triangle_truth(collision::HullDistance(right_angled), across).area_in_hull_m2, 4,
      1e-9);
  // Through the camera's centre, along its axis: 90 degrees of it, up to Z = 2.
  const collision::Triangle along{Eigen::Vector3d(-9, 0, -5), {9, 0, -5}, {0, 0, 2}};
  const double slope =
      7.0 / 9;  // edges fall from (0, 2): Z = 2 - slope |X|, meet |X| = Z at 2 / (1 + slope)
  EXPECT_NEAR(
      collision::triangle_truth(collision::HullDistance(right_angled), along).area_in_hull_m2,
      2 * 2 / (1 + slope), 1e-8);
}

TEST(TriangleReference, EveryPointIsWhereInHullSaysItIs) {
  int inside = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    auto silhouettes =
        silhouettes_of(random_object(random, 3), random_cameras(random, 1 + seed % 5));
    if (seed % 4 == 0)
      silhouettes[0].camera.camera_from_world.linear()(0, 1) +=
          0.4 * geometry::kMaxRotationError;  // a calibration a little off
    inside +=
        check_samples(random, silhouettes, random_triangle(random, seed % 2 ? 0.25 : 0.05), 300);
  }
  EXPECT_GT(inside, 1000);
}

TEST(TriangleReference, MapsOfNoise) {
  Random random(2);
  int inside = 0;
  for (int i = 0; i < 10; ++i) {
    std::vector<hull::Silhouette> silhouettes;
    for (const geometry::Camera& camera : random_cameras(random, 1 + i % 3, 43, 31))
      silhouettes.push_back({camera, random_pixels(random, 43, 31, 0.6)});
    inside += check_samples(random, silhouettes, random_triangle(random, 0.3), 300);
  }
  EXPECT_GT(inside, 500);
}

TEST(TriangleReference, SixteenCameras) {
  Random random(3);
  const auto silhouettes =
      silhouettes_of(random_object(random, 4), random_cameras(random, 16, 131, 77));
  int inside = 0;
  for (int i = 0; i < 10; ++i)
    inside += check_samples(random, silhouettes, random_triangle(random, 0.2), 200);
  EXPECT_GT(inside, 100);
}

TEST(TriangleReference, VerticesBehindCameras) {
  Random random(4);
  int inside = 0;
  for (int i = 0; i < 20; ++i)
    inside += check_samples(random, hand_among(3), random_triangle(random, 4), 300);
  const auto cameras = ring(2, 1, 0, 64, 0.2);
  const std::vector<hull::Silhouette> all{all_object(cameras[0]), all_object(cameras[1])};
  inside +=
      check_samples(random, all, {Eigen::Vector3d(-2, 0, 0), {2, 0, 0}, {0, 0.05, 0.03}}, 3000);
  EXPECT_GT(inside, 300);
}

TEST(TriangleReference, PermutedVerticesGiveTheSameBits) {
  Random random(5);
  const auto silhouettes = hand_among();
  const collision::HullDistance hull(silhouettes);
  for (int i = 0; i < 10; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1);
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
  for (int i = 0; i < 100; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1);
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
  EXPECT_GT(in_hull_m2, 0.01);
}

TEST(TriangleReference, AnotherCameraAddsNothing) {
  Random random(7);
  for (int i = 0; i < 20; ++i) {
    const auto silhouettes = silhouettes_of(random_object(random, 3), random_cameras(random, 5));
    const collision::Triangle t = random_triangle(random, 0.2);
    double before = 1 + 1e-12;
    for (std::size_t n = 1; n <= silhouettes.size(); ++n) {
      const double now = fraction(std::span(silhouettes).first(n), t);
      EXPECT_LE(now, before + 1e-12);
      before = now;
    }
  }
}

TEST(TriangleReference, NoHullNoCrossing) {
  const collision::Triangle t{Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}};
  auto silhouettes = hand_among();
  EXPECT_TRUE(collision::triangle_truth(collision::HullDistance(silhouettes), t).crosses);
  silhouettes[2].pixels = hull::ObjectPixels(200, 200);
  for (const auto& none : {silhouettes, std::vector<hull::Silhouette>{}}) {
    const collision::TriangleTruth truth =
        collision::triangle_truth(collision::HullDistance(none), t);
    EXPECT_FALSE(truth.crosses);
    EXPECT_FALSE(truth.inside);
    EXPECT_EQ(truth.area_in_hull_m2, 0);
    EXPECT_EQ(truth.deepest_at_most_m, 0);
  }
}

TEST(TriangleReference, WhollyInside) {
  const auto silhouettes = silhouettes_of({ball(kOrigin, 0.1)}, ring(3, 1, 0.5, 200, 0.5));
  const collision::TriangleTruth truth =
      collision::triangle_truth(collision::HullDistance(silhouettes),
                                {Eigen::Vector3d(0, 0, 0.01), {0.02, 0, 0.01}, {0, 0.02, 0.01}});
  EXPECT_TRUE(truth.inside);
  EXPECT_NEAR(truth.area_in_hull_m2, 0.0002, 1e-14);
  EXPECT_FALSE(
      collision::triangle_truth(collision::HullDistance(silhouettes),
                                {Eigen::Vector3d(0, 0, 0.01), {0.3, 0, 0.01}, {0, 0.02, 0.01}})
          .inside);
}

// As much as a triangle 200 times smaller in the same plane, that holds the section too.
TEST(TriangleReference, TenMetresAroundAHullOfOneCentimetre) {
  const auto silhouettes = silhouettes_of({ball({0.1, 0.2, 0}, 0.005)}, ring(3, 1, 0.5, 300, 0.6));
  const collision::HullDistance hull(silhouettes);
  const collision::Triangle large{Eigen::Vector3d(-5, -5, 0), {5, -5, 0}, {0, 5, 0}},
      small{Eigen::Vector3d(0.075, 0.175, 0), {0.125, 0.175, 0}, {0.1, 0.24, 0}};
  const collision::TriangleTruth of_large = collision::triangle_truth(hull, large),
                                 of_small = collision::triangle_truth(hull, small);
  EXPECT_GT(of_small.area_in_hull_m2, std::numbers::pi * 0.005 * 0.005);
  EXPECT_NEAR(of_large.area_in_hull_m2, of_small.area_in_hull_m2, 1e-9 * of_small.area_in_hull_m2);
  EXPECT_NEAR(
      of_large.deepest_m, of_small.deepest_m,
      collision::kDepthTolerance_m + collision::kDepthToleranceFraction * of_small.deepest_m);
}

TEST(TriangleReference, SeenEdgeOn) {
  Random random(8);
  const std::vector<hull::Capsule> object{ball(kOrigin, 0.05), ball({0.08, 0.02, 0}, 0.02)};
  const collision::Triangle t{Eigen::Vector3d(-0.1, -0.1, 0), {0.1, -0.1, 0}, {0, 0.15, 0}};
  for (const int size_px :
       {200, 201}) {  // the plane on a border between two rows, and in a row's middle
    const auto by_every_camera = silhouettes_of(object, ring(3, 1, 0, size_px, 0.5));
    EXPECT_GT(check_samples(random, by_every_camera, t, 1000), 100);
    auto by_one = silhouettes_of(object, ring(3, 1, 0.6, size_px, 0.5));
    by_one.push_back(by_every_camera[0]);
    EXPECT_GT(check_samples(random, by_one, t, 1000), 100);
  }
}

// On a segment the hull is where the reference for rays says.
TEST(TriangleReference, TrianglesWithoutAreaAreSegmentsAndPoints) {
  const auto silhouettes = hand_among();
  const Eigen::Vector3d a(-0.3, -0.02, 0.01), b(0.2, 0.05, 0.03),
      direction = b - a, outside(0.3, 0.3, 0.3), inside(0, 0, 0.02);
  const auto intervals = hull::reference_intervals(silhouettes, {a, direction}, 0, 1);
  ASSERT_FALSE(intervals.empty());
  for (const collision::Triangle& t : {collision::Triangle{a, b, b}, collision::Triangle{a, a, b},
                                       collision::Triangle{a, a + 0.3 * direction, b}}) {
    double first = 1, last = 0;
    for (const auto& polygon : collision::hull_on_triangle(silhouettes, t))
      for (const Eigen::Vector3d& p : polygon) {
        const double along = (p - a).dot(direction) / direction.squaredNorm();
        const auto holds = [along](const hull::Interval& i) {
          return along > i.enter - 1e-9 && along < i.leave + 1e-9;
        };
        EXPECT_TRUE(std::any_of(intervals.begin(), intervals.end(), holds));
        first = std::min(first, along);
        last = std::max(last, along);
      }
    EXPECT_NEAR(first, intervals.front().enter, 1e-9);
    EXPECT_NEAR(last, intervals.back().leave, 1e-9);
    EXPECT_LT(collision::triangle_truth(collision::HullDistance(silhouettes), t).area_in_hull_m2,
              1e-15);
  }
  EXPECT_TRUE(
      collision::triangle_truth(collision::HullDistance(silhouettes), {inside, inside, inside})
          .inside);
  EXPECT_EQ(
      collision::triangle_truth(collision::HullDistance(silhouettes), {inside, inside, inside})
          .deepest_m,
      collision::HullDistance(silhouettes).depth_m(inside));
  EXPECT_FALSE(
      collision::triangle_truth(collision::HullDistance(silhouettes), {outside, outside, outside})
          .crosses);
}

TEST(TriangleReference, SliverOfOneMicrometre) {
  Random random(9);
  const auto silhouettes = hand_among();
  const collision::Triangle t{Eigen::Vector3d(-0.5, 0.0031, 0),
                              {0.5, 0.0031, 0},
                              {0, 0.003101, 0}};  // on no border of the cameras in y = 0
  EXPECT_GT(check_samples(random, silhouettes, t, 2000, 1e-8),
            100);  // rounding of 1e-15 m is a billionth of the sliver's width
  // The hull is 1 um wide there: as long a part of the sliver's axis.
  const auto intervals = hull::reference_intervals(silhouettes, {t[0], t[1] - t[0]}, 0, 1);
  ASSERT_EQ(intervals.size(), 1u);
  const auto cut_off = [](double x) {
    return 2 * std::min(x, 1 - x) * std::min(x, 1 - x);
  };  // of the area, left of x or right of it
  const double left = intervals[0].enter, right = intervals[0].leave;
  ASSERT_TRUE(left < 0.5 && right > 0.5);
  EXPECT_NEAR(fraction(silhouettes, t), 1 - cut_off(left) - cut_off(right), 1e-4);
}

TEST(TriangleReference, OneKilometreFromTheOrigin) {
  Random random(10);
  const Eigen::Vector3d far_away_m(1000, -700, 50);
  const collision::Triangle t{
      Eigen::Vector3d(-0.1, -0.1, 0.01), {0.1, -0.08, 0.02}, {0, 0.15, 0.04}};
  const collision::Triangle shifted{t[0] + far_away_m, t[1] + far_away_m, t[2] + far_away_m};
  const auto silhouettes = hand_among(4, 200, far_away_m);
  // Coordinates round to 1e-13 m, some of them at a time: a hundred-millionth of a pixel, and of
  // the triangle.
  EXPECT_GT(check_samples(random, silhouettes, shifted, 2000, 1e-8), 100);
  EXPECT_NEAR(fraction(silhouettes, shifted), fraction(hand_among(), t), 1e-8);
}

TEST(TriangleReference, RefusesVerticesThatAreNotFinite) {
  const auto silhouettes = hand_among();
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    for (int i = 0; i < 3; ++i) {
      collision::Triangle t{Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}};
      t[i].y() = bad;
      EXPECT_THROW(collision::hull_on_triangle(silhouettes, t), std::invalid_argument);
      EXPECT_THROW(collision::triangle_truth(collision::HullDistance(silhouettes), t),
                   std::invalid_argument);
    }
}

TEST(TriangleReference, ACameraThatIsNotFiniteLeavesNoHull) {
  auto silhouettes = hand_among();
  silhouettes[1].camera.camera_from_world.translation().x() =
      std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(collision::triangle_truth(collision::HullDistance(silhouettes),
                                         {Eigen::Vector3d(-0.1, 0, 0), {0.1, 0, 0}, {0, 0.1, 0}})
                   .crosses);
}

// The deepest point against a fine grid of the triangle: no sample is deeper than said, and the
// point is as deep as said.
TEST(TriangleReference, DeepestPointBoundsEveryDepth) {
  Random random(11);
  const auto silhouettes = hand_among();
  const collision::HullDistance hull(silhouettes);
  int crossing = 0;
  for (int i = 0; i < 30; ++i) {
    const collision::Triangle t = random_triangle(random, 0.06);
    const collision::TriangleTruth truth = collision::triangle_truth(hull, t);
    EXPECT_EQ(hull.depth_m(truth.deepest_world_m), truth.deepest_m);
    EXPECT_LE(truth.deepest_at_most_m, truth.deepest_m * (1 + collision::kDepthToleranceFraction) +
                                           collision::kDepthTolerance_m);
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
