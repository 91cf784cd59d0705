// Which virtual objects collide with the visual hull, and where (paper, sections 4.2.4 and 4.4.1):
// boxes first, then triangles.
//
//   1. image     the object's axis-aligned world box, in the images alone: one camera without
//   object pixels there certifies
//                that the object is free (is_certainly_free).
//   2. box       the faces of the boxes left, 12 triangles each, volume-queried all together (the
//   paper's optimisation).
//                Any point in the hull: candidate.
//   3. cells     a box whose faces touch nothing may still hold a part of the hull wholly inside,
//   which the paper's boxes
//                miss: it is split and asked in the images again. Cells left over: candidate; none:
//                certified free.
//   4. triangles those of all candidates, volume-queried together.
//
// So `free` is certain, whatever the sampling; `colliding` is certain; between them lies
// `touching`: the box holds, or may hold, hull points, and no sample of the surface is one of them.
// The hull may lie wholly inside the object, or be thinner than the sampling where it meets the
// surface.
#pragma once
#include "common/collision/detection/paper/triangle_volume_query.h"

namespace fivepipe::collision {

// How many objects each stage passed; objects = free_by_image + box_touched + free_by_cells +
// box_may_hold.
struct DetectionCounts {
  std::size_t objects = 0, free_by_image = 0, box_touched = 0, free_by_cells = 0, box_may_hold = 0,
              colliding = 0;
  std::size_t triangles_queried = 0, triangles_degenerate = 0,
              points_unconfirmed = 0;  // boxes apart
};

struct Detection {
  std::vector<ObjectCollision> objects;  // as given
  DetectionCounts counts;
};

// Against query.silhouettes(). Objects without triangles are free. Throws std::invalid_argument
// where a vertex is not finite.
Detection detect(TriangleVolumeQuery& query,
                 std::span<const std::vector<Triangle>> objects_world_m);

// Stage 3 splits so often: cells of an eighth of the box's edges, 512 at most.
inline constexpr int kCellDepth = 3;

}  // namespace fivepipe::collision
