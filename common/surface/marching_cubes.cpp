#include "common/surface/marching_cubes.h"

#include <algorithm>
#include <array>

#include "common/surface/cube_loops.h"

namespace fivepipe::surface {

using Eigen::Vector3d;
using Eigen::Vector3i;

// The first corner of a mixed cube adds its edges; those of the other corners belong to the cubes
// that begin there.
MarchingCubes::MarchingCubes(const BitGrid& inside) : inside_(inside), index_(inside.size()) {
  each_mixed_cube(inside, [&](const Vector3i& at, unsigned bits) {
    for (int axis = 0; axis < 3; ++axis) {
      // As a comparison of two bools, GCC 12.2 compiles this wrongly at -O1; it is right at -O0,
      // -O2 and -O3, with -fno-move-loop-invariants, and with Clang.
      if (((bits ^ bits >> (1 << axis)) & 1) == 0) continue;
      const bool is_inside = (bits & 1) != 0;
      const Vector3i next = at + Vector3i::Unit(axis);
      index_.add(at, axis);
      edges_.push_back(is_inside ? CrossedEdge{at, next} : CrossedEdge{next, at});
    }
  });
  index_.finish();
}

geometry::Mesh MarchingCubes::mesh(std::vector<Vector3d> vertices_m) const {
  geometry::Mesh mesh{std::move(vertices_m), {}};
  each_mixed_cube(inside_, [&](const Vector3i& at, unsigned bits) {
    const CubeSurface& surface = cube_surface(bits);
    std::array<std::uint32_t, kCubeEdges + kMaxLoops> vertex{};
    for (std::size_t i = 0; i < surface.loops.size(); ++i) {
      const CubeSurface::Loop& loop = surface.loops[i];
      Vector3d sum_m = Vector3d::Zero();
      for (const int edge : loop.edges) {
        const Vector3i begin = at + corner_offset(kEdgeCorner[std::size_t(edge)]);
        vertex[std::size_t(edge)] = index_.find(begin, edge_axis(edge));
        sum_m += mesh.vertices_m[vertex[std::size_t(edge)]];
      }
      if (!loop.has_middle) continue;
      vertex[kCubeEdges + i] = std::uint32_t(mesh.vertices_m.size());
      mesh.vertices_m.emplace_back(sum_m / double(loop.edges.size()));
    }
    for (const auto& [a, b, c] : surface.triangles)
      mesh.triangles.push_back(
          {vertex[std::size_t(a)], vertex[std::size_t(b)], vertex[std::size_t(c)]});
  });
  return mesh;
}

}  // namespace fivepipe::surface
