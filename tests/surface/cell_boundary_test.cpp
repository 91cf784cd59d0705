#include "common/surface/cell_boundary.h"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/closed_mesh.h"
#include "tests/surface/mesh_checks.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

TEST(CellBoundary, OfABoxIsItsFaces) {
  BitGrid cells({70, 5, 6});
  for (int x = 1; x < 69; ++x)
    for (int y = 1; y < 4; ++y)
      for (int z = 1; z < 5; ++z) cells.set(x, y, z);
  EXPECT_EQ(make_well_composed(cells), 0u);
  const geometry::Mesh mesh = boundary_mesh(cells, {10, 20, 30}, 0.5);
  EXPECT_EQ(test::manifold_fault(mesh), "");
  EXPECT_EQ(mesh.triangles.size(), 2u * 2 * (68 * 3 + 68 * 4 + 3 * 4));
  EXPECT_NEAR(geometry::enclosed_volume_m3(mesh), 68 * 3 * 4 * 0.125, 1e-9);
  EXPECT_TRUE(geometry::bounds_m(mesh).isApprox(
      Eigen::AlignedBox3d(Vector3d(10.5, 20.5, 30.5), Vector3d(44.5, 22, 32.5))));
}

// Two cells that touch only at an edge, or only at a corner, and the complements.
TEST(CellBoundary, OfDiagonalCellsIsManifold) {
  for (unsigned bits = 1; bits < 256; ++bits) {
    BitGrid cells({4, 4, 4});
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3i c = Vector3i::Ones() + corner_offset(corner);
      if ((bits >> corner & 1) != 0) cells.set(c.x(), c.y(), c.z());
    }
    const std::size_t before = cells.count(), added = make_well_composed(cells);
    EXPECT_EQ(cells.count(), before + added);
    EXPECT_EQ(cube_bits(cells, Vector3i::Ones()) & bits, bits);
    const geometry::Mesh mesh = boundary_mesh(cells, Vector3d::Zero(), 1);
    EXPECT_EQ(test::manifold_fault(mesh), "") << bits;
    EXPECT_NEAR(geometry::enclosed_volume_m3(mesh), double(cells.count()), 1e-9) << bits;
    // Cells that touch at an edge, at a corner, missing ones that touch at a corner, a plate.
    const std::map<unsigned, std::size_t> expected{
        {0b1001, 1}, {0b10000001, 2}, {0b01111110, 1}, {0b00001111, 0}};
    if (const auto known = expected.find(bits); known != expected.end()) {
      EXPECT_EQ(added, known->second) << bits;
    }
  }
}

TEST(CellBoundary, OfRandomCellsIsManifoldAndContainsThem) {
  std::mt19937_64 random(4);
  for (const double share : {0.05, 0.3, 0.7}) {
    BitGrid cells({70, 12, 12});
    std::bernoulli_distribution is_set(share);
    for (int z = 1; z < 11; ++z)
      for (int y = 1; y < 11; ++y)
        for (int x = 1; x < 69; ++x)
          if (is_set(random)) cells.set(x, y, z);
    const BitGrid before = cells;
    make_well_composed(cells);
    for (int z = 0; z < 12; ++z)
      for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 70; ++x) {
          ASSERT_TRUE(cells.at(x, y, z) || !before.at(x, y, z));
          const bool is_margin = x == 0 || y == 0 || z == 0 || x == 69 || y == 11 || z == 11;
          ASSERT_FALSE(is_margin && cells.at(x, y, z));
        }
    const geometry::Mesh mesh = boundary_mesh(cells, Vector3d(1, 2, 3), 0.005);
    EXPECT_EQ(test::manifold_fault(mesh), "") << share;
    EXPECT_EQ(test::manifold_fault(test::merged(mesh)), "") << share;
    EXPECT_EQ(geometry::open_edges(mesh), 0u);
  }
}

}  // namespace
}  // namespace fivepipe::surface
