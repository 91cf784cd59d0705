#include "common/geometry/closed_mesh.h"

#include <gtest/gtest.h>

#include <numbers>

namespace fivepipe::test {
namespace {

using Eigen::Vector3d;
using geometry::enclosed_volume_m3;
using geometry::Mesh;
using geometry::open_edges;

Mesh inside_out(Mesh mesh) {
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

Mesh moved(Mesh mesh, const Vector3d& by_m) {
  for (Vector3d& vertex_m : mesh.vertices_m) vertex_m += by_m;
  return mesh;
}

Mesh both(Mesh a, const Mesh& b) {
  const auto first = std::uint32_t(a.vertices_m.size());
  a.vertices_m.insert(a.vertices_m.end(), b.vertices_m.begin(), b.vertices_m.end());
  for (const auto& [u, v, w] : b.triangles)
    a.triangles.push_back({first + u, first + v, first + w});
  return a;
}

TEST(ClosedMesh, BoxesAndSpheresAreClosed) {
  EXPECT_EQ(open_edges(geometry::box_mesh({1, 2, 3}, 0.3)), 0u);
  EXPECT_EQ(open_edges(geometry::sphere_mesh(1, 2)), 0u);
  EXPECT_EQ(open_edges(Mesh()), 0u);
  EXPECT_EQ(open_edges(both(geometry::box_mesh({1, 1, 1}),
                            moved(geometry::box_mesh({1, 1, 1}), {1, 1, 0}))),
            0u)
      << "four triangles pass the edge that both boxes have";
}

TEST(ClosedMesh, TheBorderOfASheetIsOpen) {
  EXPECT_EQ(open_edges(geometry::curtain_mesh(1, 1, 4, 3, 0.1, 2)), 2u * (4 + 3));
}

TEST(ClosedMesh, AMissingTriangleLeavesThreeOpenEdges) {
  Mesh mesh = geometry::sphere_mesh(1, 1);
  mesh.triangles.pop_back();
  EXPECT_EQ(open_edges(mesh), 3u);
}

TEST(ClosedMesh, ATurnedTriangleLeavesThreeOpenEdges) {
  Mesh mesh = geometry::sphere_mesh(1, 1);
  std::swap(mesh.triangles[7][0], mesh.triangles[7][1]);
  EXPECT_EQ(open_edges(mesh), 3u);
}

// As in STL, and at a seam of texture coordinates. -0 and 0 are one position.
TEST(ClosedMesh, VerticesAtOnePositionAreOne) {
  const Mesh shared = geometry::box_mesh({1, 1, 1});
  Mesh split;
  for (const auto& triangle : shared.triangles)
    for (const std::uint32_t vertex : triangle) {
      split.vertices_m.push_back(shared.vertices_m[vertex] + Vector3d(0.5, 0.5, 0.5));
      if (split.vertices_m.size() % 2 == 0)
        for (double& x : split.vertices_m.back())
          if (x == 0) x = -0.0;
    }
  for (std::uint32_t i = 0; i < split.vertices_m.size(); i += 3)
    split.triangles.push_back({i, i + 1, i + 2});
  EXPECT_EQ(open_edges(split), 0u);
}

TEST(ClosedMesh, TrianglesWithoutAreaAreNoEdges) {
  Mesh mesh = geometry::box_mesh({1, 1, 1});
  mesh.triangles.push_back({3, 3, 3});
  mesh.triangles.push_back({2, 5, 2});
  EXPECT_EQ(open_edges(mesh), 0u);
}

TEST(ClosedMesh, VolumeIsNegativeIfInsideOut) {
  const Mesh box = geometry::box_mesh({1, 2, 3}, 0.4);
  EXPECT_NEAR(enclosed_volume_m3(box), 6, 1e-12);
  EXPECT_NEAR(enclosed_volume_m3(inside_out(box)), -6, 1e-12);
  EXPECT_NEAR(enclosed_volume_m3(geometry::sphere_mesh(1, 5)), 4.0 / 3 * std::numbers::pi, 0.01);
}

TEST(ClosedMesh, VolumeFarFromTheOriginIsAccurate) {
  EXPECT_NEAR(enclosed_volume_m3(moved(geometry::box_mesh({0.01, 0.01, 0.01}), {1000, -1000, 500})),
              1e-6, 1e-12);
}

}  // namespace
}  // namespace fivepipe::test
