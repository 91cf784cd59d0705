#include "common/surface/hull_mesh.h"

#include <gtest/gtest.h>

#include "common/geometry/closed_mesh.h"
#include "tests/support/hull/scenes.h"
#include "tests/support/hull/test_pool.h"
#include "tests/support/not_finite.h"
#include "tests/surface/mesh_checks.h"

namespace fivepipe::surface {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

AlignedBox3d cube_m(double half_m) {
  return {Vector3d::Constant(-half_m), Vector3d::Constant(half_m)};
}

// A frame and its query.
struct Frame {
  std::vector<hull::Silhouette> silhouettes;
  hull::HullRule rule;
  hull::CpuHull hull;
  hull::HullQuery query;
  explicit Frame(std::vector<hull::Silhouette> s, const hull::HullRule& r = {},
                 base::WorkerPool& pool = test::test_pool())
      : silhouettes(std::move(s)), rule(r), hull(pool, silhouettes, rule), query(hull) {}
  bool holds(const Vector3d& p_m) const { return hull::in_hull(silhouettes, p_m, rule); }
};

// By the definition of the hull, at the centres of cells.
double carved_volume_m3(const Frame& frame, const AlignedBox3d& box, double cell_m) {
  std::size_t count = 0;
  const Eigen::Vector3i cells = (box.sizes() / cell_m).array().round().cast<int>();
  for (int z = 0; z < cells.z(); ++z)
    for (int y = 0; y < cells.y(); ++y)
      for (int x = 0; x < cells.x(); ++x)
        count += frame.holds(box.min() + cell_m * Vector3d(x + 0.5, y + 0.5, z + 0.5));
  return double(count) * cell_m * cell_m * cell_m;
}

std::vector<std::vector<hull::Capsule>> objects() {
  test::Random random(7);
  return {{{Vector3d::Zero(), Vector3d::Zero(), 0.08}},
          {{Vector3d(-0.08, 0, 0), Vector3d(0.08, 0.03, 0.02), 0.03}},
          test::random_object(random, 4, 0.1)};
}

TEST(HullMesh, IsClosedAndHasTheCarvedVolume) {
  test::Random random(5);
  for (const auto& object : objects()) {
    const Frame frame(test::silhouettes_of(object, test::random_cameras(random, 8)));
    const AlignedBox3d box = cube_m(0.2);
    const geometry::Mesh mesh = hull_mesh(frame.query, {.within_world_m = box, .cell_m = 0.004});
    EXPECT_EQ(test::manifold_fault(mesh), "");
    EXPECT_EQ(test::manifold_fault(test::merged(mesh)), "");
    const double carved_m3 = carved_volume_m3(frame, box, 0.003);
    ASSERT_GT(carved_m3, 1e-5);
    EXPECT_NEAR(geometry::enclosed_volume_m3(mesh) / carved_m3, 1, 0.01);
  }
}

// The closed form: a box that three cameras far away see along its axes.
TEST(HullMesh, OfABoxHasItsVolume) {
  std::vector<geometry::Camera> cameras;
  for (int axis = 0; axis < 3; ++axis)
    cameras.push_back({geometry::pinhole_from_fov(801, 801, 0.004),
                       geometry::look_at(100 * Vector3d::Unit(axis), Vector3d::Zero(),
                                         Vector3d::Unit((axis + 1) % 3))});
  const AlignedBox3d object(Vector3d(-0.1, -0.05, -0.03), Vector3d(0.07, 0.06, 0.08));
  const Frame frame(test::silhouettes_of_box(object, cameras));
  const geometry::Mesh mesh = hull_mesh(frame.query, {.within_world_m = cube_m(0.15)});
  EXPECT_EQ(test::manifold_fault(mesh), "");
  // Maps set the pixels whose centres see the box: 0.5 mm per pixel.
  EXPECT_NEAR(geometry::enclosed_volume_m3(mesh) / object.volume(), 1, 0.02);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(geometry::bounds_m(mesh).min()[axis], object.min()[axis], 0.7e-3);
    EXPECT_NEAR(geometry::bounds_m(mesh).max()[axis], object.max()[axis], 0.7e-3);
  }
}

TEST(HullMesh, VerticesAreOnTheBorder) {
  test::Random random(6);
  const Frame frame(test::silhouettes_of(objects()[2], test::random_cameras(random, 6)));
  const double cell_m = 0.005;
  const geometry::Mesh mesh =
      hull_mesh(frame.query, {.within_world_m = cube_m(0.2), .cell_m = cell_m});
  std::size_t elsewhere = 0;
  for (const Vector3d& p : mesh.vertices_m) {
    bool is_at_border = false;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = 0.02 * cell_m * Vector3d::Unit(axis);
      is_at_border = is_at_border || frame.holds(p - step) != frame.holds(p + step);
    }
    elsewhere += !is_at_border;
  }
  EXPECT_GT(mesh.vertices_m.size(), 1000u);
  EXPECT_LE(elsewhere, mesh.vertices_m.size() / 200);  // those in the middle of a cell
}

TEST(HullMesh, IsWithinACellOfTheHull) {
  test::Random random(8);
  const Frame frame(test::silhouettes_of(objects()[2], test::random_cameras(random, 5)));
  const double cell_m = 0.005;
  const geometry::Mesh mesh =
      hull_mesh(frame.query, {.within_world_m = cube_m(0.2), .cell_m = cell_m});
  ASSERT_FALSE(mesh.triangles.empty());
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 7) {
    const auto& t = mesh.triangles[i];
    const Vector3d p = (mesh.vertices_m[t[0]] + mesh.vertices_m[t[1]] + mesh.vertices_m[t[2]]) / 3;
    bool has_inside = false, has_outside = false;
    for (int k = 0; k < 2000 && !(has_inside && has_outside); ++k)
      (frame.holds(p + test::random_in_ball(random, cell_m)) ? has_inside : has_outside) = true;
    EXPECT_TRUE(has_inside && has_outside) << p.transpose();
  }
}

// Maps of random pixels: thin parts, and many cubes with more than one loop.
TEST(HullMesh, OfNoiseIsManifold) {
  test::Random random(9);
  for (const double fraction : {0.5, 0.8}) {
    std::vector<hull::Silhouette> silhouettes;
    for (const geometry::Camera& camera : test::random_cameras(random, 3, 40, 31))
      silhouettes.push_back({camera, test::random_pixels(random, 40, 31, fraction)});
    const Frame frame(std::move(silhouettes));
    const geometry::Mesh mesh =
        hull_mesh(frame.query, {.within_world_m = cube_m(0.15), .cell_m = 0.006});
    EXPECT_GT(mesh.triangles.size(), 1000u);
    EXPECT_EQ(test::manifold_fault(mesh), "");
  }
}

// With Limits::seen, and cut by a box.
TEST(HullMesh, ClosesWhereTheBoxCutsTheHull) {
  test::Random random(10);
  const auto cameras = test::random_cameras(random, 6);
  const std::vector<hull::Capsule> object{{Vector3d::Zero(), Vector3d::Zero(), 0.1}};
  const AlignedBox3d box(Vector3d(-0.05, -0.2, -0.2), Vector3d(0.03, 0.04, 0.2));
  for (const hull::Limits limits : {hull::Limits::all, hull::Limits::seen}) {
    const Frame frame(test::silhouettes_of(object, cameras),
                      {.limits = limits, .min_seen = 3, .within_world_m = box});
    const geometry::Mesh mesh = hull_mesh(frame.query, {.within_world_m = box, .cell_m = 0.005});
    EXPECT_EQ(test::manifold_fault(mesh), "");
    const AlignedBox3d bounds = geometry::bounds_m(mesh);
    EXPECT_NEAR(bounds.min().x(), box.min().x(), 1e-5);
    EXPECT_NEAR(bounds.max().x(), box.max().x(), 1e-5);
    EXPECT_NEAR(bounds.max().y(), box.max().y(), 1e-5);
    EXPECT_NEAR(geometry::enclosed_volume_m3(mesh) / carved_volume_m3(frame, box, 0.004), 1, 0.02);
    // The same cut by the options alone.
    const Frame whole(test::silhouettes_of(object, cameras), {.limits = limits, .min_seen = 3});
    const geometry::Mesh cut = hull_mesh(whole.query, {.within_world_m = box, .cell_m = 0.005});
    EXPECT_EQ(cut.triangles, mesh.triangles);
    EXPECT_EQ(cut.vertices_m, mesh.vertices_m);
  }
}

TEST(HullMesh, OfOnePixelIsItsBeam) {
  std::vector<geometry::Camera> cameras;
  for (const Vector3d& eye : {Vector3d(1, 0, 0), Vector3d(0, 1, 0)})
    cameras.push_back({geometry::pinhole_from_fov(41, 41, 0.5),
                       geometry::look_at(eye, Vector3d::Zero(), Vector3d::UnitZ())});
  std::vector<hull::Silhouette> silhouettes;
  for (const geometry::Camera& camera : cameras) {
    silhouettes.push_back({camera, hull::ObjectPixels(41, 41)});
    silhouettes.back().pixels.set(20, 20);
  }
  const Frame frame(std::move(silhouettes));
  const AlignedBox3d box = cube_m(0.0317);
  const geometry::Mesh fine = hull_mesh(frame.query, {.within_world_m = box, .cell_m = 0.001});
  EXPECT_EQ(test::manifold_fault(fine), "");
  EXPECT_NEAR(geometry::enclosed_volume_m3(fine) / carved_volume_m3(frame, box, 0.0004), 1, 0.02);
  // Thinner than the cells: whatever the lattice finds of it is closed.
  const geometry::Mesh coarse = hull_mesh(frame.query, {.within_world_m = box, .cell_m = 0.03});
  EXPECT_EQ(test::manifold_fault(coarse), "");
}

TEST(HullMesh, OfAnEmptyHullIsEmpty) {
  test::Random random(11);
  const auto cameras = test::random_cameras(random, 3);
  std::vector<hull::Silhouette> none;
  for (const geometry::Camera& camera : cameras)
    none.push_back({camera, hull::ObjectPixels(160, 121)});
  EXPECT_TRUE(hull_mesh(Frame(none).query, {.within_world_m = cube_m(0.2)}).triangles.empty());
  EXPECT_TRUE(hull_mesh(Frame({}).query, {.within_world_m = cube_m(0.2)}).triangles.empty());
  auto unusable = test::silhouettes_of(objects()[0], cameras);
  unusable[1].camera.pinhole.fx_px = test::kNaN;
  EXPECT_TRUE(hull_mesh(Frame(unusable).query, {.within_world_m = cube_m(0.2)}).triangles.empty());
  // No camera sees the box.
  const Frame far(test::silhouettes_of(objects()[0], cameras));
  const AlignedBox3d elsewhere(Vector3d::Constant(40), Vector3d::Constant(40.2));
  EXPECT_TRUE(hull_mesh(far.query, {.within_world_m = elsewhere}).triangles.empty());
}

TEST(HullMesh, DoesNotDependOnTheThreads) {
  test::Random random(12);
  const auto silhouettes = test::silhouettes_of(objects()[2], test::random_cameras(random, 4));
  base::WorkerPool one(1);
  const HullMeshOptions options{.within_world_m = cube_m(0.2), .cell_m = 0.006};
  const geometry::Mesh a = hull_mesh(Frame(silhouettes, {}, one).query, options),
                       b = hull_mesh(Frame(silhouettes).query, options);
  EXPECT_EQ(a.vertices_m, b.vertices_m);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(HullMesh, RefusesBadOptions) {
  const Frame frame({});
  const double nan = test::kNaN;
  for (const HullMeshOptions& bad :
       {HullMeshOptions{cube_m(0.2), 0}, HullMeshOptions{cube_m(0.2), -1},
        HullMeshOptions{cube_m(0.2), nan}, HullMeshOptions{cube_m(nan), 0.1},
        HullMeshOptions{AlignedBox3d(), 0.1}, HullMeshOptions{cube_m(10), 1e-4}})
    EXPECT_THROW(hull_mesh(frame.query, bad), std::invalid_argument);
}

}  // namespace
}  // namespace fivepipe::surface
