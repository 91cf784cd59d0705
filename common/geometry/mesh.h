// Triangle meshes of virtual objects.
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace fivepipe::geometry {

// Vertices in the object's own frame [m]; triangles by vertex index, counter-clockwise seen from
// outside.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Box centred on the origin, edges along the axes. Its faces are divided into cells with edges of
// cell_m at most; 0: into none, 12 triangles.
Mesh box_mesh(const Eigen::Vector3d& size_m, double cell_m = 0);

// Icosphere centred on the origin: 20 * 4^subdivisions triangles, vertices on the sphere.
Mesh sphere_mesh(double radius_m, int subdivisions);

// The paper's curtain (section 4.5): a folded sheet hanging from z = 0 to z = -height in the plane
// y = 0, centred on x = 0, 2 * columns * rows triangles; folds: depth of the sine in y [m] and how
// many over the width.
Mesh curtain_mesh(double width_m, double height_m, int columns, int rows, double fold_depth_m,
                  double fold_count);

Eigen::AlignedBox3d bounds_m(const Mesh& mesh);

}  // namespace fivepipe::geometry
