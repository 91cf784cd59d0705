// Marks that render_node draws over the composite if the scene lists them.
#pragma once

namespace fivepipe::config {

// Each shows a part of the objects' collision results. collision_points: CP_i. recovery: the move
// out of the hull, from CP_obj along V_rec to CP_hull. hull_normals: N_hull at CP_hull. proximity:
// the distances to the hull below the cap.
enum class Overlay { collision_points, recovery, hull_normals, proximity };

}  // namespace fivepipe::config
