// Triangles of virtual objects in the world, and their layout in a viewport for volume queries
// (paper, section 4.2.4).
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "common/geometry/mesh.h"

namespace fivepipe::collision {

using Triangle = std::array<Eigen::Vector3d, 3>;  // world [m]

// Returns the mesh's triangles in the world [m], in the mesh's order.
std::vector<Triangle> world_triangles(const geometry::Mesh& mesh,
                                      const Eigen::Isometry3d& world_from_object);

// Orthographic view of a triangle along its normal, stretched to fill the unit square (the
// viewport): x runs along its longest edge, y from that edge to the third vertex. Every triangle
// covers half of the square.
//
//   y = 1  +----apex-----+   With u x v samples of the square, the spacing is the longest edge / u
//          |   /    \    |   by the height / v: the paper's x/u by y/v.
//          |  /      \   |
//          | /        \  |   A degenerate triangle (collinear, or with a zero edge) covers its half
//   y = 0  base0---base1 +   too: its samples are on its longest edge, or all at one point.
//
// The view depends on the set of vertices alone: every permutation gives the same bits.
struct TriangleView {
  Eigen::Vector3d base0_world_m, base1_world_m, apex_world_m;
  double apex_x = 0.5;      // 0..1
  bool degenerate = false;  // height below kDegenerateHeight of the longest edge
};
// Returns the view of a triangle in the world [m].
TriangleView view_of(const Triangle& triangle);

// Ratio of height to longest edge below which coordinates in double do not distinguish a triangle
// from a line.
inline constexpr double kDegenerateHeight = 1e-12;

// Returns the world point [m] at (x, y) of the square. Clamps points outside the triangle to its
// border: a rasteriser that snaps vertices to 1/256 px covers some of them, and each becomes a
// point of the triangle.
Eigen::Vector3d point_at(const TriangleView& view, double x, double y);

}  // namespace fivepipe::collision
