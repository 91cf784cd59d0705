// The boundary of a set of cells, as a closed mesh.
#pragma once
#include "common/geometry/mesh.h"
#include "common/surface/bit_grid.h"

namespace fivepipe::surface {

// Adds the fewest cells to each 2 x 2 x 2 block in which the cells, or the missing ones, touch only
// at an edge or a corner, until there is no such block (well-composed sets: Latecki, 1997). Returns
// the number of added cells. The outermost cells of the grid must be missing; they stay so.
std::size_t make_well_composed(BitGrid& cells);

// Returns the faces between cells and missing cells, two triangles each, counter-clockwise as seen
// from the missing cell. Cell (x, y, z) extends from origin_m + cell_m (x, y, z) to
// origin_m + cell_m (x + 1, y + 1, z + 1). The cells must be well-composed: each edge then belongs
// to two triangles, and no two vertices are at the same position.
geometry::Mesh boundary_mesh(const BitGrid& cells, const Eigen::Vector3d& origin_m, double cell_m);

}  // namespace fivepipe::surface
