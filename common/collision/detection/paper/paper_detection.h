// The paper's method: which objects collide with the visual hull, and at which points (paper,
// sections 4.2.4 and 4.4.1). It tests bounding boxes first, then triangles.
//
//   1. image      Tests the object's axis-aligned world box in the images alone. One camera without
//                 an object pixel in the box's image certifies the object free
//                 (is_certainly_free()).
//   2. box        Volume-queries the faces of the remaining boxes, 12 triangles each, all together
//                 (the paper's optimisation). An object with a sample in the hull is a candidate.
//   3. cells      A box whose faces have no sample in the hull may still contain a whole part of
//                 the hull, which the paper's boxes miss. The box is split into cells, which are
//                 tested in the images. If a cell is not certified, the object is a candidate;
//                 otherwise it is certified free.
//   4. triangles  Volume-queries the triangles of all candidates together.
//
// `free` is certified for any sampling, and so is `colliding`. An object is `undecided` if its box
// contains, or may contain, hull points and no sample of its surface is one of them: the hull may
// be wholly inside the object, may be thinner than the sampling at the places where it meets the
// surface, or may be outside the object.
#pragma once
#include "common/collision/detection/paper/triangle_volume_query.h"

namespace fivepipe::collision {

// Number of objects by the stage that decided them;
// objects = free_by_image + box_colliding + free_by_cells + box_may_hold.
struct DetectionCounts {
  std::size_t objects = 0, free_by_image = 0, box_colliding = 0, free_by_cells = 0,
              box_may_hold = 0, colliding = 0;
  // Counts of stage 4: triangles, and samples that in_hull() rejects.
  std::size_t triangles_queried = 0, points_unconfirmed = 0;
};

struct Detection {
  std::vector<ObjectCollision> objects;  // in the given order
  DetectionCounts counts;
};

// Tests the objects against query.silhouettes(). An object without triangles is free. Throws
// std::invalid_argument if a vertex is not finite.
Detection detect(TriangleVolumeQuery& query,
                 std::span<const std::vector<Triangle>> objects_world_m);

// Number of splits in stage 3: cells of an eighth of the box's edges, at most 512.
inline constexpr int kCellDepth = 3;

}  // namespace fivepipe::collision
