// Whether the triangles of a mesh bound a body.
#pragma once
#include <cstddef>

#include "common/geometry/mesh.h"

namespace fivepipe::geometry {

// Returns the number of edges that the triangles do not use equally often in both directions. 0:
// the mesh is closed, and may be the boundary of a body. Vertices at the same position are one
// vertex.
std::size_t open_edges(const Mesh& mesh);

// Returns the volume that a closed mesh encloses [m3], by the divergence theorem: negative if its
// triangles are clockwise seen from outside.
double enclosed_volume_m3(const Mesh& mesh);

}  // namespace fivepipe::geometry
