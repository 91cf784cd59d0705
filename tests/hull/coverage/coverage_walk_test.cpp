// The SIMD kernel of coverage walks against the walks themselves, and rays that few views have.
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>

#include "common/hull/coverage/coverage_walk_simd.h"
#include "tests/support/hull/coverage.h"

namespace fivepipe::hull {
namespace {

using namespace test;
using Eigen::Vector3d;

// The maps of some cameras, prepared for the rays of one view.
struct PreparedMaps {
  std::vector<WalkedMap> walked;
  std::vector<SkipMap> skip_maps;
  std::vector<MapFromView> map_from_view;

  PreparedMaps(std::span<const CoverageSilhouette> silhouettes, const geometry::Camera& view)
      : skip_maps(silhouettes.size()) {
    for (std::size_t i = 0; i < silhouettes.size(); ++i) {
      const CoverageSilhouette& s = silhouettes[i];
      const ObjectPixels half = s.map.half_covered();
      const CellsOfMap cells = cells_of(half);
      walked.emplace_back(s.map, half, cells.all);
      skip_maps[i].assign(cells.any);
      for (int box = 0; box < kQuadrants; ++box) skip_maps[i].make(Quadrant(box));
      map_from_view.push_back(hull::map_from_view(cell_camera(s.camera), view));
    }
  }
  CoverageEntry by_walks(double u_px, double v_px, const RayRange& range) const {
    std::vector<CoverageWalk> walks;
    for (std::size_t i = 0; i < walked.size(); ++i) {
      walks.emplace_back(map_from_view[i], walked[i], skip_maps[i]);
      walks.back().set_row(v_px);
      walks.back().set_ray(u_px, range);
    }
    return next_entry(walks, range);
  }
  std::vector<CoverageEntry> by_kernel(const CoverageSimdRays& rays) const {
    std::vector<CoverageSimdCamera> cameras;
    for (std::size_t i = 0; i < walked.size(); ++i)
      cameras.emplace_back(map_from_view[i], walked[i]);
    std::vector<CoverageEntry> entries(rays.u_px.size());
    simd_entries(cameras, rays, entries);
    return entries;
  }
};

// Random rays: their ranges begin before, in and behind the object.
TEST(CoverageWalkSimd, EqualsTheWalksWithEveryInstructionSet) {
  hwy::SetSupportedTargetsForTest(0);
  const std::int64_t targets = hwy::SupportedTargets();
  int resolved = 0, entered = 0, rays = 0;
  for (int seed = 1; seed <= 12; ++seed) {
    test::Random random(seed);
    const auto cameras = test::random_cameras(random, 1 + seed % 5, 160, 121);
    auto silhouettes = covered(test::random_object(random, 3), cameras);
    if (seed % 3 == 0)
      for (CoverageSilhouette& s : silhouettes) s.map = random_map(random, 160, 121, 0.6);
    const geometry::Camera view = test::random_camera(random, 90, 70, 0.8);
    const PreparedMaps maps(silhouettes, view);
    for (int v = 0; v < 70; v += 5) {
      std::vector<double> u_px, begin, end;
      for (int u = 0; u < 83; ++u) {
        u_px.push_back(u);
        begin.push_back(uniform(random, 0.05, 2.5));
        end.push_back(begin.back() + uniform(random, 0.1, 2));
      }
      std::vector<CoverageEntry> first;
      for (std::int64_t left = targets; left != 0; left &= left - 1) {
        hwy::SetSupportedTargetsForTest(left & -left);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        const auto entries = maps.by_kernel({double(v), u_px, begin, end});
        if (first.empty()) first = entries;
        for (std::size_t i = 0; i < entries.size(); ++i) {
          ASSERT_EQ(entries[i].resolved, first[i].resolved);
          ASSERT_EQ(entries[i].t, first[i].t);
          ASSERT_EQ(entries[i].camera, first[i].camera);
        }
      }
      for (std::size_t i = 0; i < first.size(); ++i) {
        ++rays;
        const CoverageEntry expected = maps.by_walks(u_px[i], v, {begin[i], end[i]});
        // An unresolved ray goes on from there.
        EXPECT_LE(first[i].t, expected.t + 1e-12) << seed << ' ' << v << ' ' << i;
        if (!first[i].resolved) continue;
        ++resolved;
        entered += expected.t != kNever;
        if (expected.t == kNever)
          EXPECT_EQ(first[i].t, kNever) << seed << ' ' << v << ' ' << i;
        else
          EXPECT_NEAR(first[i].t, expected.t, 1e-12) << seed << ' ' << v << ' ' << i;
        EXPECT_EQ(first[i].camera, expected.camera);
      }
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GT(resolved, 1000) << "of " << rays;
  EXPECT_GT(entered, 300);
}

// Also for rays that the kernel leaves after it has moved them.
TEST(CoverageWalkSimd, TheLimitingCameraIsThatOfTheWalks) {
  int compared = 0;
  for (int seed = 1; seed <= 24; ++seed) {
    test::Random random(seed);
    auto silhouettes =
        covered({test::random_cameras(random, 4, 80, 61), test::random_object(random, 3)});
    if (seed % 2 == 0)
      for (CoverageSilhouette& s : silhouettes) s.map = random_map(random, 80, 61, 0.7);
    const View view{test::random_camera(random, 64, 48, 0.8), 0.05, 5.0};
    const PreparedMaps maps(silhouettes, view.camera);
    const SurfaceTile tile = CoverageHull(test_pool(), silhouettes).surface(view, {0, 0, 64, 48});
    for (int i = 0; i < 64 * 48; ++i) {
      const CoverageEntry expected = maps.by_walks(i % 64, i / 64, {view.near_m, view.far_m});
      if (expected.t == kNever || expected.camera < 0) continue;
      const auto& limiting = silhouettes[std::size_t(expected.camera)];
      const geometry::Ray ray = geometry::ray_through(view.camera, Eigen::Vector2d(i % 64, i / 64));
      if (!outward_normal_world(limiting, ray.origin_world_m + expected.t * ray.direction_world))
        continue;
      ++compared;
      EXPECT_EQ(tile.limiting[i], expected.camera) << seed << ' ' << i;
    }
  }
  EXPECT_GT(compared, 3000);
}

// Columns [first, end) of the image are covered.
CoverageMap columns(int width, int height, std::initializer_list<std::pair<int, int>> runs) {
  CoverageMap map(width, height);
  for (const auto& [first, end] : runs)
    for (int v = 0; v < height; ++v)
      for (int u = first; u < end; ++u) map.set(u, v, 255);
  return map;
}

// Two cameras face each other. The ray leaves the silhouette of B before it enters that of A, and
// is in B's again only behind A's plane.
TEST(CoverageWalk, ARayBehindACameraIsNotInItsSilhouette) {
  const geometry::Camera a{{101, 75, 200, 200, 50, 37},
                           geometry::look_at({2, 0, 0}, {0, 0, 0}, {0, 0, 1})},
      b{{201, 75, 2000, 2000, 100, 37}, geometry::look_at({-2, 0, 0}, {0, 0, 0}, {0, 0, 1})};
  const bool a_sees_y_right = geometry::project(a, {0, 0.1, 0})->x() > 50;
  const auto at = [](bool right, int center, int first, int end) {
    return right ? std::pair(center + first, center + end)
                 : std::pair(center - end + 1, center - first + 1);
  };
  const std::vector<CoverageSilhouette> silhouettes{
      {a, columns(101, 75, {at(a_sees_y_right, 50, 8, 41)})},
      {b, columns(201, 75, {at(!a_sees_y_right, 100, 60, 71), at(!a_sees_y_right, 100, 86, 101)})}};
  const Vector3d eye(-1, 0.02, 0), direction(1, 0.05, 0);
  const View view{
      {{3, 3, 1000, 1000, 1, 1}, geometry::look_at(eye, eye + direction, {0, 0, 1})}, 0.05, 5};
  const DepthTile tile = depth_of(silhouettes, view);
  Counts counts;
  expect_definition(counts, silhouettes, geometry::ray_through(view.camera, Eigen::Vector2d(1, 1)),
                    view, tile.depth_m[4]);
  EXPECT_EQ(tile.depth_m[4], kNoHull);
}

// The ray ends at the camera, so that its image is a point, which has a coverage of one half.
TEST(CoverageWalk, APointOnTheBorderIsInside) {
  const geometry::Camera a{{100, 75, 200, 200, 49.5, 37},
                           geometry::look_at({2, 0, 0}, {0, 0, 0}, {0, 0, 1})},
      b{{100, 75, 50, 50, 49.5, 37}, geometry::look_at({0, 2, 0}, {0, 0, 0}, {0, 0, 1})};
  const std::vector<CoverageSilhouette> silhouettes{{a, columns(100, 75, {{0, 50}})},
                                                    {b, columns(100, 75, {{0, 100}})}};
  const View view{
      {{3, 3, 1000, 1000, 1, 1}, geometry::look_at({0, 0, 0}, {2, 0, 0}, {0, 0, 1})}, 0.05, 5};
  EXPECT_NEAR(depth_of(silhouettes, view).depth_m[4], 0.05, 1e-6);
}

}  // namespace
}  // namespace fivepipe::hull
