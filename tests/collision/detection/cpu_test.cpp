// Backend `cpu` of collision detection: threads, reuse of memory, counters and very large meshes.
// backends_test.cpp and certified_properties_test.cpp test its results.
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <functional>
#include <limits>

#include "common/collision/detection/contact_points.h"
#include "common/collision/detection/cpu/cpu_detection.h"
#include "common/collision/detection/cpu/detection_common.h"
#include "common/collision/detection/cpu/triangle_walk.h"
#include "tests/support/collision/triangles.h"
#include "tests/support/process/memory.h"
#include "tests/support/sanitizer.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

TEST(CpuDetection, IsIndependentOfThreadsAndObjectOrder) {
  Random random(3);
  std::vector<collision::Bvh> trees;
  std::vector<collision::DetectionObject> objects;
  for (int i = 0; i < 7; ++i) trees.emplace_back(mesh_of(random_triangles(random, 90)));
  for (const collision::Bvh& tree : trees) objects.push_back({&tree});
  const CollisionHull one(hand_like(), 1), three(hand_like(), 3);
  const collision::DetectionOptions options{.spacing_m = 3e-3};
  const auto first = collision::detect(one.query, objects, options),
             second = collision::detect(three.query, objects, options);
  std::reverse(objects.begin(), objects.end());
  const auto reversed = collision::detect(three.query, objects, options);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    EXPECT_EQ(first[i].points, second[i].points);
    EXPECT_EQ(first[i].triangles, second[i].triangles);
    EXPECT_EQ(first[i].points, reversed[objects.size() - 1 - i].points);
  }
}

// A CpuDetection keeps its memory but no result of an earlier call.
TEST(CpuDetection, ReusedDetectionEqualsAFreshOne) {
  const CollisionHull hull(hand_like()),
      other(silhouettes_of({ball({0.05, 0, 0}, 0.03)}, ring(4, 1.2, 0.6, 300, 0.5)), 3), none({});
  const collision::Bvh large(geometry::sphere_mesh(0.05, 4)), small(geometry::sphere_mesh(0.02, 2));
  const std::vector<std::vector<collision::DetectionObject>> requests{
      {{&large}, {&small}},
      {{&small}, {&large, at({1, 0, 0})}},
      {{&small, at({0, 1, 0})}},
      {{&large, at({0.03, 0, 0})}}};
  collision::CpuDetection reused;
  for (const double spacing_m : {5e-4, 0.0, 2e-3})
    for (const std::size_t max_points : {std::size_t{1} << 20, std::size_t{100}})
      for (const CollisionHull* h : {&hull, &other, &none})
        for (const auto& objects : requests) {
          const collision::DetectionOptions options{.spacing_m = spacing_m,
                                                    .max_points = max_points};
          const auto found = reused.detect(h->query, objects, options);
          const auto fresh = collision::detect(h->query, objects, options);
          ASSERT_EQ(found.size(), fresh.size());
          for (std::size_t i = 0; i < fresh.size(); ++i) {
            EXPECT_EQ(found[i].points, fresh[i].points);
            EXPECT_EQ(found[i].triangles, fresh[i].triangles);
            EXPECT_EQ(found[i].verdict, fresh[i].verdict);
          }
        }
}

// Close to a camera's plane float cannot decide, and double takes over. The number of tests in
// double must stay bounded even if the triangle touches the plane.
TEST(CpuDetection, TestsFewPointsInDoubleAtACamerasPlane) {
  hull::ObjectPixels block(640, 480), all(640, 480);
  for (int v = 0; v < 480; ++v)
    for (int u = 0; u < 640; ++u) {
      all.set(u, v);
      if (u > 280 && u < 360 && v > 200 && v < 280) block.set(u, v);
    }
  const geometry::Pinhole pinhole{640, 480, 500, 500, 319.5, 239.5};
  const geometry::Camera ahead{pinhole, geometry::look_at(kOrigin, {1, 0, 0})},
      other{pinhole, geometry::look_at({0, 1, 0}, {0, 4, 0})};
  const CollisionHull hull({{ahead, block}, {other, all}});
  for (const double in_front_m : {0.07, 0.05, 0.02, 1e-4, 0.0}) {
    const Vector3d p(in_front_m, 4, 0);
    const collision::Bvh tree(mesh_of({{p, p + Vector3d(0, 0.01, 0), p + Vector3d(0, 0, 0.01)}}));
    const collision::DetectionObject object{&tree};
    for (const double spacing_m : {0.0, 3e-3}) {
      collision::CpuDetectionCounts counts;
      collision::detect(hull.query, {&object, 1}, {.spacing_m = spacing_m}, &counts);
      EXPECT_LT(counts.points_in_double, 20000u) << in_front_m;
    }
  }
}

// write() computes the samples of a part in the order in which the part is divided.
TEST(ContactPoints, SamplesAreTheCellCenters) {
  const collision::Triangle t{Vector3d(1, 2, 3), Vector3d(1.4, 2, 3.1), Vector3d(0.9, 2.5, 3)};
  for (const int n : {1, 2, 3, 12}) {
    const double step = 1.0 / n;
    const Vector3d u = t[1] - t[0], v = t[2] - t[0];
    collision::ContactPoints points;
    points.add(Vector3d(7, 7, 7));
    points.begin_triangle();
    points.add(
        collision::SampledPart{t[0] + step / 3 * u, v, 0, step, step * u, step * (u + v) / 3, n});
    const Vector3d top = points.back();
    points.add(Vector3d(8, 8, 8));
    const auto count = std::size_t(n * n + 1);
    ASSERT_EQ(points.size(), count + 1);
    std::vector<collision::CollisionPoint> written(count + 1, {Vector3d::Zero(), 5});
    points.write(points.first_run(), 3, written.data(), count);
    std::size_t i = 0;
    for (int row = 0; row < n; ++row)
      for (int column = 0; column + row < n; ++column)
        for (const double off : {1.0 / 3, 2.0 / 3}) {
          if (off > 0.5 && column + row + 1 == n) continue;
          EXPECT_LT(
              (written[i].p_world_m - (t[0] + (column + off) * step * u + (row + off) * step * v))
                  .norm(),
              1e-14);
          EXPECT_EQ(written[i++].triangle, 3u);
        }
    EXPECT_EQ(top, written[i - 1].p_world_m);
    EXPECT_EQ(written[i], (collision::CollisionPoint{Vector3d(8, 8, 8), 3}));
    EXPECT_EQ(written[i + 1].triangle, 5u);  // not written
  }
}

TEST(ContactPoints, ClearedPointsStartAgain) {
  collision::ContactPoints points;
  const collision::SampledPart part{kOrigin,           Vector3d::UnitY(), 0, 1,
                                    Vector3d::UnitX(), Vector3d::UnitZ(), 2};
  for (int round = 0; round < 2; ++round) {
    points.begin_triangle();
    EXPECT_EQ(points.first_run(), 0u);
    points.add(Vector3d(1, 2, 3));
    points.add(part);
    points.begin_triangle();
    EXPECT_EQ(points.first_run(), 2u);
    points.add(part);
    points.add(Vector3d(4, 5, 6));
    points.add(Vector3d(7, 8, 9));  // in the run of the point before
    points.begin_triangle();
    EXPECT_EQ(points.first_run(), 4u);
    points.add(Vector3d(1, 1, 1));
    EXPECT_EQ(points.size(), 12u);
    std::vector<collision::CollisionPoint> written(3, {kOrigin, 0});
    points.write(4, 9, written.data(), 1);
    EXPECT_EQ(written[0], (collision::CollisionPoint{Vector3d(1, 1, 1), 9}));
    points.write(3, 8, written.data(), 2);
    EXPECT_EQ(written[0], (collision::CollisionPoint{Vector3d(4, 5, 6), 8}));
    EXPECT_EQ(written[1], (collision::CollisionPoint{Vector3d(7, 8, 9), 8}));
    EXPECT_EQ(written[2], (collision::CollisionPoint{kOrigin, 0}));
    points.clear();
    EXPECT_EQ(points.size(), 0u);
  }
}

// The counts are those of a plain descent with the same kernels, and start again in each call.
TEST(CpuDetection, CountsItsBoxesAndTriangles) {
  Random random(17);
  const CollisionHull hull(hand_like(), 2);
  const collision::Bvh scattered(mesh_of(random_triangles(random, 900))),
      sphere(geometry::sphere_mesh(0.05, 4));
  const std::vector<collision::DetectionObject> objects{
      {&scattered}, {&sphere, at({0.03, 0, 0})}, {&sphere, at({0.5, 0.5, 0})}};
  collision::CpuDetectionCounts expected;
  for (const collision::DetectionObject& object : objects) {
    const auto maps = collision::object_maps(hull.query, object).maps;
    ASSERT_EQ(maps.size(), 4u);
    const std::function<void(int, int)> descend = [&](int level, int node) {
      ++expected.boxes;
      const auto free = collision::classify_boxes(maps, object.tree->boxes(level, node)).free;
      for (int child = 0; child < 16; ++child) {
        const int index = 16 * node + child;
        if (free >> child & 1) continue;
        if (level > 0) {
          descend(level - 1, index);
          continue;
        }
        const int count = int(object.tree->triangles_of(index).size());
        expected.triangles_classified += std::size_t(count);
        const auto bits = collision::classify_leaf(maps, object.tree->leaf(index), count);
        expected.triangles_walked += std::size_t(count - std::popcount(bits.free));
      }
    };
    descend(object.tree->levels() - 1, 0);
  }
  collision::CpuDetection detection;
  for (int call = 0; call < 2; ++call) {
    collision::CpuDetectionCounts counts;
    detection.detect(hull.query, objects, kVerdictOnly, &counts);
    EXPECT_EQ(counts.boxes, expected.boxes);
    EXPECT_EQ(counts.triangles_classified, expected.triangles_classified);
    EXPECT_EQ(counts.triangles_walked, expected.triangles_walked);
    EXPECT_EQ(counts.over_budget, 0u);
    EXPECT_GT(counts.points_in_double, 0u);  // samples at a pixel's border
    EXPECT_LT(counts.points_in_double, 40u);
  }
  EXPECT_GT(expected.boxes, 10u);
  EXPECT_GT(expected.triangles_walked, 100u);
  EXPECT_LT(expected.triangles_walked, expected.triangles_classified);
}

// For parts of eps_m / 16 a triangle of 460 m has to be cut more often than allowed. The small ones
// are not cut.
TEST(CpuDetection, CountsTrianglesOverBudget) {
  std::vector<hull::Silhouette> silhouettes =
      silhouettes_of({ball(kOrigin, 0.05)}, ring(2, 1.2, 0.6, 300, 0.5));
  for (hull::Silhouette& s : silhouettes)
    for (int v = 0; v < 300; ++v) s.pixels.set_run(0, 300, v);
  const CollisionHull hull(silhouettes);
  const Vector3d eye = geometry::camera_center_world_m(silhouettes[0].camera), y(0, 200, 0);
  const collision::Triangle through = {100 * eye, -100 * eye + y, -100 * eye - y},
                            behind = {1.1 * eye, 1.3 * eye, 1.2 * eye + Vector3d(0.1, 0, 0)},
                            within = {kOrigin, Vector3d(0.05, 0, 0), Vector3d(0, 0.05, 0)};
  const collision::Bvh tree(mesh_of({through, behind, within, through}));
  const collision::DetectionObject object{&tree};
  collision::CpuDetection detection;
  for (const double spacing_m : {0.0, 0.02, 0.0}) {
    collision::CpuDetectionCounts counts;
    const auto found =
        detection.detect(hull.query, {&object, 1},
                         {.eps_m = 1e-6, .spacing_m = spacing_m, .max_points = 4096}, &counts);
    EXPECT_TRUE(test::holds(found[0].triangles, 2));
    EXPECT_EQ(found[0].triangles.size() + found[0].undecided.size(), 3u);
    EXPECT_FALSE(test::holds(found[0].triangles, 1) || test::holds(found[0].undecided, 1));
    EXPECT_EQ(counts.over_budget, 2u) << spacing_m;
    EXPECT_GT(counts.points_in_double, 0u);
  }
}

// The grid is the smallest of 1, 2, 3, 4, 6, 8, 12, ... divisions whose samples are near enough, or
// the largest with at most max_points samples.
TEST(TriangleGrid, IsTheCoarsestOneThatIsFineEnough) {
  Random random(18);
  int coarser = 0;
  for (int i = 0; i < 3000; ++i) {
    const collision::Triangle t = random_triangle(random, 0.1, 0.1);
    const double longest_m =
        std::max({(t[0] - t[1]).norm(), (t[1] - t[2]).norm(), (t[2] - t[0]).norm()});
    const double spacing_m = i % 5 == 0 ? 0 : std::exp(uniform(random, std::log(1e-4), 0)),
                 eps_m = std::exp(uniform(random, std::log(1e-5), std::log(1e-2)));
    const std::size_t max_points = std::size_t(std::exp(uniform(random, 0, 9)));
    const collision::TriangleGrid grid =
        collision::triangle_grid(t, {eps_m, max_points}, spacing_m);
    // Sample centers are two thirds of a part's edge apart.
    const double needed = spacing_m > 0 ? 2.0 / 3 * longest_m / spacing_m : 0;
    int expected = 1, start = 1;
    for (const int next : {2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192}) {
      if (expected >= needed) break;
      // Three quarters of a power of two are a choice only if they are fine enough.
      const bool three = next % 3 == 0;
      const int room = three ? next / 3 * 4 : next;
      if (double(room) * room > double(max_points) || (three && next < needed)) continue;
      expected = next, start = three ? 3 : 1;
    }
    EXPECT_EQ(grid.divisions, expected) << i;
    EXPECT_EQ(grid.start, start) << i;
    EXPECT_EQ(grid.coarser, expected < needed) << i;
    coarser += grid.coarser;
    // The finest parts are the first ones of at most a sixteenth of eps_m.
    double units = expected;
    while (longest_m / units > eps_m / 16) units *= 2;
    EXPECT_EQ(grid.units, units) << i;
  }
  EXPECT_GT(coarser, 100);
  // Float cannot represent a finer grid.
  const collision::Triangle huge{kOrigin, Vector3d(1e4, 0, 0), Vector3d(0, 1e4, 0)};
  EXPECT_EQ(collision::triangle_grid(huge, {1e-6, 1}, 0).units, 2 * collision::kMaxUnits);
}

std::size_t resident_mb() { return test::resident_bytes(getpid()) >> 20; }

// A triangle of this sheet is 0.6 x 1.3 mm, less than a pixel.
TEST(CpuDetection, FindsTheHandInASheetOfTenMillionTriangles) {
  using Clock = std::chrono::steady_clock;
  const auto seconds_since = [](Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
  };
  const CollisionHull hull(hand_like());
  geometry::Mesh mesh = geometry::curtain_mesh(2, 2, 3200, 1600, 0, 1);
  const std::size_t count = mesh.triangles.size(), before_mb = resident_mb();
  ASSERT_GT(count, 10'000'000u);
  const auto start = Clock::now();
  const collision::Bvh tree(std::move(mesh));
  const double build_s = seconds_since(start);
  const std::size_t tree_mb = resident_mb() - before_mb;
  collision::CpuDetection detection;
  const collision::DetectionObject object{&tree, sheet_through_the_hand()};
  collision::ObjectCollision found;
  double detect_s = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 5; ++run) {
    const auto begin = Clock::now();
    const auto result = detection.detect(hull.query, {&object, 1}, kVerdictOnly);
    detect_s = std::min(detect_s, seconds_since(begin));
    found = result[0];
  }
  std::printf(
      "%zu triangles: BVH of %zu MiB besides the mesh, built in %.1f s; detection in %.2f ms; "
      "%zu colliding, %zu undecided\n",
      count, tree_mb, build_s, 1e3 * detect_s, found.triangles.size(), found.undecided.size());
  if (!test::kHasSanitizer) {  // whose own memory would count
    EXPECT_LT(tree_mb, 1024u);
  }
  EXPECT_GT(found.triangles.size(), 5000u);
  EXPECT_LT(found.undecided.size(), found.triangles.size() / 100);
  // A triangle whose center is in the hull collides. Because the triangles are small, most
  // colliding ones have their center in the hull.
  std::size_t centers = 0, missed = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Vector3d center = Vector3d::Zero();
    for (const std::uint32_t v : tree.mesh().triangles[i]) center += tree.mesh().vertices_m[v] / 3;
    center = object.world_from_object * center;
    if (std::abs(center.x()) > 0.2 || std::abs(center.y()) > 0.2 ||
        !hull::in_hull(hull.silhouettes, center))
      continue;
    ++centers;
    missed += !test::holds(found.triangles, std::uint32_t(i));
  }
  EXPECT_EQ(missed, 0u);
  EXPECT_GT(centers, found.triangles.size() / 2);
}

}  // namespace
}  // namespace fivepipe::test
