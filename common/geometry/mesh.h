// Triangle meshes of virtual objects.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace fivepipe::geometry {

// Vertices are in the object frame [m]. A triangle holds three vertex indices, counter-clockwise as
// seen from outside.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Returns an axis-aligned box centered on the origin. If cell_m > 0, its faces are divided into
// cells with edges of at most cell_m; otherwise the box has 12 triangles.
Mesh box_mesh(const Eigen::Vector3d& size_m, double cell_m = 0);

// Returns an icosphere centered on the origin with 20 * 4^subdivisions triangles. Every vertex is
// on the sphere.
Mesh sphere_mesh(double radius_m, int subdivisions);

// Returns the paper's curtain (section 4.5): a folded sheet in the plane y = 0, centered on x = 0,
// from z = 0 down to z = -height_m, with 2 * columns * rows triangles. The folds are a sine in y
// with amplitude fold_depth_m and fold_count periods over the width.
Mesh curtain_mesh(double width_m, double height_m, int columns, int rows, double fold_depth_m,
                  double fold_count);

// Returns the bounding box of the vertices, in the object frame [m]. It is empty for an empty mesh.
Eigen::AlignedBox3d bounds_m(const Mesh& mesh);

}  // namespace fivepipe::geometry
