// The cameras that limit the hull at a point, against a search of all edges around it, and the
// values of the contour's fit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/hull/silhouette/hull_border.h"
#include "tests/support/hull/queries.h"
#include "tests/support/not_finite.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;

constexpr Eigen::Index kSides = 4;
const Vector2i kSide[kSides] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};

double distance_px(const Vector2d& uv, const ContourEdge& edge) {
  const Vector2d center = edge.center_px(), along(edge.outward.y(), edge.outward.x());
  const double t = std::clamp((uv - center).dot(along), -0.5, 0.5);
  return (uv - center - t * along).norm();
}

// The edges of the kept pixels in or next to uv's pixel.
std::vector<ContourEdge> edges_around(const ContourMap& map, const Vector2d& uv) {
  std::vector<ContourEdge> edges;
  for (int v = int(std::floor(uv.y() + 0.5)) - 1, n = 0; n < 3; ++n, ++v)
    for (int u = int(std::floor(uv.x() + 0.5)) - 1, m = 0; m < 3; ++m, ++u)
      for (const Vector2i& side : kSide)
        if (map.keeps(u, v) && !map.keeps(u + side.x(), v + side.y()))
          edges.push_back({{u, v}, side});
  return edges;
}

Vector3d plane_through(const geometry::Camera& camera, const Vector2d& uv, const Vector2d& normal) {
  const Vector2d tangent(-normal.y(), normal.x());
  const Vector3d a = geometry::ray_through(camera, uv).direction_world,
                 b = geometry::ray_through(camera, uv + tangent).direction_world;
  const Vector3d n = b.cross(a).normalized();  // towards `normal`, as v points down
  return n.dot(geometry::ray_through(camera, uv + normal).direction_world) > 0 ? n : Vector3d(-n);
}

TEST(LimitingCameras, AreThoseWithAnEdgeWithinAPixelNearestFirst) {
  int found_count = 0, with_others = 0, with_normals = 0, cut = 0, starts_inside = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    test::Random random(seed);
    std::vector<geometry::Camera> cameras;
    for (const geometry::Camera& c : test::random_cameras(random, 3 + seed % 4, 60, 45))
      cameras.push_back(c);
    auto silhouettes = test::silhouettes_of(test::random_object(random, 3, 0.15), cameras);
    if (seed % 5 == 0)
      for (Silhouette& s : silhouettes) s.pixels = test::random_pixels(random, 60, 45, 0.97);
    for (const HullRule& rule : {HullRule{}, HullRule{Limits::seen, 2}}) {
      const test::Queries q(silhouettes, rule);
      for (int i = 0; i < 60; ++i) {
        const Vector3d from = test::random_in_ball(random, 1),
                       to = test::random_in_ball(random, 0.1);
        const geometry::Ray ray = segment(from, to);
        const auto entry = q.query.first_entry(ray, 0, 2);
        const auto found = limiting_cameras(q.query, ray, 0, 2);
        if (!entry || *entry == 0) {
          ASSERT_FALSE(found);
          starts_inside += entry.has_value();
          continue;
        }
        if (!found) continue;  // an image's border without an edge next to it
        ++found_count;
        ASSERT_EQ(found->t, *entry);
        const Vector3d p = ray.origin_world_m + found->t * ray.direction_world;
        ASSERT_GE(found->cameras.size(), 1u);
        ASSERT_LE(found->cameras.size(), 4u);
        const LimitingCamera& first = found->cameras.front();
        ASSERT_EQ(first.distance_px, 0);
        // The camera's verdict changes at the entry, and its plane holds the camera's centre.
        const auto& s = silhouettes[std::size_t(first.camera)];
        const Vector3d before = p - 1e-9 * ray.direction_world,
                       after = p + 1e-9 * ray.direction_world;
        const auto verdict = [&](const Vector3d& x) {
          const auto uv = geometry::project(s.camera, x);
          return !uv || !s.pixels.holds(uv->x(), uv->y()) ? 2
                 : s.pixels.contains_at(uv->x(), uv->y()) ? 1
                                                          : 0;
        };
        ASSERT_NE(verdict(before), verdict(after));
        ASSERT_NEAR(
            first.normal_world.dot((p - geometry::camera_center_world_m(s.camera)).normalized()), 0,
            1e-6);
        std::vector<LimitingCamera> expected;
        std::vector<bool> unique;
        for (const CpuHull::MapCamera& c : q.hull.cameras()) {
          const auto uv = geometry::project(c.camera, p);
          const PixelRect image = image_of(c.camera);
          if (c.silhouette == first.camera || !uv ||
              !holds({-1, -1, image.u1_px + 1, image.v1_px + 1}, uv->x(), uv->y()))
            continue;
          const ContourMap map{&c.skip_map, image,
                               rule.limits == Limits::seen ? Kept::not_empty : Kept::object};
          auto edges = edges_around(map, *uv);
          std::sort(edges.begin(), edges.end(), [&](const ContourEdge& a, const ContourEdge& b) {
            return distance_px(*uv, a) < distance_px(*uv, b);
          });
          if (edges.empty() || distance_px(*uv, edges[0]) > 1) continue;
          const ContourFit fit = contour_fit(map, edges[0], *uv);
          expected.push_back({c.silhouette, plane_through(c.camera, *uv, fit.normal), fit.error_rad,
                              distance_px(*uv, edges[0])});
        }
        std::stable_sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) {
          return a.distance_px < b.distance_px;
        });
        ASSERT_EQ(found->cameras.size(), std::min<std::size_t>(expected.size() + 1, 4));
        cut += expected.size() > 3;
        for (std::size_t n = 1; n < found->cameras.size(); ++n) {
          const LimitingCamera &other = found->cameras[n], &same = expected[n - 1];
          ++with_others;
          ASSERT_EQ(other.camera, same.camera);
          ASSERT_NEAR(other.distance_px, same.distance_px, 1e-12);
          if (std::abs(other.error_rad - same.error_rad) > 1e-9) continue;  // two nearest edges
          ++with_normals;
          ASSERT_NEAR((other.normal_world - same.normal_world).norm(), 0, 1e-9);
        }
      }
    }
  }
  EXPECT_GT(found_count, 3000);
  EXPECT_GT(with_others, 4000);
  EXPECT_GT(with_normals, 0.8 * with_others);
  EXPECT_GT(cut, 100);
  EXPECT_GT(starts_inside, 100);
}

TEST(LimitingCameras, NoneForARangeOrRayThatIsNotFiniteOrEmpty) {
  test::Random random(3);
  const auto silhouettes =
      test::silhouettes_of({test::random_cameras(random, 3), test::random_object(random, 3)});
  const test::Queries q(silhouettes);
  Vector3d inside = Vector3d::Zero();
  for (int i = 0; i < 10'000 && !q.query.contains(inside); ++i)
    inside = test::random_in_ball(random, 0.2);
  ASSERT_TRUE(q.query.contains(inside));
  const geometry::Ray ray = segment({1, 1, 1}, inside);
  ASSERT_TRUE(limiting_cameras(q.query, ray, 0, 1));
  const double entry = limiting_cameras(q.query, ray, 0, 1)->t;
  EXPECT_FALSE(limiting_cameras(q.query, ray, 0, 0.5 * entry));
  EXPECT_FALSE(limiting_cameras(q.query, ray, 1, 1));
  EXPECT_FALSE(limiting_cameras(q.query, ray, 1, 0));
  EXPECT_FALSE(limiting_cameras(q.query, ray, 1, 2));  // starts in the hull
  EXPECT_FALSE(limiting_cameras(q.query, ray, 0, kInfinity));
  EXPECT_FALSE(limiting_cameras(q.query, ray, -kInfinity, 1));
  EXPECT_FALSE(limiting_cameras(q.query, ray, test::kNaN, 1));
  EXPECT_FALSE(limiting_cameras(q.query, {{test::kNaN, 1, 1}, {1, 0, 0}}, 0, 1));
  EXPECT_FALSE(limiting_cameras(q.query, {{1, 1, 1}, {1, test::kNaN, 0}}, 0, 1));
  EXPECT_FALSE(limiting_cameras(test::Queries(std::vector<Silhouette>{}).query, ray, 0, 1));
}

// Sums over all edges of a map: any other choice of edges, window or parabola changes them.
struct FitSums {
  int edges = 0;
  double error_rad = 0, along_edge = 0, across_edge = 0;
};
FitSums fit_sums(const ObjectPixels& pixels, Kept kept) {
  SkipMap skip_map;
  skip_map.assign(pixels);
  test::make_all(skip_map);
  const ContourMap map{&skip_map, {0, 0, pixels.width_px(), pixels.height_px()}, kept};
  FitSums sums;
  for (int v = -1; v <= pixels.height_px(); ++v)
    for (int u = -1; u <= pixels.width_px(); ++u)
      for (const Vector2i& side : kSide) {
        if (!map.keeps(u, v) || map.keeps(u + side.x(), v + side.y())) continue;
        const ContourEdge edge{{u, v}, side};
        const Vector2d along(edge.outward.y(), edge.outward.x());
        const ContourFit fit = contour_fit(map, edge, edge.center_px() + 0.3 * along);
        ++sums.edges;
        sums.error_rad += fit.error_rad;
        sums.along_edge += std::abs(fit.normal.dot(along));
        sums.across_edge += fit.normal.dot(side.cast<double>());
      }
  return sums;
}

// Discs and noise; kept outside of the image or not.
constexpr FitSums kFits[8][2] = {
    {{8, 6.283185307, 3.347284932, 6.318643923}, {232, 10.901658086, 41.429602790, 219.599488622}},
    {{24, 1.300215448, 12.308886452, 18.751388081},
     {248, 5.918688226, 50.391204310, 232.032232779}},
    {{48, 1.036358417, 24.156003125, 37.930575989},
     {272, 5.654831196, 62.238320983, 251.211420688}},
    {{88, 0.847570757, 44.321467208, 69.322753676},
     {312, 5.466043535, 82.403785065, 282.603598374}},
    {{160, 1.162542149, 80.576550010, 125.711662910},
     {384, 5.781014927, 118.658867867, 338.992507608}},
    {{374, 989.343998761, 37.734203413, 356.461374978},
     {584, 925.110547841, 83.841901998, 544.610142284}},
    {{3126, 2233.948127952, 1502.045839269, 1860.247543306},
     {3076, 2461.737547125, 1449.898458412, 1927.282072599}},
    {{1280, 2542.770490894, 181.955947347, 1185.095588774},
     {1092, 2728.445971234, 120.982906231, 1044.935995523}},
};

TEST(Contour, FitsOfEveryEdgeHaveTheirKnownSums) {
  for (int n = 0; n < 8; ++n) {
    test::Random random(n + 1);
    ObjectPixels pixels(64, 48);
    if (n < 5) {
      const double radius_px[] = {1.2, 3, 6, 11, 20};
      for (int v = 0; v < 48; ++v)
        for (int u = 0; u < 64; ++u)
          if (std::hypot(u - 30.3, v - 23.6) <= radius_px[n]) pixels.set(u, v);
    } else {
      pixels = test::random_pixels(random, 64, 48, n == 5 ? 0.03 : n == 6 ? 0.5 : 0.9);
    }
    for (const Kept kept : {Kept::object, Kept::not_empty}) {
      SCOPED_TRACE(n);
      const FitSums sums = fit_sums(pixels, kept), &known = kFits[n][kept == Kept::not_empty];
      // In noise, many fits are next to a limit, where rounding may decide.
      const double tolerance = n < 5 ? 1e-6 : 2e-3 * known.edges;
      EXPECT_EQ(sums.edges, known.edges);
      EXPECT_NEAR(sums.error_rad, known.error_rad, tolerance);
      EXPECT_NEAR(sums.along_edge, known.along_edge, tolerance);
      EXPECT_NEAR(sums.across_edge, known.across_edge, tolerance);
    }
  }
}

}  // namespace
}  // namespace fivepipe::hull
