// Volume queries of triangles: at the borders of pixels and images, with maps of changing sizes,
// and with any OpenGL state.
#include <algorithm>
#include <array>
#include <set>

#include "common/collision/detection/paper/paper_detector.h"
#include "tests/support/collision/triangles.h"

namespace fivepipe::test {
namespace {

using collision::CollisionPoint;
using Eigen::Vector3d;

class TriangleQueryEdges : public GlTest {};

hull::Silhouette left_part(const geometry::Camera& camera, int columns) {
  const geometry::Pinhole& k = camera.pinhole;
  hull::Silhouette s{camera, hull::ObjectPixels(k.width_px, k.height_px)};
  for (int v = 0; v < k.height_px; ++v) s.pixels.set_run(0, columns, v);
  return s;
}

// Each texture has the size of its map, also if only the width or only the height changes.
TEST_F(TriangleQueryEdges, ReusedForMapsOfAnotherSizeEqualsANewOne) {
  Random random(31);
  const std::vector<collision::Triangle> triangles = random_triangles(random, 40);
  collision::TriangleVolumeQuery reused(100, 20);
  for (const auto& [width_px, height_px] :
       {std::pair{100, 60}, {100, 121}, {40, 121}, {200, 121}, {200, 50}, {64, 50}}) {
    const auto silhouettes =
        silhouettes_of({ball(kOrigin, 0.12)}, random_cameras(random, 3, width_px, height_px));
    collision::TriangleVolumeQuery fresh(100, 20);
    fresh.set_silhouettes(silhouettes);
    reused.set_silhouettes(silhouettes);
    const auto expected = fresh.query(triangles).points;
    EXPECT_GT(expected.size(), 100u);
    EXPECT_EQ(reused.query(triangles).points, expected) << width_px << ' ' << height_px;
  }
}

// The query sets the state that it needs.
TEST_F(TriangleQueryEdges, DoesNotDependOnTheOpenGlStateBefore) {
  Random random(32);
  const std::vector<collision::Triangle> triangles = random_triangles(random, 30);
  collision::TriangleVolumeQuery query(125, 20);  // an odd number of bytes per row
  query.set_silhouettes(hand_like());
  const auto expected = query.query(triangles).points;
  ASSERT_GT(expected.size(), 50u);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_NEVER);
  glEnable(GL_CULL_FACE);
  glCullFace(GL_FRONT_AND_BACK);
  glEnable(GL_SCISSOR_TEST);
  glScissor(0, 0, 1, 1);
  glStencilMask(0);
  glStencilFunc(GL_NEVER, 0, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 8);
  EXPECT_EQ(query.query(triangles).points, expected);
  EXPECT_FALSE(glIsEnabled(GL_STENCIL_TEST));
  std::array<GLboolean, 4> writable{};
  glGetBooleanv(GL_COLOR_WRITEMASK, writable.data());
  EXPECT_EQ(writable, (std::array<GLboolean, 4>{GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE}));
  for (const GLenum enabled : {GL_DEPTH_TEST, GL_CULL_FACE, GL_SCISSOR_TEST}) glDisable(enabled);
  glDepthFunc(GL_LESS);
  glCullFace(GL_BACK);
  glStencilMask(0xff);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
}

// The triangle is in the plane of a border between object pixels and others, so float and double
// round its samples to either side. Only those count that double confirms.
TEST_F(TriangleQueryEdges, SamplesThatDoubleDoesNotConfirmAreCountedAndDropped) {
  Random random(33);
  std::size_t unconfirmed = 0, points = 0;
  const auto detector = collision::paper_detector(40, 40);
  for (int scene = 0; scene < 4; ++scene) {
    const geometry::Camera camera = random_camera(random, 161, 121);
    const CollisionHull hull({left_part(camera, 53)});
    const auto on_border = [&](double v_px, double depth_m) -> Vector3d {
      const geometry::Ray ray = geometry::ray_through(camera, {52.5, v_px});
      return ray.origin_world_m + depth_m * ray.direction_world;
    };
    const collision::Triangle t{on_border(20, 1), on_border(100, 1.1), on_border(60, 1.7)};
    collision::TriangleVolumeQuery query(40, 40);
    query.set_silhouettes(hull.silhouettes);
    const auto found = query.query({&t, 1});
    for (const CollisionPoint& p : found.points)
      EXPECT_TRUE(hull::in_hull(hull.silhouettes, p.p_world_m));
    const std::vector<collision::Triangle> object{t};
    const auto detection = collision::detect(query, std::span(&object, 1));
    EXPECT_EQ(detection.counts.points_unconfirmed, found.points_unconfirmed);
    const collision::Bvh tree(mesh_of({t}));
    const collision::DetectionObject moved{&tree};
    detector->set_hull(hull.query, hull.silhouettes);
    detector->detect({&moved, 1});
    unconfirmed += found.points_unconfirmed, points += found.points.size();
    EXPECT_EQ(detector->counts().points_unconfirmed, unconfirmed);
  }
  EXPECT_GT(unconfirmed, 50u);
  EXPECT_GT(points, 50u);
}

// The triangle is larger than the image, so the first and last rows and columns have samples.
TEST_F(TriangleQueryEdges, ReportsTheSamplesOnEveryPixelOfTheImage) {
  constexpr int kViewport = 200;
  constexpr double kClear = 0.02;  // of a pixel, as OpenGL rounds
  const geometry::Camera camera = camera_at({0, 0, 1}, 37, 0.2, kOrigin, Vector3d::UnitY());
  const hull::Silhouette all = left_part(camera, 37);
  collision::TriangleVolumeQuery query(kViewport, kViewport);
  query.set_silhouettes({&all, 1});
  const collision::Triangle t{Vector3d(-0.3, -0.15, 0), {0.3, -0.15, 0}, {0, 0.3, 0}};
  const collision::TriangleView view = collision::view_of(t);
  std::set<std::array<double, 3>> reported;
  for (const CollisionPoint& p : query.query({&t, 1}).points)
    reported.insert({p.p_world_m.x(), p.p_world_m.y(), p.p_world_m.z()});
  std::set<int> columns, rows;
  std::size_t missing = 0;
  for (int row = 0; row < kViewport; ++row)
    for (int column = 0; column < kViewport; ++column) {
      const double x = column + 0.5, y = row + 0.5;
      if (x < view.apex_x * y + 1 || x > kViewport - (1 - view.apex_x) * y - 1) continue;
      const Vector3d p = collision::point_at(view, x / kViewport, y / kViewport);
      const Eigen::Vector2d uv_px = *geometry::project(camera, p);
      if (uv_px.minCoeff() < -0.5 + kClear || uv_px.maxCoeff() > 36.5 - kClear) continue;
      missing += !reported.contains({p.x(), p.y(), p.z()});
      columns.insert(int(std::floor(uv_px.x() + 0.5)));
      rows.insert(int(std::floor(uv_px.y() + 0.5)));
    }
  EXPECT_EQ(missing, 0u);
  EXPECT_EQ(columns.size(), 37u);
  EXPECT_EQ(rows.size(), 37u);
}

}  // namespace
}  // namespace fivepipe::test
