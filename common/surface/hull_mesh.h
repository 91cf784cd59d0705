// The closed surface of the visual hull of one frame, as triangles.
//
// Marching cubes over a lattice of points (cube_loops.h). Each vertex is put on the border of the
// exact hull by bisection between an inside and an outside point of the lattice, so the mesh is
// much more accurate than the lattice is fine. Where the box cuts the hull, the mesh closes there.
#pragma once
#include "common/geometry/mesh.h"
#include "common/hull/query/hull_query.h"

namespace fivepipe::surface {

struct HullMeshOptions {
  Eigen::AlignedBox3d within_world_m;  // not empty, finite; the mesh is that of the hull in it
  // Distance between points of the lattice. Of parts of the hull that are thinner, some or all may
  // be missing.
  double cell_m = 0.004;
};

// Maximum number of points of the lattice. Each needs one bit.
inline constexpr std::size_t kMaxLatticePoints = std::size_t{1} << 31;

// Returns the mesh in the world frame [m]. It is closed (geometry::open_edges() is 0), each edge
// belongs to two triangles, and the triangles at a vertex form one fan. It is empty if no point of
// the lattice is in the hull. A vertex is within 2 % of a cell of the hull's border, along a line
// of the lattice; the rest of a triangle is in the cube of the lattice in which its vertices are.
// Two triangles of one such cube may cross where the hull is thinner than it. The result does not
// depend on the number of threads of the hull's pool. Throws std::invalid_argument if an option is
// out of range.
geometry::Mesh hull_mesh(const hull::HullQuery& query, const HullMeshOptions& options);

}  // namespace fivepipe::surface
