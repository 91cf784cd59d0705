#include "common/surface/cell_boundary.h"

#include <array>
#include <bit>

#include "common/surface/lattice_index.h"

namespace fivepipe::surface {
namespace {

using Eigen::Vector3i;

// Whether these corners of a cube are connected by the cube's edges.
bool is_connected(unsigned corners) {
  unsigned reached = corners & (~corners + 1);
  for (int step = 0; step < 8; ++step)
    for (int corner = 0; corner < 8; ++corner)
      if ((reached >> corner & 1) != 0)
        for (int axis = 0; axis < 3; ++axis) reached |= (1u << (corner ^ 1 << axis)) & corners;
  return reached == corners;
}

bool is_well_composed(unsigned corners) {
  return is_connected(corners) && is_connected(~corners & 0xffu);
}

// For each block the well-composed one with the fewest more cells; of several the one with the
// smallest number.
std::array<std::uint8_t, 256> repair_table() {
  std::array<std::uint8_t, 256> table{};
  for (unsigned corners = 0; corners < 256; ++corners) {
    unsigned best = 0xff;
    for (unsigned more = 0; more < 256; ++more)
      if ((more & corners) == corners && is_well_composed(more) &&
          std::popcount(more) < std::popcount(best))
        best = more;
    table[corners] = std::uint8_t(best);
  }
  return table;
}

}  // namespace

std::size_t make_well_composed(BitGrid& cells) {
  static const std::array<std::uint8_t, 256> repaired = repair_table();
  std::size_t added = 0, before = 0;
  do {
    before = added;
    each_mixed_cube(cells, [&](const Vector3i& at, unsigned) {
      const unsigned bits = cube_bits(cells, at);  // as the cubes before have left it
      for (unsigned more = repaired[bits] & ~bits; more != 0; more &= more - 1) {
        const Vector3i cell = at + corner_offset(std::countr_zero(more));
        cells.set(cell.x(), cell.y(), cell.z());
        ++added;
      }
    });
  } while (added > before);
  return added;
}

geometry::Mesh boundary_mesh(const BitGrid& cells, const Eigen::Vector3d& origin_m, double cell_m) {
  geometry::Mesh mesh;
  LatticeIndex vertex_of(cells.size());
  // The vertex in the middle of a block of cells has the number of the block.
  each_mixed_cube(cells, [&](const Vector3i& block, unsigned) {
    vertex_of.add(block, 0);
    mesh.vertices_m.emplace_back(origin_m + cell_m * (block + Vector3i::Ones()).cast<double>());
  });
  vertex_of.finish();
  each_mixed_cube(cells, [&](const Vector3i& block, unsigned bits) {
    for (int axis = 0; axis < 3; ++axis) {
      // The face between the block's last cell and the one before it along the axis.
      const int last = 7, before = last ^ 1 << axis;
      const bool is_last_set = (bits >> last & 1) != 0;
      if (is_last_set == ((bits >> before & 1) != 0)) continue;
      const Vector3i u = Vector3i::Unit((axis + 1) % 3), v = Vector3i::Unit((axis + 2) % 3);
      const std::uint32_t a = vertex_of.find(block, 0), b = vertex_of.find(block + u, 0),
                          c = vertex_of.find(block + u + v, 0), d = vertex_of.find(block + v, 0);
      if (is_last_set) {  // the outside is towards the axis's start
        mesh.triangles.push_back({a, d, c});
        mesh.triangles.push_back({a, c, b});
      } else {
        mesh.triangles.push_back({a, b, c});
        mesh.triangles.push_back({a, c, d});
      }
    }
  });
  return mesh;
}

}  // namespace fivepipe::surface
