// Parts of the virtual objects in the benchmark's scenes: closed meshes in their own frames.
#pragma once
#include "common/geometry/mesh.h"

namespace fivepipe::collision_bench {

// An unrotated pose at this position.
inline Eigen::Isometry3d at(double x_m, double y_m, double z_m) {
  return Eigen::Isometry3d(Eigen::Translation3d(x_m, y_m, z_m));
}

// A tube of 8 * sides triangles along z, centered on the origin; if inner_radius_m is 0, a solid
// cylinder of 4 * sides - 4 triangles.
geometry::Mesh tube_mesh(double radius_m, double inner_radius_m, double length_m, int sides);

// An L-shaped profile of two plates along z; 20 triangles.
geometry::Mesh bracket_mesh(double leg_m, double thickness_m, double length_m);

void append(geometry::Mesh& assembly, const geometry::Mesh& part,
            const Eigen::Isometry3d& assembly_from_part);

// A chair made of boxes, 0.9 m high with the seat at 0.45 m; feet on z = 0, front towards -y.
geometry::Mesh chair_mesh();
// A table made of boxes; feet on z = 0, upper side of the top at height_m.
geometry::Mesh table_mesh(double width_m, double depth_m, double height_m);

// The payload section of a satellite, 0.5 m wide, standing on z = 0: base plate, housing of plates
// and brackets, tubes, lenses, cable clamps, and bolts until there are at least `triangles`
// triangles (a bolt has 44).
geometry::Mesh payload_mesh(std::size_t triangles);

}  // namespace fivepipe::collision_bench
