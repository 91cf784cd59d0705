#include "common/surface/marching_cubes.h"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/closed_mesh.h"
#include "common/surface/cube_loops.h"
#include "tests/surface/mesh_checks.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

geometry::Mesh mesh_of(const BitGrid& grid, std::mt19937_64& random) {
  const MarchingCubes cubes(grid);
  std::uniform_real_distribution<double> part(0.01, 0.99);
  std::vector<Vector3d> vertices;
  for (const CrossedEdge& edge : cubes.edges()) {
    EXPECT_TRUE(grid.at(edge.inside.x(), edge.inside.y(), edge.inside.z()));
    EXPECT_FALSE(grid.at(edge.outside.x(), edge.outside.y(), edge.outside.z()));
    vertices.emplace_back(edge.inside.cast<double>() +
                          part(random) * (edge.outside - edge.inside).cast<double>());
  }
  return cubes.mesh(std::move(vertices));
}

// Every cube, alone: the surface encloses the inside corners.
TEST(MarchingCubes, EveryCubeAloneIsEnclosed) {
  std::mt19937_64 random(1);
  for (unsigned bits = 1; bits < 256; ++bits) {
    BitGrid grid({4, 4, 4});
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3i p = Vector3i::Ones() + corner_offset(corner);
      if ((bits >> corner & 1) != 0) grid.set(p.x(), p.y(), p.z());
    }
    const geometry::Mesh mesh = mesh_of(grid, random);
    EXPECT_EQ(test::manifold_fault(mesh), "") << bits;
    EXPECT_GT(geometry::enclosed_volume_m3(mesh), 0) << bits;
    const test::MeshInside inside(mesh, 1);
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d p =
          (Vector3i::Ones() + corner_offset(corner)).cast<double>() + Vector3d(3e-3, 2e-3, 1e-3);
      EXPECT_EQ(inside.contains(p), (bits >> corner & 1) != 0) << bits << ' ' << corner;
    }
  }
}

TEST(MarchingCubes, SurfaceOfRandomPointsIsClosedAndManifold) {
  std::mt19937_64 random(2);
  for (const double share : {0.1, 0.5, 0.9}) {
    BitGrid grid({70, 14, 14});
    std::bernoulli_distribution is_inside(share);
    for (int z = 1; z < 13; ++z)
      for (int y = 1; y < 13; ++y)
        for (int x = 1; x < 69; ++x)
          if (is_inside(random)) grid.set(x, y, z);
    const geometry::Mesh mesh = mesh_of(grid, random);
    EXPECT_GT(mesh.triangles.size(), 4000u);
    EXPECT_EQ(test::manifold_fault(mesh), "") << share;
    EXPECT_EQ(test::manifold_fault(test::merged(mesh)), "") << share;
  }
}

// Surfaces between two words of a row, on either side.
TEST(MarchingCubes, CrossesTheEndOfAWord) {
  std::mt19937_64 random(3);
  for (const int at : {62, 63, 64, 65})
    for (const bool is_first : {false, true}) {
      BitGrid grid({68, 4, 4});
      for (int x = is_first ? at : 1; x <= (is_first ? 66 : at); ++x)
        for (int y = 1; y < 3; ++y)
          for (int z = 1; z < 3; ++z) grid.set(x, y, z);
      EXPECT_EQ(test::manifold_fault(mesh_of(grid, random)), "") << at;
    }
}

}  // namespace
}  // namespace fivepipe::surface
