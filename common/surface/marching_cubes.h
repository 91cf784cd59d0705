// Marching cubes over a lattice of points that are inside or outside.
#pragma once
#include <span>

#include "common/geometry/mesh.h"
#include "common/surface/bit_grid.h"
#include "common/surface/lattice_index.h"

namespace fivepipe::surface {

// An edge of the lattice, by its ends.
struct CrossedEdge {
  Eigen::Vector3i inside, outside;
};

class MarchingCubes {
 public:
  // Borrows the grid, whose outermost points must be outside.
  explicit MarchingCubes(const BitGrid& inside);

  // The edges that the surface crosses.
  std::span<const CrossedEdge> edges() const { return edges_; }
  // Returns the surface with these vertices, one per element of edges(), and a few more. It is
  // closed and counter-clockwise as seen from outside; each edge belongs to two triangles, and the
  // triangles at a vertex form one fan.
  geometry::Mesh mesh(std::vector<Eigen::Vector3d> vertices_m) const;

 private:
  const BitGrid& inside_;
  LatticeIndex index_;
  std::vector<CrossedEdge> edges_;
};

}  // namespace fivepipe::surface
