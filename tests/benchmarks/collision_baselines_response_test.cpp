// The baselines and references of the response and of the distances: the paper's window, the
// distances of a voxel grid, and normals in closed form.
#include "benchmarks/collision/analytic_normal.h"
#include "benchmarks/collision/baselines/distance_grid.h"
#include "benchmarks/collision/baselines/rendered_response.h"
#include "common/collision/response/recovery.h"
#include "tests/support/collision/response.h"
#include "tests/support/not_finite.h"

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;

constexpr double kHeight_m = 0.05, kApex_rad = 10 * std::numbers::pi / 180,
                 kDegree = std::numbers::pi / 180;

class RenderedResponse : public GlTest {};

// The error is at most one step, the height divided by the window, except for parts of the hull
// thinner than a step, and unless V_rec leaves the hull along its surface.
TEST_F(RenderedResponse, FindsTheExitWithinOnePixelOfTheWindow) {
  for (const int window_px : {100, 400}) {
    Random random(21);
    baselines::RenderedResponse rendered(window_px);
    const double step_m = kHeight_m / window_px;
    int exits = 0, off = 0, enclosed = 0;
    for (int scene = 0; scene < 8; ++scene) {
      const auto silhouettes =
          silhouettes_of({random_cameras(random, 4), random_object(random, 4)});
      const Queries hull(silhouettes);
      rendered.set_silhouettes(silhouettes);
      for (int i = 0; i < 150; ++i) {
        const Vector3d p = random_in_ball(random, 0.25), v_rec = random_direction(random);
        if (!hull.query.contains(p)) continue;
        const auto exact = collision::exit_from_base(hull.query, p, v_rec, kHeight_m);
        const auto found = rendered.respond(p, v_rec, kHeight_m, kApex_rad);
        if (!exact) {
          ++enclosed;
          EXPECT_FALSE(found);
          continue;
        }
        ++exits;
        off += !found || std::abs(found->d_rec_m - exact->distance_m) > 1.05 * step_m;
        if (found) {
          EXPECT_LE((found->cp_hull_world_m - p - found->d_rec_m * v_rec).norm(),
                    0.1 * step_m);  // half a row: 8.7 mm / 2, divided by the window
        }
      }
    }
    EXPECT_GT(exits, 30);
    EXPECT_GT(enclosed, 5);
    EXPECT_LE(off, exits / 20);
  }
}

// The hull ends at z = 0. Over 5 cm of V_rec, the four points span some millimetres, of which a
// step of the window is a hundredth.
TEST_F(RenderedResponse, ReturnsTheNormalOfAPlane) {
  const auto silhouettes = plane_silhouettes();
  baselines::RenderedResponse rendered(400);
  rendered.set_silhouettes(silhouettes);
  for (const double tilt_rad : {0.0, 0.2, 0.5}) {
    const Vector3d v_rec(std::sin(tilt_rad), 0, std::cos(tilt_rad)), p(0, 0, -0.03);
    const auto found = rendered.respond(p, v_rec, kHeight_m, kApex_rad);
    ASSERT_TRUE(found && found->normal_world);
    EXPECT_NEAR(found->d_rec_m, 0.03 / std::cos(tilt_rad), 2.5e-4 + kFootprint_m);
    EXPECT_LT(angle_rad(*found->normal_world, Vector3d::UnitZ()), 6 * kDegree);
  }
}

TEST(DistanceGrid, EqualsTheDistanceToTheNearestVoxelInTheHull) {
  Random random(22);
  const auto silhouettes =
      silhouettes_of({random_cameras(random, 3), random_object(random, 3, 0.1)});
  const Queries hull(silhouettes);
  constexpr double kVoxel_m = 0.011;
  const Eigen::AlignedBox3d box(Vector3d(-0.12, -0.1, -0.14), Vector3d(0.13, 0.12, 0.1));
  baselines::DistanceGrid grid(kVoxel_m);
  grid.build(hull.query, box);
  std::vector<Vector3d> centers, inside;
  for (double z = box.min().z() + 0.5 * kVoxel_m; z < box.max().z(); z += kVoxel_m)
    for (double y = box.min().y() + 0.5 * kVoxel_m; y < box.max().y(); y += kVoxel_m)
      for (double x = box.min().x() + 0.5 * kVoxel_m; x < box.max().x(); x += kVoxel_m) {
        centers.emplace_back(x, y, z);
        if (hull::in_hull(silhouettes, centers.back())) inside.push_back(centers.back());
      }
  ASSERT_GT(inside.size(), 50u);
  ASSERT_GT(centers.size(), 2 * inside.size());
  for (const Vector3d& p : centers) {
    double nearest_m = kInfinity;
    for (const Vector3d& q : inside) nearest_m = std::min(nearest_m, (p - q).norm());
    EXPECT_NEAR(grid.distance_m(p), nearest_m, 1e-6);
  }
}

TEST(DistanceGrid, IsInfiniteWithoutAHullAndRejectsInvalidSizes) {
  const Queries empty(std::vector<hull::Silhouette>{});
  baselines::DistanceGrid grid(0.1);
  grid.build(empty.query, {Vector3d::Zero(), Vector3d::Ones()});
  EXPECT_EQ(grid.distance_m({0.5, 0.5, 0.5}), kInfinity);
  EXPECT_THROW(baselines::DistanceGrid(0.0), std::invalid_argument);
  EXPECT_THROW(baselines::DistanceGrid{kNaN}, std::invalid_argument);
  EXPECT_THROW(
      baselines::DistanceGrid(1e-4).build(empty.query, {Vector3d::Zero(), Vector3d::Ones()}),
      std::invalid_argument);
}

// A small step along the surface, across the line of sight, leaves the surface only by the square
// of the step. A normal that is off by a degree would exceed that bound tenfold.
TEST(AnalyticExit, NormalEqualsThatOfTheConeOfSight) {
  Random random(23);
  constexpr double kAside_m = 1e-4;
  int checked = 0;
  for (int i = 0; i < 200; ++i) {
    const std::vector<hull::Capsule> object{
        {random_in_ball(random, 0.1), random_in_ball(random, 0.1), 0.05}};
    const auto cameras = random_cameras(random, 3);
    const Vector3d p = 0.5 * (object[0].a_world_m + object[0].b_world_m),
                   v = random_direction(random);
    const auto exit = collision_bench::analytic_exit(object, cameras, {p, v}, 0, 1);
    ASSERT_TRUE(exit);
    const Vector3d border = p + exit->distance_m * v, n = exit->normal_world;
    const Vector3d sight =
        (border - geometry::camera_center_world_m(cameras[exit->camera])).normalized();
    EXPECT_NEAR(n.norm(), 1, 1e-12);
    EXPECT_NEAR(n.dot(sight), 0, 1e-9);
    EXPECT_GT(n.dot(v), 0);
    const geometry::Camera alone[] = {cameras[exit->camera]};
    const Vector3d aside = border + kAside_m * n.cross(sight);
    const double bend_m = 2 * kAside_m * kAside_m / 0.05;
    EXPECT_TRUE(hull::in_analytic_hull(object, alone, aside - bend_m * n));
    EXPECT_FALSE(hull::in_analytic_hull(object, alone, aside + bend_m * n));
    ++checked;
  }
  EXPECT_EQ(checked, 200);
  const auto cameras = random_cameras(random, 3);
  const std::vector<hull::Capsule> ball_here{ball(kOrigin, 0.05)};
  EXPECT_FALSE(collision_bench::analytic_exit(
      ball_here, cameras, {Vector3d(0.3, 0, 0), Vector3d(1, 0, 0)}, 0, 1));  // starts outside
}

}  // namespace
}  // namespace fivepipe::test
