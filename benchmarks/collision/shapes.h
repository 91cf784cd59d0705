// Parts that virtual assemblies are built of, for the benchmark's scenes: closed meshes in their
// own frames.
#pragma once
#include "common/geometry/mesh.h"

namespace fivepipe::collision_bench {

// Along z, centred on the origin; inner_radius_m 0: a solid cylinder of 4 * sides - 4 triangles,
// else a tube of 8 * sides.
geometry::Mesh tube_mesh(double radius_m, double inner_radius_m, double length_m, int sides);

// An L along z of two plates; 20 triangles.
geometry::Mesh bracket_mesh(double leg_m, double thickness_m, double length_m);

void append(geometry::Mesh& assembly, const geometry::Mesh& part,
            const Eigen::Isometry3d& assembly_from_part);

// A chair 0.9 m high, seat at 0.45 m; feet on z = 0, its front towards -y. Of boxes.
geometry::Mesh chair_mesh();
// A table of boxes; feet on z = 0, its top's upper side at height_m.
geometry::Mesh table_mesh(double width_m, double depth_m, double height_m);

// A satellite's payload section, 0.5 m wide, standing on z = 0: base plate, housing of plates and
// brackets, tubes, lenses, cables' clamps, and bolts until there are `triangles` of them (to within
// a bolt's 44).
geometry::Mesh payload_mesh(std::size_t triangles);

}  // namespace fivepipe::collision_bench
