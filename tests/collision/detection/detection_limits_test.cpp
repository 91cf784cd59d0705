// Limits of collision detection that random scenes do not reach: boxes and triangles exactly at a
// border, the budgets of a triangle's tests, and the default options.
#include <algorithm>

#include "common/collision/detection/box_query.h"
#include "common/collision/detection/cpu/detection_common.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

// Looks along z from the origin. Pixel 32 begins at x = 0 and y = 0.
hull::Silhouette columns(int begin, int end) {
  hull::Silhouette s{{{64, 64, 64, 64, 31.5, 31.5}, Isometry3d::Identity()},
                     hull::ObjectPixels(64, 64)};
  for (int v = 0; v < 64; ++v) s.pixels.set_run(begin, end, v);
  return s;
}

// The border of the image is at x, y = -0.5 + pixel / 64 at a depth of 1 m. A box within 1e-7 px of
// an object pixel may contain a hull point, because the projection rounds.
TEST(BoxQuery, CertifiesNoBoxWithinRoundingOfAnObjectPixel) {
  hull::Silhouette s{{{64, 64, 64, 64, 31.5, 31.5}, Isometry3d::Identity()},
                     hull::ObjectPixels(64, 64)};
  for (int v = 16; v < 48; ++v) s.pixels.set_run(16, 48, v);  // x, y = -0.25 to 0.25
  for (const auto& [gap_px, is_free] : {std::pair{1e-7, false}, {1e-3, true}})
    for (const int axis : {0, 1})
      for (const double side : {-1.0, 1.0}) {
        const double near_m = 0.25 + gap_px / 64;
        Vector3d near(0, 0, 1), far(0.01, 0.01, 1);
        near[axis] = side * near_m, far[axis] = side * (near_m + 0.01);
        Eigen::AlignedBox3d box(near);
        box.extend(far);
        EXPECT_EQ(collision::is_certainly_free({&s, 1}, box), is_free)
            << gap_px << ' ' << axis << ' ' << side;
      }
}

// Double represents the height of a triangle down to 1e-12 of its longest edge.
TEST(TriangleView, IsDegenerateBelowATrillionthOfTheLongestEdge) {
  for (const double length_m : {0.25, 1.0, 8.0})
    for (const auto& [ratio, degenerate] : {std::pair{0.9e-12, true}, {1.1e-12, false}}) {
      const collision::Triangle t{kOrigin, Vector3d(length_m, 0, 0),
                                  Vector3d(0.5 * length_m, ratio * length_m, 0)};
      EXPECT_EQ(collision::view_of(t).degenerate, degenerate) << length_m << ' ' << ratio;
    }
}

// Two equal cameras with complementary maps: their hull is empty, but a triangle in the plane of
// the border between both maps is mixed at every size, and every sample is near the border.
TEST(CpuDetection, TestsAtMost1024PartsOfATriangleInDouble) {
  const CollisionHull hull({columns(0, 32), columns(32, 64)});
  const collision::Bvh tree(
      mesh_of({{Vector3d(0, -0.125, 1), Vector3d(0, 0.125, 1), Vector3d(0, 0, 1.125)}}));
  const collision::DetectionObject object{&tree};
  for (const auto& [divisions, over_budget] : {std::pair{32, false}, {64, true}}) {
    const double eps_m = 16 * 0.25 / divisions;
    for (const auto& [spacing_m, samples] : {std::pair{0.0, 0u}, {0.021, 64u}}) {
      collision::CpuDetectionCounts counts;
      const auto found = collision::detect(hull.query, {&object, 1},
                                           {.eps_m = eps_m, .spacing_m = spacing_m}, &counts)[0];
      EXPECT_EQ(found.verdict, collision::CollisionVerdict::undecided);
      EXPECT_EQ(found.undecided, std::vector<std::uint32_t>{0});
      EXPECT_TRUE(found.points.empty());
      // Three corners and the center of each part.
      EXPECT_EQ(counts.points_in_double, samples + 4 * 1024u) << divisions << ' ' << spacing_m;
      EXPECT_EQ(counts.over_budget, std::size_t(over_budget));
    }
  }
}

// Float decides no part of a triangle in a camera's plane. 1024 cuts into four make 3073 parts, of
// which each corner is tested.
TEST(CpuDetection, CutsEachTriangleInto4096PartsAtMost) {
  const CollisionHull hull({columns(0, 64)});
  const collision::Triangle t{Vector3d(0.5, 0.1, 0), Vector3d(0.9, 0.2, 0), Vector3d(0.6, 0.7, 0)};
  const collision::Bvh tree(mesh_of({t, t}));
  const collision::DetectionObject object{&tree};
  for (const double spacing_m : {0.0, 3e-3}) {
    collision::CpuDetectionCounts counts;
    const auto found =
        collision::detect(hull.query, {&object, 1}, {.spacing_m = spacing_m}, &counts)[0];
    EXPECT_EQ(found.verdict, collision::CollisionVerdict::undecided);
    EXPECT_EQ(counts.points_in_double, 2 * 3 * 3073u);
    EXPECT_EQ(counts.over_budget, 2u);
  }
}

// A triangle of 2 cm that may have 100 points gets 64 samples instead of one per 10 um.
TEST(CpuDetection, FewerSamplesThanRequestedAreTruncated) {
  const CollisionHull hull(silhouettes_of({ball(kOrigin, 0.05)}, ring(4, 1.2, 0.6, 300, 0.5)));
  for (const double x_m : {0.0, 0.04}) {  // wholly in the hull, and partly
    const Vector3d p(x_m, 0, 0);
    const collision::Bvh tree(mesh_of({{p, p + Vector3d(0.02, 0, 0), p + Vector3d(0, 0.02, 0)}}));
    const collision::DetectionObject object{&tree};
    for (const bool coarser : {true, false}) {
      const auto found = collision::detect(
          hull.query, {&object, 1},
          {.spacing_m = coarser ? 1e-5 : 2e-3, .max_points = coarser ? 100u : 1000u})[0];
      EXPECT_EQ(found.truncated, coarser);
      EXPECT_GT(found.points.size(), 5u);
      EXPECT_LT(found.points.size(), coarser ? 67u : 200u);
    }
  }
}

TEST(CpuDetection, DefaultsAreHalfAMillimetreThreeMillimetresAnd4096Points) {
  const CollisionHull border({columns(0, 32), columns(32, 64)}),
      full(silhouettes_of({ball(kOrigin, 0.3)}, ring(3, 1.5, 0.6, 100, 1)));
  const collision::Bvh on_border(
      mesh_of({{Vector3d(0, -45e-5, 1), Vector3d(0, 45e-5, 1), Vector3d(0, 0, 1.0003)}})),
      sheet(geometry::curtain_mesh(0.4, 0.4, 12, 12, 0, 1));
  const auto points_in_double = [&](const collision::DetectionOptions& options) {
    const collision::DetectionObject object{&on_border};
    collision::CpuDetectionCounts counts;
    collision::detect(border.query, {&object, 1}, options, &counts);
    return std::pair(counts.points_in_double, counts.over_budget);
  };
  EXPECT_EQ(points_in_double({}), points_in_double({.eps_m = 0.5e-3}));
  EXPECT_NE(points_in_double({}), points_in_double({.eps_m = 1e-3}));
  EXPECT_NE(points_in_double({}), points_in_double({.eps_m = 0.25e-3}));
  const auto points = [&](const collision::DetectionOptions& options) {
    const collision::DetectionObject object{&sheet, at({0, 0.2, 0})};
    return collision::detect(full.query, {&object, 1}, options)[0].points.size();
  };
  EXPECT_EQ(points({}), 4096u);
  EXPECT_EQ(points({.max_points = 100'000}), points({.spacing_m = 3e-3, .max_points = 100'000}));
  EXPECT_NE(points({.max_points = 100'000}), points({.spacing_m = 6e-3, .max_points = 100'000}));
  EXPECT_GT(points({.max_points = 100'000}), 8192u);
}

// A ball in each of 27 cells of a box, and beside each face at 9 places. The box is not cubic, and
// its center is not the origin of the object's frame.
TEST(MayHoldHull, FindsABallInAnyCellAndNoneBesideTheBox) {
  std::vector<geometry::Camera> cameras = ring(5, 1.2, 0.5, 100, 1.0);
  for (const geometry::Camera& c : ring(4, 1.2, -0.4, 100, 1.0)) cameras.push_back(c);
  cameras.push_back(camera_at({0.01, 0, 1.2}, 100, 1.0));
  const Vector3d size_m(0.24, 0.32, 0.4), shift_m(0.3, -0.2, 0.1);
  geometry::Mesh mesh = geometry::box_mesh(size_m);
  for (Vector3d& v : mesh.vertices_m) v += shift_m;
  const collision::Bvh tree(mesh);
  const collision::DetectionObject object{&tree, at(-shift_m)};
  const auto holds = [&](const Vector3d& center_m) {
    const CollisionHull hull(silhouettes_of({ball(center_m, 0.006)}, cameras));
    return collision::may_hold_hull(collision::object_maps(hull.query, object), tree);
  };
  const double places[] = {-7.0 / 16, 1.0 / 16, 7.0 / 16};  // centers of cells
  for (const double x : places)
    for (const double y : places) {
      for (const double z : places)
        EXPECT_TRUE(holds(size_m.cwiseProduct(Vector3d(x, y, z)))) << x << ' ' << y << ' ' << z;
      for (Eigen::Index axis = 0; axis < 3; ++axis)
        for (const double side : {-1.0, 1.0}) {
          Vector3d p;
          p[axis] = side * (0.5 * size_m[axis] + 0.05);
          p[(axis + 1) % 3] = x * size_m[(axis + 1) % 3];
          p[(axis + 2) % 3] = y * size_m[(axis + 2) % 3];
          EXPECT_FALSE(holds(p)) << p.transpose();
        }
    }
}

// Each camera alone sees the first
// triangle wholly on object pixels; both see only the second one.
TEST(CpuDetection, ACameraTooWideForFloatStillLimitsTheHull) {
  const CollisionHull hull({columns(0, 64), too_wide_for_float({0, 64})});
  const auto triangle_at = [](double x_m) {
    const Vector3d p(x_m, 0, 1);
    return collision::Triangle{p, p + Vector3d(0.02, 0, 0), p + Vector3d(0, 0.02, 0)};
  };
  const collision::Bvh tree(mesh_of({triangle_at(0.05), triangle_at(0.25)}));
  const collision::DetectionObject object{&tree};
  EXPECT_EQ(collision::object_maps(hull.query, object).maps.size(), 1u);
  EXPECT_EQ(collision::object_maps(hull.query, object).rule.unmapped, 1);
  const CollisionHull seen({columns(0, 64), too_wide_for_float({0, 64})}, 1,
                           {hull::Limits::seen, 2});
  for (const CollisionHull* by_rule : {&hull, &seen})
    for (const double spacing_m : {0.0, 3e-3}) {
      const auto found =
          collision::detect(by_rule->query, {&object, 1}, {.spacing_m = spacing_m})[0];
      EXPECT_EQ(found.triangles, std::vector<std::uint32_t>{1});
      EXPECT_TRUE(found.undecided.empty());
    }
  // No box is certified without the wide camera's map.
  const collision::Bvh beside(mesh_of({triangle_at(0.05)}));
  const collision::DetectionObject free{&beside};
  const auto found = collision::detect(hull.query, {&free, 1})[0];
  EXPECT_EQ(found.verdict, collision::CollisionVerdict::free);
  EXPECT_TRUE(found.hull_in_box);
}

}  // namespace
}  // namespace fivepipe::test
