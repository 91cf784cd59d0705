#include "common/surface/swept_volume.h"

#include <gtest/gtest.h>

#include <thread>

#include "common/geometry/closed_mesh.h"
#include "common/hull/oracle/reference.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/not_finite.h"
#include "tests/surface/mesh_checks.h"

namespace fivepipe::surface {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using Eigen::Vector3i;

const AlignedBox3d kBox(Vector3d(-0.25, -0.2, -0.2), Vector3d(0.25, 0.2, 0.2));

struct Session {
  std::vector<std::vector<hull::Silhouette>> frames;
  hull::HullRule rule{.within_world_m = kBox};
};

// A forearm-like capsule with a ball that moves along an arc.
Session session(int frames, int cameras, hull::Limits limits = hull::Limits::all) {
  test::Random random(21);
  const auto rig = test::random_cameras(random, cameras, 320, 243);
  Session result;
  result.rule.limits = limits;
  for (int i = 0; i < frames; ++i) {
    const double angle = 0.9 * i / frames;
    const Vector3d hand(0.15 * std::cos(angle) - 0.1, 0.15 * std::sin(angle), 0.02);
    result.frames.push_back(test::silhouettes_of(
        {{hand, hand, 0.04}, {hand, hand + Vector3d(0.02, -0.1, 0.01), 0.02}}, rig));
  }
  return result;
}

void add(SweptVolume& swept, const Session& session, std::size_t frame) {
  base::WorkerPool pool(1);
  hull::CpuHull hull(pool, session.frames[frame], session.rule);
  swept.add(hull::HullQuery(hull));
}

SweptSurface swept_by(const Session& session, double cell_m = 0.005) {
  SweptVolume swept({.within_world_m = kBox, .cell_m = cell_m});
  for (std::size_t i = 0; i < session.frames.size(); ++i) add(swept, session, i);
  return swept.surface();
}

bool holds(const Session& session, const Vector3d& p_m) {
  return std::ranges::any_of(session.frames, [&](const auto& silhouettes) {
    return hull::in_hull(silhouettes, p_m, session.rule);
  });
}

// Every one of many sampled points of the hulls.
TEST(SweptVolume, ContainsTheHullOfEachFrame) {
  for (const auto& [limits, points] :
       {std::pair{hull::Limits::all, 1'000'000}, {hull::Limits::seen, 50'000}}) {
    const Session frames = session(6, 4, limits);
    const SweptSurface surface = swept_by(frames);
    EXPECT_EQ(test::manifold_fault(surface.mesh), "");
    EXPECT_EQ(test::manifold_fault(test::merged(surface.mesh)), "");
    const test::MeshInside inside(surface.mesh, 0.005);
    const AlignedBox3d bounds = geometry::bounds_m(surface.mesh);
    test::Random random(22);
    int found = 0, missing = 0;
    while (found < points) {
      const Vector3d p{test::uniform(random, bounds.min().x(), bounds.max().x()),
                       test::uniform(random, bounds.min().y(), bounds.max().y()),
                       test::uniform(random, bounds.min().z(), bounds.max().z())};
      if (!holds(frames, p)) continue;
      ++found;
      missing += !inside.contains(p);
    }
    EXPECT_EQ(missing, 0);
    // No hull point is beyond the bounds of the mesh, either.
    for (int i = 0; i < points / 10; ++i) {
      const Vector3d p =
          kBox.min() + Vector3d{test::uniform(random, 0, 1), test::uniform(random, 0, 1),
                                test::uniform(random, 0, 1)}
                           .cwiseProduct(kBox.sizes());
      EXPECT_TRUE(bounds.contains(p) || !holds(frames, p)) << p.transpose();
    }
  }
}

// The cells of a grid that the hull touches, by lines along each axis: a lower bound of the truth.
BitGrid touched_cells(const Session& session, const AlignedBox3d& grid_m, double cell_m) {
  constexpr int kLines = 3;  // per cell along each other axis
  const Vector3i cells = (grid_m.sizes() / cell_m).array().round().cast<int>();
  BitGrid touched(cells);
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = 0; i < kLines * cells[u]; ++i)
      for (int k = 0; k < kLines * cells[v]; ++k) {
        Vector3d begin_m = grid_m.min();
        begin_m[u] += cell_m * (i + 0.5) / kLines;
        begin_m[v] += cell_m * (k + 0.5) / kLines;
        for (const auto& silhouettes : session.frames)
          for (const hull::Interval& in :
               hull::reference_intervals(silhouettes, {begin_m, Vector3d::Unit(axis)}, 0,
                                         grid_m.sizes()[axis], session.rule)) {
            const int last = std::min(int(in.leave / cell_m), cells[axis] - 1);
            for (int c = int(in.enter / cell_m); c <= last; ++c) {
              Vector3i cell;
              cell[axis] = c, cell[u] = i / kLines, cell[v] = k / kLines;
              touched.set(cell.x(), cell.y(), cell.z());
            }
          }
      }
  }
  return touched;
}

// Against the cells that the reference finds touched.
TEST(SweptVolume, IsAtMost5PercentLargerThanTheTouchedCells) {
  const Session frames = session(2, 4);
  const double cell_m = 0.005;
  const SweptSurface surface = swept_by(frames, cell_m);
  const AlignedBox3d bounds = geometry::bounds_m(surface.mesh);
  const BitGrid touched = touched_cells(frames, bounds, cell_m);
  const test::MeshInside inside(surface.mesh, cell_m);
  int missing = 0;
  for (int z = 0; z < touched.size().z(); ++z)
    for (int y = 0; y < touched.size().y(); ++y)
      for (int x = 0; x < touched.size().x(); ++x)
        missing += touched.at(x, y, z) &&
                   !inside.contains(bounds.min() + cell_m * Vector3d(x + 0.5, y + 0.51, z + 0.52));
  EXPECT_EQ(missing, 0);
  EXPECT_GT(touched.count(), 3000u);
  EXPECT_LE(double(surface.cells), 1.05 * double(touched.count()));
  EXPECT_NEAR(surface.volume_m3, double(surface.cells) * std::pow(cell_m, 3), 1e-9);
}

// The volume of the sweep itself, by the definition of the hull.
TEST(SweptVolume, EstimatesTheVolumeOfTheHulls) {
  const Session frames = session(5, 4);
  const SweptSurface surface = swept_by(frames);
  const double step_m = 0.004;
  std::size_t count = 0;
  for (double z = kBox.min().z() + step_m / 2; z < kBox.max().z(); z += step_m)
    for (double y = kBox.min().y() + step_m / 2; y < kBox.max().y(); y += step_m)
      for (double x = kBox.min().x() + step_m / 2; x < kBox.max().x(); x += step_m)
        count += holds(frames, {x, y, z});
  const double truth_m3 = double(count) * std::pow(step_m, 3);
  EXPECT_NEAR(surface.hull_volume_m3 / truth_m3, 1, 0.01);
  EXPECT_LT(surface.hull_volume_error_m3, 0.005 * truth_m3);
  EXPECT_GT(surface.volume_m3, surface.hull_volume_m3);
}

TEST(SweptVolume, DoesNotDependOnOrderAndThreads) {
  const Session frames = session(6, 3);
  const SweptSurface one = swept_by(frames);
  SweptVolume swept({.within_world_m = kBox});
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 3; ++t)
    threads.emplace_back([&, t] {
      add(swept, frames, 5 - t);
      add(swept, frames, t);
    });
  for (std::thread& thread : threads) thread.join();
  const SweptSurface many = swept.surface();
  EXPECT_EQ(one.mesh.vertices_m, many.mesh.vertices_m);
  EXPECT_EQ(one.mesh.triangles, many.mesh.triangles);
  EXPECT_EQ(one.hull_volume_m3, many.hull_volume_m3);
}

// A hull that fills the box: the surface is the box's.
TEST(SweptVolume, OfAHullThatTheBoxCutsIsClosed) {
  test::Random random(23);
  Session frames;
  frames.frames.push_back(test::silhouettes_of({{Vector3d::Zero(), Vector3d::Zero(), 0.45}},
                                               test::random_cameras(random, 3)));
  for (hull::Silhouette& silhouette : frames.frames[0])
    for (int v = 0; v < 121; ++v)
      for (int u = 0; u < 160; ++u) silhouette.pixels.set(u, v);
  frames.rule.limits = hull::Limits::seen;
  frames.rule.min_seen = 1;
  const SweptSurface surface = swept_by(frames, 0.01);
  EXPECT_EQ(test::manifold_fault(surface.mesh), "");
  EXPECT_TRUE(kBox.isApprox(geometry::bounds_m(surface.mesh), 1e-9));
}

TEST(SweptVolume, OfNothingIsEmpty) {
  test::Random random(24);
  SweptVolume swept({.within_world_m = kBox});
  EXPECT_TRUE(swept.surface().mesh.triangles.empty());
  base::WorkerPool pool(1);
  std::vector<hull::Silhouette> silhouettes = session(1, 3).frames[0];
  silhouettes[1].camera.pinhole.fx_px = test::kNaN;
  hull::CpuHull unusable(pool, silhouettes);
  swept.add(hull::HullQuery(unusable));
  silhouettes = session(1, 3).frames[0];
  silhouettes[2].pixels = hull::ObjectPixels(320, 243);
  hull::CpuHull empty(pool, silhouettes);
  swept.add(hull::HullQuery(empty));
  EXPECT_TRUE(swept.surface().mesh.triangles.empty());
  EXPECT_EQ(swept.surface().volume_m3, 0);
  EXPECT_EQ(swept.surface().hull_volume_m3, 0);
}

// Thinner than any cell: one pixel of each camera.
TEST(SweptVolume, ContainsThinHulls) {
  std::vector<hull::Silhouette> silhouettes;
  for (const Vector3d& eye : {Vector3d(3, 0, 0), Vector3d(0, 3, 0)}) {
    silhouettes.push_back(
        {{geometry::pinhole_from_fov(641, 641, 0.5),
          geometry::look_at(eye, Vector3d(0.001, 0.002, 0.003), Vector3d::UnitZ())},
         hull::ObjectPixels(641, 641)});
    silhouettes.back().pixels.set(320, 320);
  }
  Session frames;
  frames.frames.push_back(silhouettes);
  ASSERT_TRUE(holds(frames, Vector3d(0.001, 0.002, 0.003)));
  const SweptSurface surface = swept_by(frames, 0.02);
  EXPECT_GE(surface.cells, 1u);
  EXPECT_TRUE(test::MeshInside(surface.mesh, 0.02).contains(Vector3d(0.001, 0.002, 0.003)));
}

TEST(SweptVolume, RefusesBadOptions) {
  const double nan = test::kNaN;
  for (const SweptVolumeOptions& bad :
       {SweptVolumeOptions{kBox, 0}, SweptVolumeOptions{kBox, nan},
        SweptVolumeOptions{AlignedBox3d(), 0.1}, SweptVolumeOptions{kBox, 1e-4}})
    EXPECT_THROW(SweptVolume{bad}, std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::surface
