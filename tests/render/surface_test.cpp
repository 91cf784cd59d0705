#include "render_node/surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/render_scenes.h"

namespace fivepipe::render {
namespace {

using test::object;

// Float rounding of a sum of a few unit vectors.
constexpr float kRounding = 1e-5f;

TEST(Surface, CornersOfABoxHaveTheNormalsOfTheirFaces) {
  const Surface surface(test::object("box", config::BoxShape{{1, 2, 3}}, {0, 0, 0}, {1, 1, 1}));
  const auto corners = surface.corners();
  ASSERT_EQ(corners.size(), 36u);
  for (std::size_t t = 0; t < corners.size(); t += 3) {
    const Eigen::Vector3f face = (corners[t + 1].p_object_m - corners[t].p_object_m)
                                     .cross(corners[t + 2].p_object_m - corners[t].p_object_m)
                                     .normalized();
    EXPECT_GT(face.dot(corners[t].p_object_m), 0) << "outward";
    for (std::size_t c = t; c < t + 3; ++c)
      EXPECT_NEAR((corners[c].normal - face).norm(), 0, kRounding);
  }
}

TEST(Surface, CornersOfABallHaveRadialNormals) {
  const double radius_m = 0.3;
  const Surface surface(
      test::object("ball", config::SphereShape{radius_m, 2}, {0, 0, 0}, {1, 1, 1}));
  // The faces of an icosphere differ in shape: the mean normal at a vertex deviates from the radius
  // by at most 0.06 rad.
  for (const SurfaceCorner& c : surface.corners())
    EXPECT_GT(c.normal.dot(c.p_object_m.normalized()), std::cos(0.06));
}

TEST(Surface, PatternCoordinatesMoveWithTheVertices) {
  const config::SceneObject curtain =
      test::object("curtain", config::CurtainShape{0.6, 0.4, 6, 4, 0.02, 2}, {0, 0, 0}, {1, 1, 1});
  const Surface surface(curtain);
  std::vector<float> moved;
  // Rotate by a quarter turn about z, then move up.
  for (const Eigen::Vector3d& v : config::mesh_of(curtain).vertices_m) {
    moved.push_back(float(-v.y()));
    moved.push_back(float(v.x()));
    moved.push_back(float(v.z() + 1));
  }
  const auto before = surface.corners(), after = surface.corners(moved);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t c = 0; c < before.size(); ++c) {
    EXPECT_EQ(before[c].pattern_m, after[c].pattern_m);
    EXPECT_NEAR(
        (Eigen::Vector3f(-before[c].normal.y(), before[c].normal.x(), before[c].normal.z()) -
         after[c].normal)
            .norm(),
        0, 1e-4f);
  }
}

// Two squares that share the edge from (0, 0, 0) to (0, 1, 0), with this angle between them.
std::vector<SurfaceCorner> folded(double angle_rad) {
  geometry::Mesh mesh;
  mesh.vertices_m = {{0, 0, 0},
                     {0, 1, 0},
                     {-2, 0, 0},
                     {-2, 1, 0},
                     {std::cos(angle_rad), 0, std::sin(angle_rad)},
                     {std::cos(angle_rad), 1, std::sin(angle_rad)}};
  mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {0, 4, 1}, {1, 4, 5}};
  return Surface(test::object("mesh", config::MeshShape{"", 1, mesh}, {0, 0, 0}, {1, 1, 1}))
      .corners();
}

// 0.7 rad is 40 degrees. The mean of the normals is weighted by area: at vertex 0 the first square
// has one triangle of area 1, the second one of area 1/2.
TEST(Surface, AnEdgeOfMoreThan40DegreesIsSharp) {
  const auto sharp = folded(0.71), smooth = folded(0.69);
  const Eigen::Vector3f up(0, 0, 1), inclined(-std::sin(0.69f), 0, std::cos(0.69f));
  EXPECT_LT((sharp[0].normal - up).norm(), kRounding);
  EXPECT_LT((sharp[6].normal - Eigen::Vector3f(-std::sin(0.71f), 0, std::cos(0.71f))).norm(),
            kRounding);
  const Eigen::Vector3f mean = (2 * up + inclined).normalized();
  EXPECT_LT((smooth[0].normal - mean).norm(), kRounding);
  EXPECT_LT((smooth[6].normal - mean).norm(), kRounding);
  EXPECT_LT((smooth[2].normal - up).norm(), kRounding);  // not at the edge
}

// Cones of triangles around an apex.
TEST(Surface, AVertexOfMoreThan64TrianglesIsShadedFlat) {
  for (const std::uint32_t triangles : {64u, 65u}) {
    geometry::Mesh cone;
    cone.vertices_m.emplace_back(0, 0, 0.2);
    for (std::uint32_t i = 0; i < triangles; ++i)
      cone.vertices_m.emplace_back(std::cos(i * 2 * M_PI / triangles),
                                   std::sin(i * 2 * M_PI / triangles), 0);
    for (std::uint32_t i = 0; i < triangles; ++i)
      cone.triangles.push_back({0, 1 + i, 1 + (i + 1) % triangles});
    const SurfaceCorner apex =
        Surface(test::object("cone", config::MeshShape{"", 1, cone}, {0, 0, 0}, {1, 1, 1}))
            .corners()[0];
    EXPECT_EQ(apex.normal.z() > 0.999f, triangles == 64) << apex.normal.z();
  }
}

// The two axes other than the one across the face; x and z for a curtain, whatever its folds.
TEST(Surface, PatternCoordinatesAreThoseOfTheFace) {
  for (const SurfaceCorner& c :
       Surface(test::object("box", config::BoxShape{{1, 2, 3}}, {0, 0, 0}, {1, 1, 1})).corners()) {
    const Eigen::Vector3f p = c.p_object_m;
    EXPECT_EQ(c.pattern_m, std::abs(c.normal.x()) > 0.5f   ? Eigen::Vector2f(p.y(), p.z())
                           : std::abs(c.normal.y()) > 0.5f ? Eigen::Vector2f(p.x(), p.z())
                                                           : Eigen::Vector2f(p.x(), p.y()));
  }
  for (const SurfaceCorner& c :
       Surface(test::object("curtain", config::CurtainShape{0.6, 0.4, 12, 4, 0.3, 3}, {0, 0, 0},
                            {1, 1, 1}))
           .corners())
    EXPECT_EQ(c.pattern_m, Eigen::Vector2f(c.p_object_m.x(), c.p_object_m.z()));
}

TEST(Surface, ValuesOfVerticesBecomeValuesOfCorners) {
  geometry::Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {2, 1, 3}};
  const Surface surface(test::object("mesh", config::MeshShape{"", 1, mesh}, {0, 0, 0}, {1, 1, 1}));
  EXPECT_EQ(surface.vertices(), 4u);
  EXPECT_EQ(surface.triangles(), 2u);
  EXPECT_EQ(surface.at_corners(std::vector<float>{5, 6, 7, 8}),
            (std::vector<float>{5, 6, 7, 7, 6, 8}));
}

TEST(Surface, DegenerateTrianglesHaveUnitNormals) {
  geometry::Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}};
  // The triangles include points, a line, a duplicate, and one with reversed orientation.
  mesh.triangles = {{0, 1, 2}, {0, 0, 0}, {0, 1, 3}, {1, 1, 2}, {0, 1, 2}, {2, 1, 0}};
  const auto corners =
      Surface(test::object("mesh", config::MeshShape{"", 1, mesh}, {0, 0, 0}, {1, 1, 1})).corners();
  ASSERT_EQ(corners.size(), 18u);
  for (const SurfaceCorner& c : corners) EXPECT_NEAR(c.normal.norm(), 1, kRounding);
}

TEST(Surface, ManyTrianglesAtOneVertexTakeLinearTime) {
  geometry::Mesh fan;
  // A quadratic algorithm would take 4e10 steps and exceed the time limit of the test.
  constexpr std::uint32_t kTriangles = 200'000;
  fan.vertices_m.emplace_back(0, 0, 0);
  for (std::uint32_t i = 0; i <= kTriangles; ++i)
    fan.vertices_m.emplace_back(std::cos(i * 6.28 / kTriangles), std::sin(i * 6.28 / kTriangles),
                                0);
  for (std::uint32_t i = 1; i <= kTriangles; ++i) fan.triangles.push_back({0, i, i + 1});
  EXPECT_EQ(Surface(test::object("fan", config::MeshShape{"", 1, fan}, {0, 0, 0}, {1, 1, 1}))
                .corners()
                .size(),
            3u * kTriangles);
}

TEST(Surface, AnEmptyMeshHasNoCorners) {
  EXPECT_TRUE(Surface(test::object("nothing", config::MeshShape{}, {0, 0, 0}, {1, 1, 1}))
                  .corners()
                  .empty());
}

}  // namespace
}  // namespace fivepipe::render
