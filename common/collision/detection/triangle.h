// Triangles of virtual objects in the world, and how each is laid into a viewport for
// volume-querying (paper, section 4.2.4).
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "common/geometry/mesh.h"

namespace fivepipe::collision {

using Triangle = std::array<Eigen::Vector3d, 3>;  // world [m]

// The mesh's triangles in the world, in the mesh's order.
std::vector<Triangle> world_triangles(const geometry::Mesh& mesh,
                                      const Eigen::Isometry3d& world_from_object);

// A triangle seen along its normal, orthographically, stretched to fill the unit square (the
// viewport): x along its longest edge, y from that edge to the third vertex. Half of the square is
// covered, whatever the triangle's shape:
//
//   y=1 +--apex------+     spacing of u x v samples: longest edge / u by height / v, the paper's
//   x/u by y/v
//       |  /    \    |
//       | /        \ |     A degenerate triangle (collinear, zero edge) covers its half too: its
//       samples then lie on
//   y=0 base0----base1     its longest edge, or all on its one point.
//
// Depends on the set of vertices alone: every permutation of them gives the same view, to the bit.
struct TriangleView {
  Eigen::Vector3d base0_world_m, base1_world_m, apex_world_m;
  double apex_x = 0.5;      // 0..1
  bool degenerate = false;  // height below kDegenerateHeight of the longest edge
};
TriangleView view_of(const Triangle& triangle);

// Height over longest edge under which double coordinates no longer tell a triangle from a line.
inline constexpr double kDegenerateHeight = 1e-12;

// The world point [m] seen at (x, y) of the square. Points beside the triangle are brought to its
// border, so that what a rasteriser takes for covered (it snaps vertices to 1/256 of a pixel) is
// always a point of the triangle.
Eigen::Vector3d point_at(const TriangleView& view, double x, double y);

}  // namespace fivepipe::collision
